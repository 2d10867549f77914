//! Examples of the commands for many cells and many runs.

use super::example::{Entry, example};

pub(super) const CELLS_EXAMPLES: &[Entry] = &[
    (
        "queue add",
        &[
            example(
                "plumb queue add teachmover/cell.yaml",
                "the cell's first procedure, after those that wait",
            ),
            example(
                "plumb queue add teachmover/cell.yaml shoulder-elbow-initialization --set Br_deg=10 --first",
                "another one with another back rotation, before them",
            ),
        ],
    ),
    (
        "queue list",
        &[
            example("plumb queue list", "of all cells of this record"),
            example("plumb queue list teachmover/cell.yaml --json", "of one, for another program"),
        ],
    ),
    (
        "queue move",
        &[
            example("plumb queue move 4 --first", "entry 4 is next"),
            example("plumb queue move 4 --after 2", "entry 4 follows entry 2"),
        ],
    ),
    (
        "queue remove",
        &[
            example("plumb queue remove 4", "entry 4 is not run"),
            example("plumb queue remove 4 5 6", "nor are these"),
        ],
    ),
    (
        "queue run",
        &[
            example("plumb queue run teachmover/cell.yaml", "until it is empty or a run does not pass"),
            example(
                "plumb queue run teachmover/cell.yaml --past-failed --wait",
                "for as long as the cell works, past runs that failed",
            ),
        ],
    ),
    (
        "serve",
        &[
            example("plumb serve", "a page to read, on this machine's port 8717"),
            example(
                "plumb serve --token-file ~/.config/plumb-token",
                "answers are taken too, with that token",
            ),
        ],
    ),
    (
        "ship",
        &[
            example("plumb ship --to postgres://plumb@db.lab.example/plumb", "for as long as the cell works"),
            example("plumb ship --to postgres://plumb@localhost/plumb --once", "what is there now"),
            example(
                "plumb ship --to postgres://plumb@localhost/plumb --trim 90",
                "and forget what it has had for three months",
            ),
        ],
    ),
    (
        "fleet",
        &[
            example("plumb fleet --from postgres://plumb@localhost/plumb", "every cell, and which one waits"),
            example(
                "plumb fleet --from postgres://plumb@localhost/plumb --trend arm.waist",
                "a correction over time, with control limits",
            ),
            example(
                "plumb fleet --from postgres://plumb@localhost/plumb --screen",
                "renewed every two seconds",
            ),
            example("plumb fleet --from postgres://plumb@localhost/plumb --serve", "as a page, on port 8718"),
        ],
    ),
    (
        "alert",
        &[
            example(
                "plumb alert --mail ada@lab.example --prompt-after 10min",
                "when a prompt has waited for ten minutes",
            ),
            example(
                "plumb alert --webhook https://chat.lab.example/hooks/plumb --ended",
                "to a chat, also when a run ends otherwise than passed",
            ),
            example(
                "plumb alert --from postgres://plumb@localhost/plumb --mail ada@lab.example --silent-after 30min",
                "of all cells, also when one was not heard of",
            ),
            example("plumb alert --mail ada@lab.example --test", "does it arrive?"),
        ],
    ),
];
