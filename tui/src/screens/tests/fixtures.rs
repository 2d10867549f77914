//! A run as the engine would report it, a model as the lab would, and the keys an operator presses.

use std::time::Duration;

use plumb_calibration::measurement::ReadingUnit;
use plumb_cell::event::{
    Correction, DeviceState, Event, NamedValue, PlannedStep, RunOutcome, StampedEvent, StepOutcome, StepPath,
};
use plumb_cell::prompt::{ChoiceOption, Decision, JogGoal, Prompt, PromptId, PromptKind};
use plumb_diagnosis::laboratory::{EffectPlot, JointAxis, PlotAxis, Points, RowResidual, Series};
use plumb_diagnosis::report::StepKind;
use plumb_record::{RunEnd, RunId, RunState, RunSummary};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use serde_json::Value;

use crate::screens::cell::ArmShape;
use crate::screens::history::ArchiveAnswer;
use crate::screens::history::testing::{Trend, TrendPoint};
use crate::screens::message::{Action, Message};
use crate::screens::model::testing::{Card, CardStatus, ErrorStep, ModelSummary, Residuals, StripLine};
use crate::screens::model::{LabAnswer, ModelState};
use crate::screens::state::State;
use crate::screens::theme::Theme;
use crate::screens::update::update;
use crate::screens::view::view;

/// A step of the plan.
fn planned(step: &str, title: &str, kind: &str, estimate_s: Option<f64>) -> PlannedStep {
    PlannedStep {
        step: StepPath(step.to_owned()),
        title: title.to_owned(),
        kind: kind.to_owned(),
        depth: u32::try_from(step.matches('.').count()).unwrap_or(0),
        moves: if kind == "move" || kind == "search" { vec!["arm".to_owned()] } else { Vec::new() },
        asks: kind == "prompt",
        estimate_s,
    }
}

/// The plan of an initialization of three turns.
pub(super) fn plan() -> Vec<PlannedStep> {
    let mut steps = vec![
        planned("grid", "Set the target on the bench", "prompt", None),
        planned("upright", "Bring the forearm upright", "prompt", None),
        planned("lower_waist", "Lower the hand to the sheet", "search", Some(9.0)),
        planned("waist", "Find line A with the waist", "search", Some(12.0)),
    ];
    for turn in 1..=3 {
        for (id, title, seconds) in [
            ("lower", "Shoulder down to the sheet", 8.0),
            ("reach", "Elbow in to line B", 10.0),
            ("back", "Back off", 2.0),
        ] {
            let kind = if id == "back" { "move" } else { "search" };
            steps.push(planned(&format!("cycle[{turn}].{id}"), title, kind, Some(seconds)));
        }
    }
    steps.push(planned("zeros", "Work out the joint zeros", "compute", Some(0.1)));
    steps.push(planned("apply", "Put the corrections in force", "apply", None));
    steps
}

pub(super) fn value(name: &str, value: f64, unit: &str) -> NamedValue {
    NamedValue { name: name.to_owned(), value, unit: unit.to_owned(), uncertainty: None }
}

/// The joints of the arm in a plausible pose.
pub(super) fn joints(shoulder: f64, elbow: f64) -> Vec<NamedValue> {
    vec![
        value("waist", -4.318, "deg"),
        value("shoulder", shoulder, "deg"),
        value("elbow", elbow, "deg"),
        value("wrist_pitch", -90.0, "deg"),
        value("wrist_roll", 0.0, "deg"),
        value("gripper", 12.7, "mm"),
    ]
}

pub(super) fn deliver(state: &mut State, event: Event) -> Vec<Action> {
    let stamped = StampedEvent { sequence: 1, time: "2026-11-21T06:00:07.250Z".to_owned(), event };
    update(state, Message::Engine(Box::new(stamped)))
}

pub(super) fn path(step: &str) -> StepPath {
    StepPath(step.to_owned())
}

pub(super) fn started(step: &str) -> Event {
    Event::StepStarted { step: path(step), attempt: 1 }
}

pub(super) fn finished(step: &str, outcome: StepOutcome, message: &str) -> Event {
    Event::StepFinished {
        step: path(step),
        outcome,
        message: message.to_owned(),
        values: Vec::new(),
        seconds: 4.2,
    }
}

pub(super) fn asked(step: &str, title: &str, text: &str, kind: PromptKind) -> Event {
    let prompt = Prompt {
        id: PromptId(41),
        step: path(step),
        title: title.to_owned(),
        text: text.to_owned(),
        help: None,
        kind,
        simulated: false,
    };
    Event::PromptAsked { prompt }
}

pub(super) fn number_asked() -> Event {
    asked(
        "upright",
        "Bring the forearm upright",
        "Hold the level against the forearm and read its angle. It has to stand within 17.25 deg of upright, or the \
         fingertip reaches the table before the sensor sees it.",
        PromptKind::Number {
            unit: "deg".to_owned(),
            minimum: Some(252.75),
            maximum: Some(287.25),
            default: Some(270.0),
            decimals: Some(2),
        },
    )
}

pub(super) fn asked_to_confirm() -> Event {
    let kind = PromptKind::Acknowledge { label: "the target lies".to_owned() };
    asked("grid", "Set the target on the bench", "Lay the T on the table.", kind)
}

pub(super) fn choice_asked() -> Event {
    let option = |key: &str, label: &str| ChoiceOption { key: key.to_owned(), label: label.to_owned() };
    asked(
        "grid",
        "Set the target on the bench",
        "Which sheet lies on the bench?",
        PromptKind::Choice {
            options: vec![option("t", "the T target on its white patch"), option("other", "another one")],
            default: Some("t".to_owned()),
        },
    )
}

pub(super) fn jog_asked() -> Event {
    asked(
        "upright",
        "Bring the forearm upright",
        "Jog until the forearm hangs straight down and the fingertip is 10 to 50 mm over the white of the sheet.",
        PromptKind::JogTo {
            device: "arm".to_owned(),
            goals: vec![JogGoal {
                joint: "elbow".to_owned(),
                minimum: -107.25,
                maximum: -72.75,
                unit: "deg".to_owned(),
            }],
            joints: joints(35.5, -60.0),
            hand_over: false,
            joint: None,
            sensor: None,
        },
    )
}

pub(super) fn decision_asked() -> Event {
    asked(
        "cycle[2].lower",
        "Shoulder down to the sheet: what now?",
        "Nothing found within 40 deg of shoulder.",
        PromptKind::Decision {
            error: "Nothing found within 40 deg of shoulder. Is the hand over the white of the sheet, 10 to 50 mm up?".to_owned(),
            options: vec![Decision::Retry, Decision::Move, Decision::Back, Decision::Skip, Decision::Abort],
            labels: [
                "Do the step again",
                "Move arm yourself, then do the step again",
                "Go back to \u{201c}Set the target\u{201d}",
                "Go on without it",
                "Abort the run",
            ]
            .map(str::to_owned)
            .into(),
        },
    )
}

/// The state just after the run began.
pub(super) fn begun() -> State {
    let mut state = State::of_cell("ada", None, Theme::coloured());
    let start = Event::RunStarted {
        run: 12,
        cell: "teachmover-simulated".to_owned(),
        procedure: "initialize".to_owned(),
        title: "Initialize waist, shoulder and elbow (Yang and Siegel 1987)".to_owned(),
        unattended: false,
        resumed_at: None,
    };
    deliver(&mut state, start);
    deliver(&mut state, Event::Planned { steps: plan(), estimate_s: 81.1 });
    for (device, plugin) in [("arm", "simulated"), ("eye", "ir-proximity")] {
        let event = Event::Device {
            device: device.to_owned(),
            plugin: plugin.to_owned(),
            state: DeviceState::Active,
            message: None,
        };
        deliver(&mut state, event);
    }
    deliver(&mut state, posed(35.5, -84.2, false));
    state.cell.target = Some(plumb_cell::workcell::TTarget {
        line_a: 0.0,
        line_b_distance: 140.0,
        line_b_offset: 8_f64.to_radians(),
        head_depth: 25.0,
        head_width: 120.0,
        body_radius: 210.0,
        body_angle: 12_f64.to_radians(),
        margin: 20.0,
    });
    let mut shape = ArmShape::new("arm", teachmover, vec![("target".to_owned(), 140.0)]);
    shape.kept_above = Some(0.0);
    state.cell.shape = Some(shape);
    state
}

/// Points along a TeachMover whose joints are attitudes.
fn teachmover(joints: &[NamedValue]) -> Option<Vec<[f64; 3]>> {
    let angle =
        |name: &str| joints.iter().find(|joint| joint.name == name).map(|joint| joint.value.to_radians());
    let (waist, mut out, mut up) = (angle("waist")?, 0.0, 195.0);
    let mut points = vec![[0.0; 3], [0.0, 0.0, 195.0]];
    for (name, length) in [("shoulder", 177.8), ("elbow", 177.8), ("wrist_pitch", 109.0)] {
        let angle = angle(name)?;
        (out, up) = (out + length * angle.cos(), up + length * angle.sin());
        points.push([out * waist.cos(), out * waist.sin(), up]);
    }
    Some(points)
}

pub(super) fn posed(shoulder: f64, elbow: f64, moving: bool) -> Event {
    Event::Joints {
        device: "arm".to_owned(),
        time_ns: 5_000_000_000,
        moving,
        joints: joints(shoulder, elbow),
    }
}

/// The state in the third turn, while the arm moves.
pub(super) fn searching() -> State {
    let mut state = begun();
    state.now = Duration::from_secs(64);
    for step in ["grid", "upright", "lower_waist", "waist"] {
        deliver(&mut state, started(step));
        deliver(&mut state, finished(step, StepOutcome::Passed, "done"));
    }
    for (turn, shoulder, elbow) in [(1, 28.3142, -83.1187), (2, 28.0221, -83.4018), (3, 28.0312, -83.3931)] {
        for (id, joint) in [("lower", "shoulder"), ("reach", "elbow"), ("back", "")] {
            let step = format!("cycle[{turn}].{id}");
            deliver(&mut state, started(&step));
            if turn == 3 && id == "reach" {
                break;
            }
            if !joint.is_empty() {
                let event = Event::TriggerFound {
                    step: path(&step),
                    device: "arm".to_owned(),
                    joints: joints(shoulder, elbow),
                    half_width: value(joint, 0.0127, "deg"),
                };
                deliver(&mut state, event);
            }
            deliver(&mut state, finished(&step, StepOutcome::Passed, "found"));
        }
    }
    deliver(
        &mut state,
        Event::Signal {
            device: "eye".to_owned(),
            signal: "line".to_owned(),
            on: true,
            time_ns: 61_204_000_000,
        },
    );
    deliver(
        &mut state,
        Event::Signal {
            device: "eye".to_owned(),
            signal: "line".to_owned(),
            on: false,
            time_ns: 63_020_500_000,
        },
    );
    deliver(
        &mut state,
        Event::StepProgress {
            step: path("cycle[3].reach"),
            fraction: Some(0.42),
            text: "slow approach, elbow at -81.40 deg".to_owned(),
        },
    );
    deliver(&mut state, posed(28.03, -81.4, true));
    state
}

/// The state when the run has passed.
pub(super) fn passed() -> State {
    let mut state = searching();
    for step in ["cycle[3].reach", "cycle[3].back", "zeros", "apply"] {
        deliver(&mut state, started(step));
        deliver(&mut state, finished(step, StepOutcome::Passed, "done"));
    }
    for (joint, old, new) in [("waist", 0.0, -4.318), ("shoulder", 0.0, 1.274), ("elbow", 0.0, -0.861)] {
        let correction = Correction {
            device: "arm".to_owned(),
            quantity: "joint_zero".to_owned(),
            site: joint.to_owned(),
            old,
            new,
            uncertainty: Some(0.0073),
            budget: None,
            unit: "deg".to_owned(),
        };
        deliver(&mut state, Event::CorrectionProposed { correction: correction.clone() });
        deliver(&mut state, Event::CorrectionApplied { correction, revision: 3 });
    }
    let message = "Three joint zeros are in force; the hand meets lines A and B within 0.03 mm.".to_owned();
    deliver(&mut state, posed(28.03, -83.39, false));
    deliver(&mut state, Event::RunEnded { run: 12, outcome: RunOutcome::Passed, message });
    state
}

/// A model with a compliant shoulder, looked at once.
pub(super) fn examined() -> State {
    let model = ModelState::new("ur5", "ur5.yaml, ur5-grid.csv (200 rows)");
    let mut state = State::of_model(model, Theme::coloured());
    update(&mut state, Message::Lab(LabAnswer::Examined(Box::new(summary()))));
    state
}

fn summary() -> ModelSummary {
    let card = |key: &str, effect: &str, site: &str, status: CardStatus| Card {
        key: key.to_owned(),
        effect: effect.to_owned(),
        site: site.to_owned(),
        size: "1.90e-4 rad/(N m) \u{b1} 1.0e-6".to_owned(),
        gain_mm: Some(0.241),
        leaves_mm: None,
        holm_p: Some(3e-14),
        probability: Some(0.93),
        ties: Vec::new(),
        status,
        reason: String::new(),
    };
    let mut cards = vec![
        card("joint_compliance(shoulder)", "joint_compliance", "shoulder", CardStatus::Tied),
        card("link_sag(upper_arm)", "link_sag", "upper arm", CardStatus::Tied),
        card("joint_backlash(elbow)", "joint_backlash", "elbow", CardStatus::Rejected),
    ];
    cards[0].ties = vec!["link_sag(upper_arm)".to_owned()];
    cards[2].reason = "no gain where it was not fitted".to_owned();
    ModelSummary {
        verdict: "located".to_owned(),
        sentence: "The shoulder gives way under gravity; whether its joint or its link cannot be told from these poses."
            .to_owned(),
        unit: ReadingUnit::Mm,
        floor_mm: Some(0.05),
        floor_source: "repeats".to_owned(),
        floor_of_a_point_mm: Some(0.0866),
        at_floor: false,
        row_name: "Line",
        not_predictable_mm: Some(0.14),
        how_large: StripLine {
            full: "RMS 0.312, mean 0.204, 95 % 0.410, max 12.728 mm; noise 0.087".to_owned(),
            short: "RMS 0.312, 95 % 0.410, max 12.728 mm; noise 0.087".to_owned(),
        },
        how_much: StripLine {
            full: "0.17 \u{b1} 0.02 mm, from pose + last move; 0.140 mm is not predictable".to_owned(),
            short: "0.17 \u{b1} 0.02 mm: pose + last move; 0.140 not predictable".to_owned(),
        },
        where_it_is: StripLine {
            full: "worst lines 79, 134, 73; along lift 0.191, pan 0.110 mm RMS".to_owned(),
            short: "worst 79, 134, 73; lift 0.191, pan 0.110 mm RMS".to_owned(),
        },
        joints: JOINTS.map(|name| JointAxis { name: name.to_owned(), unit: "deg" }).into(),
        plots: vec![own_plot()],
        cards,
        warnings: vec!["row 79 lies far outside the others' scatter".to_owned()],
        residuals: residuals(),
        arm_mm: vec![[0.0, 0.0, 0.0], [0.0, 0.0, 300.0], [200.0, 40.0, 420.0], [320.0, 60.0, 300.0]],
        next: vec!["10 -40 80 0 30 5 side ++0000".to_owned()],
        error_steps: vec![
            error_step("start", StepKind::Start, 0.714, 0.728),
            error_step("joint_zero(*)", StepKind::Mechanism, 0.574, 0.583),
            error_step("joint_harmonic(pan, 2)", StepKind::Correction, 0.310, 0.320),
        ],
    }
}

const JOINTS: [&str; 6] = ["pan", "lift", "elbow", "wrist1", "wrist2", "wrist3"];

fn error_step(added: &str, kind: StepKind, fit_mm: f64, cross_validation_mm: f64) -> ErrorStep {
    ErrorStep { added: added.to_owned(), kind, fit_mm, cross_validation_mm: Some(cross_validation_mm) }
}

/// The own plot of the first candidate: what is left goes with the moment about the shoulder.
fn own_plot() -> EffectPlot {
    let moment = |row: usize| (row * 37 % 181) as f64 - 90.0;
    let noise = |row: usize| (row as f64 * 1.7).sin() * 0.05;
    EffectPlot {
        effect: "joint_compliance(shoulder)".to_owned(),
        added: false,
        across: PlotAxis { shows: "moment about shoulder".to_owned(), unit: "N m".to_owned() },
        up: PlotAxis {
            shows: "left without it, along the motion of shoulder".to_owned(),
            unit: "mm".to_owned(),
        },
        points: (0..200).map(|row| (moment(row), 0.003 * moment(row) + noise(row), row)).collect(),
        curve: vec![(-90.0, -0.27), (90.0, 0.27)],
        rms_mm: [0.16, 0.035],
    }
}

/// Errors that go with the cosine of the second joint, a little noise, and one gross error.
fn residuals() -> Residuals {
    let spread = |row: usize, step: usize| (row * step % 181) as f64 * 2.0 - 180.0;
    let noise = |row: usize| (row as f64 * 1.7).sin() * 0.05;
    let error = |row: usize| {
        0.2 * spread(row, 37).to_radians().cos() + noise(row) + if row == 77 { 9.0 } else { 0.0 }
    };
    let rows = (0..200)
        .map(|row| RowResidual {
            row,
            line: u32::try_from(row + 2).unwrap_or(0),
            held_out: false,
            weight: 1.0,
            vector_mm: [error(row), 0.4 * noise(row), -error(row)],
            size: Some(error(row).abs() * 2.0_f64.sqrt()),
            size_deg: None,
            point_mm: [spread(row, 17) * 2.0, spread(row, 23) * 2.0, 300.0],
            joints: (0..6).map(|joint| spread(row, 29 + 8 * joint)).collect(),
        })
        .collect();
    let series = |against: &str, unit: &str, shows: &str, points: Points| Series {
        against: against.to_owned(),
        unit: unit.to_owned(),
        shows: shows.to_owned(),
        of_size: unit == "row",
        in_deg: false,
        points,
    };
    let mut all: Vec<Series> = JOINTS
        .iter()
        .enumerate()
        .map(|(joint, name)| {
            let points = (0..200).map(|row| (spread(row, 29 + 8 * joint), error(row), row)).collect();
            series(name, "deg", &format!("residual along the motion of {name}, mm"), points)
        })
        .collect();
    let sizes = (0..200).map(|row| (row as f64, error(row).abs(), row)).collect();
    all.push(series("order", "row", "error of a row, mm", sizes));
    Residuals { rows, series: all }
}

/// A record of three runs and one corrected joint, on the History screen.
pub(super) fn recorded() -> State {
    let mut state = State::of_record(Theme::coloured());
    let run = |number: i64, started: &str, operator: &str, ended: RunState, message: &str| RunSummary {
        run: RunId(number),
        cell: "teachmover".to_owned(),
        cell_file: "/cells/teachmover/cell.yaml".to_owned(),
        procedure: if number == 2 { "waist-initialization" } else { "initialize" }.to_owned(),
        procedure_file: String::new(),
        title: "Initialize the arm over a T target (Yang & Siegel 1987)".to_owned(),
        operator: operator.to_owned(),
        unattended: false,
        parameters: Value::Null,
        settings: Value::Null,
        program: "0.1.0".to_owned(),
        world: None,
        started: started.to_owned(),
        ended: None,
        state: ended,
        message: Some(message.to_owned()).filter(|message| !message.is_empty()),
        skipped: Vec::new(),
    };
    let runs = vec![
        run(3, "2026-11-21T09:13:02.000Z", "ada", RunState::Running, ""),
        run(
            2,
            "2026-11-20T16:40:11.000Z",
            "grace",
            RunState::Ended(RunEnd::Failed),
            "nothing found within 40 deg of waist",
        ),
        run(1, "2026-11-19T08:05:59.000Z", "ada", RunState::Ended(RunEnd::Passed), "all steps passed"),
    ];
    let point = |day: i64, value: f64, run: i64| TrendPoint {
        time: format!("2026-11-{day}T08:10:00.000Z"),
        seconds: 86_400.0 * day as f64,
        value,
        uncertainty: Some(0.05),
        revision: run + 1,
        run: Some(run),
    };
    let trend = |name: &str, points: Vec<TrendPoint>| Trend {
        name: name.to_owned(),
        cell: "teachmover".to_owned(),
        device: "arm".to_owned(),
        unit: "deg".to_owned(),
        points,
    };
    let trends = vec![
        trend("waist zero of arm", vec![point(17, 1.7, 0), point(18, 1.75, 0), point(19, 1.6, 1)]),
        trend("elbow zero of arm", vec![point(19, -2.4, 1)]),
    ];
    update(&mut state, Message::Archive(ArchiveAnswer::Listed { runs, trends }));
    state
}

/// A key without modifiers.
pub(super) fn press(state: &mut State, code: KeyCode) -> Vec<Action> {
    update(state, Message::Key(KeyEvent::new(code, KeyModifiers::NONE)))
}

/// The page as text, one line a row.
pub(super) fn page(state: &State, width: u16, height: u16) -> String {
    drawn(state, width, height).to_string()
}

pub(super) fn drawn(state: &State, width: u16, height: u16) -> TestBackend {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("a test terminal opens");
    terminal.draw(|frame| view(state, frame)).expect("a test terminal draws");
    terminal.backend().clone()
}
