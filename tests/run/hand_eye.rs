//! A camera on the hand that sees a board: the shipped cell from the run to the model that is written back, and tables of orientations that are refused.

use serde_json::Value;

use crate::lab::Lab;

/// Of the world file: camera on the flange, board in the world, mm.
const TRUTH: [(&str, [f64; 3]); 2] = [("p1", [30.0, -60.0, 45.0]), ("board", [-480.0, -110.0, 5.0])];

/// By how many standard errors a number of a placement is off at most.
fn off(placed: &Value, truth: [f64; 3]) -> f64 {
    let part = |key: &str, axis: usize| placed[key][axis].as_f64().unwrap();
    (0..3).map(|axis| ((part("xyz_mm", axis) - truth[axis]) / part("se_mm", axis)).abs()).fold(0.0, f64::max)
}

#[test]
fn the_shipped_cell_finds_camera_and_board_and_writes_them_back() {
    let lab = Lab::of("ur5");
    let run = lab.plumb(&["run", "cell-hand-eye.yaml", "--headless"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let table = lab.plumb(&["show", "--table"]);
    assert_eq!(table.code(), 0, "{}", table.all());
    assert!(table.out().contains("board_x_mm") && table.out().contains("board_rz_rad"), "{}", table.out());
    lab.write("board.csv", &table.out());
    let pair = ["hand-eye.model.yaml", "--data", "board.csv", "--holdout", "none"];
    let output = lab.plumb(&[&["model", "compare"], &pair[..]].concat());
    assert_eq!(output.code(), 0, "{}", output.all());
    for part in [
        "p1 on the flange: x ",
        "board in the frame of the measurements: x ",
        "error of an orientation or angle, deg",
        "about its x, y, z",
    ] {
        assert!(output.out().contains(part), "{part}\n{}", output.out());
    }
    let report = lab.plumb(&[&["model", "report", "-o", "report.html"], &pair[..]].concat());
    assert_eq!(report.code(), 0, "{}", report.all());
    let page = std::fs::read_to_string(lab.path("report.html")).unwrap();
    // A plot of its own, with its own unit, beside that of the positions.
    assert!(page.contains("orientation of a row off, deg") && page.contains("error of a row, mm"), "{page}");
    let accepted = lab.plumb(&[&["model", "accept", "--json"], &pair[..]].concat());
    assert_eq!(accepted.code(), 0, "{}", accepted.all());
    let json: Value = serde_json::from_str(&accepted.out()).unwrap();
    for (name, truth) in TRUTH {
        let placed = json["placed"].as_array().unwrap().iter().find(|placed| placed["name"] == name).unwrap();
        assert!(off(placed, truth) < 4.0, "{placed}");
        assert!((0..3).all(|axis| placed["se_mm"][axis].as_f64().unwrap() < 0.5), "{placed}");
    }
    // The revision says so, and is where the next fit begins.
    let revision = std::fs::read_to_string(lab.path("hand-eye.model.rev1.yaml")).unwrap();
    assert!(
        revision.contains("rpy_deg: [") && revision.contains("board: {seen_by: p1, xyz_mm: [-4"),
        "{revision}"
    );
    assert_eq!(lab.plumb(&["check", "hand-eye.model.rev1.yaml"]).code(), 0);
    let next = lab.plumb(&[&["model", "next", "-n", "3", "--csv"], &pair[..3]].concat());
    assert_eq!(next.code(), 0, "{}", next.all());
    assert!(next.out().lines().count() >= 4, "{}", next.out());
}

const MODEL: &str = "arm: planar
convention: distal
joints:
  - {name: shoulder, a_mm: 300, limits_deg: [-170, 170]}
  - {name: elbow, a_mm: 200, limits_deg: [-170, 170]}
targets: {p1: {xyz_mm: [0, 0, 0]}}
free: []
effects: []
";

#[test]
fn orientations_that_are_none_are_refused_where_they_are_written_with_what_would_be_right() {
    let lab = Lab::new();
    lab.write("planar.yaml", MODEL);
    for (header, row, parts) in [
        (
            "p1_qw,p1_qx,p1_qy",
            "1,0,0",
            [
                "line 1, column 3 (`p1_qw`)",
                "lacks its qz; it needs the columns p1_qw, p1_qx, p1_qy and p1_qz",
            ],
        ),
        (
            "p1_qw,p1_qx,p1_qy,p1_qz",
            "0,0,0,0",
            ["line 2, column 3 (`p1_qw`)", "four zeros is no orientation"],
        ),
        ("p1_qw,p1_qx,p1_qy,p1_qz", "0.9,0.5,0,0", ["has length 1.0296", "within 0.01"]),
        ("p1_rx,p1_ry,p1_rz", "0,0,0", ["column 3 (`p1_rx`): the unit is missing", "p1_rx_rad or p1_rx_deg"]),
        ("p1_rx_rad,p1_ry_rad,p1_rz_rad", "0,0,90", ["90.0 rad long", "the columns end in _deg"]),
        (
            "p1_qw,p1_qx,p1_qy,p1_qz,p1_rx_rad,p1_ry_rad,p1_rz_rad",
            "1,0,0,0,0,0,0",
            ["column 7 (`p1_rx_rad`)", "given twice"],
        ),
        (
            "board_rx_rad,board_ry_rad,board_rz_rad",
            "0,0,1",
            ["`board: {seen_by: p1}`", "a fixed camera sees is a target"],
        ),
        ("p1_roll_deg,p1_x_mm", "0,1", ["column 3 (`p1_roll_deg`)", "in which order they turn"]),
    ] {
        lab.write("table.csv", &format!("q1_deg,q2_deg,{header}\n10,20,{row}\n"));
        let printed = lab.plumb(&["model", "compare", "planar.yaml", "--data", "table.csv"]);
        assert_eq!(printed.code(), 2, "{header}: {}", printed.all());
        assert!(parts.iter().all(|part| printed.err().contains(part)), "{header}: {}", printed.err());
    }
}

#[test]
fn a_camera_that_is_turned_away_from_the_board_fails_the_run_and_says_so() {
    let lab = Lab::of("ur5");
    lab.edit("world-hand-eye.yaml", "rpy_deg: [2, -3, 88]", "rpy_deg: [92, -3, 88]");
    let run = lab.plumb(&["run", "cell-hand-eye.yaml", "--headless"]);
    assert_ne!(run.code(), 0);
    assert!(run.all().contains("does not see the board from here"), "{}", run.all());
    lab.plumb(&["doctor", "--clean", "cell-hand-eye.yaml"]);
}

/// Corners of a board of 4 x 3 inner corners square before a camera of 800 px, 400 mm off: a square of 20 mm is 40 px.
fn corners(picture: &str) -> String {
    (0..12).map(|n| format!("{picture},{n},{},{}\n", 320 + 40 * (n % 4), 240 + 40 * (n / 4))).collect()
}

#[test]
fn corners_in_pixels_become_a_table_of_boards_and_what_is_none_is_refused() {
    let lab = Lab::new();
    lab.write("poses.csv", "q1_deg,q2_deg,picture\n10,20,a.png\n30,40,b.png\n");
    lab.write("corners.csv", &format!("picture,corner,u_px,v_px\n{}{}", corners("a.png"), corners("b.png")));
    let usual =
        ["model", "board", "poses.csv", "--corners", "corners.csv", "--size", "4x3", "--square-mm", "20"];
    let with = |camera: &str| lab.plumb(&[&usual[..], &["--camera", camera]].concat());
    let made = with("800,800,320,240");
    assert_eq!(made.code(), 0, "{}", made.all());
    let mut lines = made.out().lines().map(str::to_owned).collect::<Vec<_>>().into_iter();
    assert!(lines.next().unwrap().ends_with(
        "picture,board_x_mm,board_y_mm,board_z_mm,board_rx_rad,board_ry_rad,board_rz_rad,corners_off_px"
    ));
    let cells: Vec<String> = lines.next().unwrap().split(',').map(str::to_owned).collect();
    assert!((cells[5].parse::<f64>().unwrap() - 400.0).abs() < 1e-4, "{cells:?}");
    for (printed, part) in [
        (with("800,800"), "write fx,fy,cx,cy in px"),
        (
            lab.plumb(&[
                "model",
                "board",
                "poses.csv",
                "--corners",
                "lost.csv",
                "--size",
                "4x3",
                "--square-mm",
                "20",
                "--camera",
                "8,8,3,2",
            ]),
            "lost.csv",
        ),
        (
            lab.plumb(&[
                "model",
                "board",
                "poses.csv",
                "--corners",
                "corners.csv",
                "--size",
                "3x3",
                "--square-mm",
                "20",
                "--camera",
                "800,800,320,240",
            ]),
            "there is no corner 9; a board of 3 x 3",
        ),
        (
            lab.plumb(&[
                "model",
                "board",
                "poses.csv",
                "--corners",
                "corners.csv",
                "--size",
                "4",
                "--square-mm",
                "20",
                "--camera",
                "800,800,320,240",
            ]),
            "write 9x6 for a board of 10 x 7 squares",
        ),
    ] {
        assert_eq!(printed.code(), 2, "{}", printed.all());
        assert!(printed.err().contains(part), "{part}: {}", printed.err());
    }
}

#[test]
fn corners_of_several_boards_in_one_picture_become_a_row_each() {
    let lab = Lab::new();
    lab.write("poses.csv", "q1_deg,q2_deg,picture\n10,20,a.png\n30,40,b.png\n");
    let of = |picture: &str, board: &str| {
        corners(picture).lines().map(|line| format!("{line},{board}\n")).collect::<String>()
    };
    lab.write(
        "corners.csv",
        &format!(
            "picture,corner,u_px,v_px,board\n{}{}{}",
            of("a.png", "left"),
            of("a.png", "right"),
            of("b.png", "left")
        ),
    );
    let made = |sizes: &[&str]| {
        lab.plumb(
            &[
                &["model", "board", "poses.csv", "--corners", "corners.csv", "--camera", "800,800,320,240"],
                sizes,
            ]
            .concat(),
        )
    };
    let printed = made(&["--size", "4x3", "--square-mm", "left=20", "--square-mm", "right=10"]);
    assert_eq!(printed.code(), 0, "{}", printed.all());
    let rows: Vec<(String, f64)> = printed
        .out()
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            (cells[3].to_owned(), cells[6].parse().unwrap())
        })
        .collect();
    let names: Vec<&str> = rows.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["left", "right", "left"], "{}", printed.out());
    // Half the square at the same pixels is half as far.
    assert!((rows[0].1 - 400.0).abs() < 1e-4 && (rows[1].1 - 200.0).abs() < 1e-4, "{rows:?}");
    let unknown = made(&["--size", "4x3", "--square-mm", "left=20"]);
    assert!(
        unknown.code() == 2 && unknown.err().contains("how large the board `right` is"),
        "{}",
        unknown.all()
    );
}
