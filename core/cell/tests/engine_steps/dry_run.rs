//! What a run would do, without a start: what needs an operator, what is left out, and how long it takes at most and at least.

use std::sync::Arc;

use plumb_cell::device::JointRange;
use plumb_cell::engine::{DryRun, JointFacts, RobotFacts, dry_run};
use plumb_cell::expression::Calculator;
use plumb_cell::workcell::load_workcell;

use super::folder;
use crate::support::running::{cell_with_steps, request};

fn planned(steps: &str, unattended: bool) -> DryRun {
    let folder = folder();
    let mut run = request(&cell_with_steps(&folder, steps), &folder);
    run.unattended = unattended;
    dry_run(&run).expect("a plan")
}

#[test]
fn a_run_with_somebody_there_needs_nobody_else() {
    let steps = "steps:\n  - {id: there, do: {prompt: {text: Drive it there., jog_to: {robot: arm}}}}\n";
    assert_eq!(planned(steps, false).needs_operator, None);
    let alone = planned(steps, true).needs_operator.expect("nobody answers");
    assert!(alone.contains("there"), "{alone}");
}

#[test]
fn a_step_that_is_left_out_takes_no_time() {
    let steps = "steps:
  - {id: never, when: 1 > 2, do: {move: {robot: arm, by_deg: {waist: 30}}}}
  - {id: way, do: {move: {robot: arm, by_deg: {waist: 30}}}}
";
    let plan = planned(steps, true);
    let [never, way] = plan.steps.as_slice() else { panic!("{:?}", plan.steps) };
    assert!(never.is_left_out && never.estimate_s == Some(0.0), "{never:?}");
    let way_s = way.estimate_s.expect("a time");
    assert!(!way.is_left_out && way_s > 1.0, "{way:?}");
    assert!((plan.estimate_s - way_s).abs() < 1e-9, "{}", plan.estimate_s);
    assert_eq!(plan.least_s, None, "it takes as long as it takes");
}

#[test]
fn the_least_time_is_that_of_the_first_turn_of_what_may_end_early() {
    let steps = "steps:
  - id: turns
    do:
      repeat:
        times: 4
        until: there.joints.waist_deg > 1000
        steps:
          - {id: there, do: {move: {robot: arm, by_deg: {waist: 10}}}}
";
    let plan = planned(steps, true);
    let least = plan.least_s.expect("it may end with any turn");
    let turn = plan.steps.iter().find(|step| step.step.ends_with("there")).and_then(|step| step.estimate_s);
    assert!((least - turn.expect("a time")).abs() < 1e-9, "{least}");
    assert!(plan.estimate_s > 3.5 * least, "{} {least}", plan.estimate_s);
    assert_eq!(plan.repetitions.iter().map(|one| one.turns).collect::<Vec<_>>(), [4]);
}

#[test]
fn a_correction_of_a_sensor_takes_one_exchange_with_it() {
    let steps = "steps:
  - {id: scale, do: {correct: {sensor: eye, ask: false, parameters: {gain: {factor: 1.01, uncertainty: 0.001, plausible: 0.1}}}}}
";
    let plan = planned(steps, true);
    assert_eq!(plan.steps.iter().map(|step| step.estimate_s).collect::<Vec<_>>(), [Some(0.02)]);
}

/// Two turns, a slide straight down and a turn of the hand: 225 and 175 mm of reach, 320 mm above the table.
const SCARA: &str = "arm: quill
convention: distal
joints:
  - {name: shoulder, a_mm: 225, alpha_deg: 0, d_mm: 320, theta_deg: 0, limits_deg: [-130, 130]}
  - {name: elbow, a_mm: 175, alpha_deg: 180, d_mm: 0, theta_deg: 0, limits_deg: [-145, 145]}
  - {name: quill, a_mm: 0, alpha_deg: 0, d_mm: 0, theta_deg: 0, slides: true, limits_mm: [0, 180]}
  - {name: spin, a_mm: 0, alpha_deg: 0, d_mm: 0, theta_deg: 0, limits_deg: [-180, 180]}
targets: {p1: {xyz_mm: [0, 0, 30], free: true}}
free: [joint_zero(*)]
measured_from: world
";

/// What a move of that arm would do, which is with its arm straight out and its slide 30 mm down, by the limits of the cell file and its own.
fn moving(how: &str, more: &str) -> (DryRun, Vec<(String, String, Option<String>)>) {
    let folder = folder();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    write("model.yaml", SCARA);
    write(
        "cell.yaml",
        &format!(
            "cell: scara
devices: {{arm: {{plugin: simulated}}}}
robots:
  arm: {{joints: {{shoulder: deg, elbow: deg, quill: mm, spin: deg}}, model: model.yaml, limits_deg: {{shoulder: [-90, 60]}}}}
{more}procedures: [go.yaml]
"
        ),
    );
    write(
        "go.yaml",
        &format!("procedure: go\nsteps:\n  - {{id: way, do: {{move: {{robot: arm, {how}}}}}}}\n"),
    );
    let cell = load_workcell(&folder.path().join("cell.yaml"), &Calculator::new());
    let cell = Arc::new(cell.unwrap_or_else(|problems| {
        panic!("{}", problems.iter().map(ToString::to_string).collect::<String>())
    }));
    let mut run = request(&cell, &folder);
    let joint = |name: &str, start: f64| JointFacts { name: name.into(), max_speed: 1.0, start: Some(start) };
    let range = |joint: &str, least: f64, most: f64| JointRange {
        device: "arm".into(),
        joint: joint.into(),
        least,
        most,
    };
    let turn = |degrees: f64| degrees.to_radians();
    run.robots = vec![RobotFacts {
        robot: "arm".into(),
        joints: vec![joint("shoulder", 0.0), joint("elbow", 0.0), joint("quill", 30.0), joint("spin", 0.0)],
        ranges: vec![
            range("shoulder", turn(-130.0), turn(130.0)),
            range("elbow", turn(-145.0), turn(145.0)),
            range("quill", 0.0, 180.0),
            range("spin", turn(-180.0), turn(180.0)),
        ],
        ..RobotFacts::default()
    }];
    let plan = dry_run(&run).expect("a plan");
    let moves = plan.steps.iter().flat_map(|step| &step.moves);
    let moves = moves.map(|one| (one.how.clone(), one.limits.clone(), one.beyond.clone())).collect();
    (plan, moves)
}

fn beyond(how: &str) -> Option<String> {
    let (_, moves) = moving(how, "");
    assert_eq!(moves.len(), 1, "{moves:?}");
    moves.into_iter().next().and_then(|(_, _, beyond)| beyond)
}

#[test]
fn each_joint_of_a_move_is_reported_with_its_limits_and_whether_it_goes_beyond() {
    let (plan, moves) = moving("to_deg: {shoulder: 60, elbow: 145}, to_mm: {quill: 50}", "");
    let reported: Vec<_> = moves.iter().map(|(how, limits, _)| (how.as_str(), limits.as_str())).collect();
    assert_eq!(
        reported,
        [
            ("to 60 deg", "-90 to 60 deg, and the robot's own"),
            ("to 145 deg", "the robot's own, -145 to 145 deg"),
            ("to 50 mm", "the robot's own, 0 to 180 mm"),
        ]
    );
    assert!(moves.iter().all(|(.., beyond)| beyond.is_none()), "{moves:?}");
    // 145 degrees at 1 rad/s and half of full speed, and the exchange with the robot.
    let expected = 145.0_f64.to_radians() / 0.5;
    assert!((plan.estimate_s - expected - 20.0 / 0.5 - 0.02).abs() < 20.0 / 0.5, "{}", plan.estimate_s);
    let (_, moves) = moving("by_deg: {elbow: 300}", "");
    assert_eq!((moves[0].0.as_str(), &moves[0].2), ("by 300 deg", &None), "a way is no place");
}

#[test]
fn a_hand_that_is_brought_somewhere_is_reported_with_the_joint_that_would_be_beyond() {
    let hand = |x: f64, y: f64| beyond(&format!("to_hand: {{at_mm: [{x}, {y}, 250], aim_mm: [0, 0, 0]}}"));
    // 300 mm out: the elbow is bent by about 83 degrees, the shoulder stays within -90 to 60 degrees.
    assert_eq!(hand(300.0, 0.0), None);
    let beyond = hand(-250.0, 250.0).expect("that is behind the shoulder's limit");
    assert!(beyond.contains("shoulder"), "{beyond}");
    let (_, moves) = moving("to_hand: {at_mm: [300, 0, 250], aim_mm: [0, 0, 0]}", "");
    assert_eq!(moves[0].1, "its joints' limits");
    assert!(moves[0].0.starts_with("'s hand to"), "{moves:?}");
}

#[test]
fn a_point_is_reported_beyond_only_where_no_way_keeps_the_limits() {
    let point = |x: f64, y: f64, z: f64| {
        beyond(&format!("to_point: {{x_mm: {x}, y_mm: {y}, z_mm: {z}, by: [shoulder, elbow, quill]}}"))
    };
    assert_eq!(point(300.0, 0.0, 220.0), None);
    // At 75 degrees, 300 mm out: one elbow needs a shoulder beyond 60 degrees, the other one does not.
    let angle = 75.0_f64.to_radians();
    assert_eq!(point(300.0 * angle.cos(), 300.0 * angle.sin(), 220.0), None);
    let below = point(300.0, 0.0, 80.0).expect("the slide is too short");
    assert!(below.contains("quill"), "{below}");
    let behind = point(-250.0, 250.0, 220.0).expect("neither elbow keeps the shoulder's limit");
    assert!(behind.contains("shoulder"), "{behind}");
}

#[test]
fn what_watches_over_the_ways_is_given_the_planes_of_the_robot() {
    let plane = "keep_out:\n  - {name: the table, robot: arm, plane: {normal: [0, 0, 1], offset_mm: 20}}\n";
    let (plan, _) = moving("by_deg: {elbow: 1}", plane);
    assert_eq!(
        plan.safety,
        ["arm is kept within its joints' limits and clear of the table, once its zeros are known"]
    );
    let (plan, _) = moving("by_deg: {elbow: 1}", "");
    assert_eq!(plan.safety, ["arm is kept within its joints' limits; the cell names no keep-out planes"]);
}

#[test]
fn what_a_step_will_have_found_and_where_it_will_have_brought_the_arm_is_known_to_the_next() {
    let steps = "steps:
  - {id: sums, do: {compute: {values: {x: 2}}}}
  - {id: unneeded, when: sums.x > 3, do: {repeat: {times: 2, steps: [{id: far, do: {move: {robot: arm, by_deg: {waist: 60}}}}]}}}
  - {id: there, do: {move: {robot: arm, to_deg: {waist: 90}}}}
  - {id: again, do: {move: {robot: arm, to_deg: {waist: 90}}}}
  - {id: open, when: there.joints.waist_deg > 3, do: {move: {robot: arm, by_deg: {waist: 30}}}}
";
    let plan = planned(steps, true);
    let of = |id: &str| plan.steps.iter().find(|step| step.step == id).expect("it is planned");
    assert!(of("unneeded").is_left_out && of("unneeded[2].far").is_left_out);
    assert_eq!(of("unneeded[1].far").estimate_s, Some(0.0));
    let (there, again) = (of("there").estimate_s.expect("a time"), of("again").estimate_s.expect("a time"));
    assert!(!of("there").is_left_out && there > 0.5, "{there}");
    assert!(again < 0.1, "it is there already: {again}");
    let open = of("open");
    assert!(
        !open.is_left_out && open.estimate_s.expect("a time") > 0.5,
        "nobody knows yet: it may be needed"
    );
}

#[test]
fn a_search_takes_the_time_of_its_way_and_a_measurement_some_too() {
    let steps = "steps:
  - {id: lower, do: {search: {robot: arm, joint: shoulder, travel_deg: -40, until: {sensor: eye, is: on}}}}
  - {id: seen, do: {measure: {sensor: eye}}}
";
    let plan = planned(steps, true);
    let times: Vec<f64> = plan.steps.iter().filter_map(|step| step.estimate_s).collect();
    assert_eq!(times.len(), 2, "{:?}", plan.steps);
    assert!(times[0] > 1.0 && times[1] > 0.0, "{times:?}");
}
