//! Examples of the commands whose results leave for other programs and other people.

use super::example::{Entry, example};

pub(super) const RESULT_EXAMPLES: &[Entry] = &[
    (
        "model board",
        &[
            example(
                "plumb model board poses.csv --corners corners.csv --size 9x6 --square-mm 25 --camera 812,811,641,362 > board.csv",
                "from corners in pixels: 10 x 7 squares of 25 mm",
            ),
            example(
                "plumb model board poses.csv --corners corners.csv --size 9x6 --square-mm 25 --camera 812,811,641,362,-0.11,0.07",
                "with a lens that bends",
            ),
        ],
    ),
    (
        "model profile",
        &[
            example(
                "plumb model profile poses.csv --points points.csv > profiles.csv",
                "five points of each profile of a laser line sensor, as it exports them",
            ),
            example(
                "plumb model profile poses.csv --points points.csv --keep 9 > profiles.csv",
                "nine, where the surface bends much within one profile",
            ),
        ],
    ),
    (
        "model export",
        &[
            example(
                "plumb model export ur5/ur5.model.yaml --as urdf > ur5.urdf",
                "its newest revision for ROS or a planner",
            ),
            example(
                "plumb model export ur5/ur5.model.yaml --as ros-calibration --leave-out > calibration.yaml",
                "for the driver of a UR, without what it cannot hold",
            ),
            example(
                "plumb model export ur5/ur5.model.yaml --as targets --poses program.csv > targets.csv",
                "a program's joint targets, compensated",
            ),
            example(
                "plumb model export gantry.yaml --as linuxcnc --joint x > x.comp",
                "a joint's compensation file for LinuxCNC",
            ),
        ],
    ),
    (
        "report iso230",
        &[
            example("plumb report iso230 axis.csv", "accuracy, repeatability and reversal error of an axis"),
            example(
                "plumb report iso230 axis.csv --model gantry.yaml --digits 5 -o axis.html",
                "as a page, with an uncertainty budget by effect",
            ),
        ],
    ),
    (
        "report iso9283",
        &[
            example("plumb report iso9283 poses.csv", "accuracy and repeatability of a robot's poses"),
            example(
                "plumb report iso9283 poses.csv --model ur5/ur5.model.yaml --json",
                "commanded places by a model; for another program",
            ),
        ],
    ),
];
