//! Several boards that one camera on the hand sees, each somewhere of its own, distinguished by the column `board`.

use plumb_calibration::arm_model::Model;
use plumb_calibration::file::model_text;
use plumb_diagnosis::Requested;
use plumb_diagnosis::laboratory::Options;
use plumb_estimation::Progress;
use plumb_report::diagnosis_sentence;

use super::made_up::{laboratory, try_laboratory};
use super::whole_poses::{
    ARM, HEADER, Pose, board, camera, compared, flange, off, pictures_of, pose, without_holdout,
};

const SOUND: [f64; 6] = [0.0; 6];

/// mm and deg, an axis.
const NOISE: (f64, f64) = (0.1, 0.02);

/// A second board, on a wall to the right.
fn wall() -> Pose {
    pose([300.0, -520.0, 350.0], [95.0, 10.0, 20.0])
}

fn table(rows: &[(&str, Vec<String>)]) -> String {
    let lines = rows.iter().flat_map(|(name, rows)| rows.iter().map(move |row| format!("{row},{name}\n")));
    format!(
        "{HEADER}tvec_x_mm,tvec_y_mm,tvec_z_mm,rvec_x_rad,rvec_y_rad,rvec_z_rad,board\n{}",
        lines.collect::<String>()
    )
}

fn model(free: &str, noise: &str) -> String {
    format!(
        "{ARM}targets: {{p1: {{}}}}\nboards: {{floor: {{seen_by: p1}}, wall: {{seen_by: p1}}}}\nfree: {free}\nnoise: {noise}\n"
    )
}

fn two(on_the_floor: usize, on_the_wall: usize, seed: u64, zeros: &[f64; 6]) -> String {
    table(&[
        ("wall", pictures_of(&wall(), on_the_wall, NOISE, seed, zeros, false)),
        ("floor", pictures_of(&board(), on_the_floor, NOISE, seed + 1000, zeros, false)),
    ])
}

#[test]
fn two_boards_and_the_camera_are_found_from_no_start_within_four_standard_errors_and_written_back() {
    let declared = "{board_mm: 0.1, board_deg: 0.02}";
    for seed in [7, 8, 9] {
        let lab = laboratory(&model("[]", declared), &two(12, 9, seed, &SOUND), without_holdout());
        let found = compared(&lab);
        assert!(found.gauges.is_empty() && found.placed.len() == 3, "{:?} {:?}", found.gauges, found.placed);
        for (name, truth) in [("p1", camera()), ("floor", board()), ("wall", wall())] {
            assert!(off(&found, name, &truth) < 4.0, "{name}: {:?}", found.placed);
        }
        assert!((found.rms_mm.fit / 0.173 - 1.0).abs() < 0.35, "{:?}", found.rms_mm);
        let accepted = lab.accept(&Progress::unwatched()).unwrap();
        let again = Model::parse("again.yaml", &model_text(&accepted.model)).unwrap();
        assert_eq!(
            again.boards.iter().map(|board| board.name.as_deref()).collect::<Vec<_>>(),
            [Some("floor"), Some("wall")]
        );
        let apart = (again.boards[1].pose.translation.vector - wall().translation.vector).norm();
        assert!(apart < 0.5, "{apart}");
    }
}

#[test]
fn two_boards_say_more_of_the_camera_than_one_of_them() {
    let declared = "{board_mm: 0.1, board_deg: 0.02}";
    let se = |text: &str| {
        let found = compared(&laboratory(&model("[]", declared), text, without_holdout()));
        let camera = found.placed.iter().find(|one| one.name == "p1").unwrap();
        camera.se_mm.iter().map(|se| se.unwrap().powi(2)).sum::<f64>().sqrt()
    };
    let of_one = table(&[("floor", pictures_of(&board(), 12, NOISE, 1007, &SOUND, false))]);
    let (one, both) = (se(&of_one), se(&two(12, 12, 7, &SOUND)));
    assert!(both < 0.9 * one, "{both} and {one}");
}

#[test]
fn a_wrong_zero_is_named_by_two_boards() {
    let rows = two(60, 60, 31, &[0.0, 0.0, 0.3, 0.0, 0.0, 0.0]);
    let lab = laboratory(&model("[]", "{board_mm: 0.1, board_deg: 0.02}"), &rows, Options::default());
    let diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
    assert!(diagnosis_sentence(&diagnosis).contains("joint_zero(j3)"), "{}", diagnosis_sentence(&diagnosis));
    let expected = Requested { count: 3, keep_out: Vec::new(), payloads: Vec::new() };
    let next = lab.next_poses(&expected, &Progress::unwatched()).unwrap();
    for pose in &next.next {
        let q: [f64; 6] = pose.q_deg.clone().try_into().unwrap();
        let sees = |board: &Pose| {
            let seen = (camera().inverse() * flange(&q, &SOUND).inverse() * board).translation.vector;
            seen.z > 170.0 && seen.x.hypot(seen.y) < 0.6 * seen.z
        };
        assert!(sees(&board()) || sees(&wall()), "{q:?} sees neither");
    }
}

#[test]
fn a_board_in_one_picture_is_placed_by_the_others_and_reported_as_unchecked() {
    let lab = laboratory(
        &model("[]", "{board_mm: 0.1, board_deg: 0.02}"),
        &two(15, 1, 77, &SOUND),
        without_holdout(),
    );
    let warnings = lab.table().warnings.join("\n");
    assert!(
        warnings.contains("the board wall is in 1 picture only") && warnings.contains("take 3 at least"),
        "{warnings}"
    );
    let found = compared(&lab);
    // One picture of noise 0.1 mm and 0.02 deg at some 400 mm: no better than that, and no worse than a few times it.
    let wall_found = found.placed.iter().find(|one| one.name == "wall").unwrap();
    assert!(wall_found.se_mm.iter().all(|se| (0.09..1.0).contains(&se.unwrap())), "{wall_found:?}");
    assert!(off(&found, "wall", &wall()) < 4.0 && off(&found, "floor", &board()) < 4.0, "{:?}", found.placed);
    // Of where alone, without how it is turned, its turn cannot be determined.
    let position_only: String = two(15, 1, 77, &SOUND)
        .lines()
        .map(|line| match line.strip_suffix(",wall") {
            Some(row) => {
                let cells: Vec<&str> = row.split(',').collect();
                format!("{},,,,wall\n", cells[..9].join(","))
            }
            None => format!("{line}\n"),
        })
        .collect();
    let found = compared(&laboratory(
        &model("[]", "{board_mm: 0.1, board_deg: 0.02}"),
        &position_only,
        without_holdout(),
    ));
    let wall_found = found.placed.iter().find(|one| one.name == "wall").unwrap();
    assert!(wall_found.se_deg.iter().all(Option::is_none), "{wall_found:?}");
    assert!(
        found.gauges.iter().any(|gauge| format!("{gauge:?}").contains("wall rotation")),
        "{:?}",
        found.gauges
    );
}

#[test]
fn boards_all_seen_from_one_place_cannot_be_distinguished_from_the_camera() {
    // One pose, both boards in its picture: refused. Two poses: what cannot be determined is held and named.
    let sees = |q: [f64; 6], board: &Pose| {
        let seen = camera().inverse() * flange(&q, &SOUND).inverse() * board;
        let turn = seen.rotation.scaled_axis();
        let numbers = q.iter().chain(seen.translation.vector.iter()).chain(turn.iter());
        numbers.map(f64::to_string).collect::<Vec<_>>().join(",")
    };
    let poses = [[10.0, 60.0, -60.0, 5.0, 10.0, 0.0], [20.0, 50.0, -40.0, -15.0, 30.0, 40.0]];
    let rows = |count: usize| {
        let from = |board: Pose| poses.iter().take(count).map(|q| sees(*q, &board)).collect();
        table(&[("floor", from(board())), ("wall", from(wall()))])
    };
    let lab = laboratory(&model("[]", "{}"), &rows(1), without_holdout());
    assert!(lab.table().warnings.join("\n").contains("measure three at least"), "{:?}", lab.table().warnings);
    let refused = lab.compare(&Progress::unwatched()).unwrap_err().to_string();
    assert!(refused.contains("have the same pose"), "{refused}");
    let found = compared(&laboratory(&model("[]", "{}"), &rows(2), without_holdout()));
    assert!(!found.gauges.is_empty(), "{:?}", found.placed);
}

#[test]
fn names_of_boards_that_lead_nowhere_are_refused_with_those_there_are() {
    let refused = |model: &str, table: &str| try_laboratory(model, table, Options::default()).unwrap_err();
    let plain = two(5, 5, 3, &SOUND);
    let message = refused(&model("[]", "{}"), &plain.replacen(",wall", ",wal", 1));
    assert!(
        message.contains("line 2: `wal` in column `board` is not in the model's `boards:` (floor, wall)")
            && message.contains("did you mean"),
        "{message}"
    );
    let message = refused(&model("[]", "{}"), &plain.replacen(",wall", ",", 1));
    assert!(
        message.contains("line 2: say in column `board` which of the model's boards is seen: floor, wall"),
        "{message}"
    );
    let one = model("[]", "{}")
        .replace("boards: {floor: {seen_by: p1}, wall: {seen_by: p1}}", "board: {seen_by: p1}");
    let message = refused(&one, &plain);
    assert!(message.contains("names 2 boards, and the model has one: write `boards: {wall: {seen_by: p1}, floor: {seen_by: p1}}`"), "{message}");
    let both = model("[]", "{}") + "board: {seen_by: p1}\n";
    let message = refused(&both, &plain);
    assert!(message.contains("put all of them under `boards`"), "{message}");
}
