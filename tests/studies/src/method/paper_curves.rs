//! The curves and figures of Yang & Siegel's analysis, computed from the project's own recursion.

use plumb_kinematics::yang_siegel::{Initialization, hand_height_loss, start_tolerance, waist_spread};
use plumb_report::figure::{Curve, Figure};

/// The paper's hand with its sensor `L3`, mm.
const HAND: f64 = 109.0;
/// Cycles after the first in figures 7 to 10.
const CYCLES: usize = 3;
/// The paper's start of the forearm, degrees.
const START_DEG: f64 = 290.0;

/// One line of the text report: what, the paper's value, ours.
pub(crate) struct Statement {
    pub(crate) what: &'static str,
    pub(crate) paper: &'static str,
    pub(crate) ours: String,
}

fn steps(from: f64, to: f64, count: usize) -> impl Iterator<Item = f64> {
    (0..=count).map(move |index| from + (to - from) * index as f64 / count as f64)
}

fn curve(
    name: impl Into<String>,
    along: impl Iterator<Item = f64>,
    value: impl Fn(f64) -> Option<f64>,
) -> Curve {
    let points = along.filter_map(|x| value(x).map(|y| (x, y))).collect();
    Curve { name: name.into(), points }
}

/// Height after `CYCLES` further cycles less the height they converge to, micron.
fn error_micron(arm: &Initialization, start_deg: f64) -> Option<f64> {
    let errors = arm.errors(start_deg.to_radians(), CYCLES + 1).ok()?;
    errors.last().map(|error| error * 1e3)
}

/// Table 2-1: vertical error (micron) after 0 to 6 further cycles.
pub(crate) fn table_2_1() -> Vec<f64> {
    let errors = Initialization::table_2_1().errors(START_DEG.to_radians(), 7).unwrap_or_default();
    errors.iter().map(|error| error * 1e3).collect()
}

/// Figures 5 to 10 and 12.
pub(crate) fn figures() -> Vec<Figure> {
    let arm = Initialization::table_2_1();
    vec![
        waist(),
        heights(arm),
        starts(arm),
        back_rotations(arm),
        distances(arm),
        trigger_heights(arm),
        tolerances(arm),
    ]
}

fn waist() -> Figure {
    let spread = |offset: f64| waist_spread(offset, 140.0, 180.0).map(f64::to_degrees);
    Figure {
        file_name: "figure-05-waist".to_owned(),
        title: "Figure 5: waist error from a target off the waist's axis (R 140 to 180 mm)".to_owned(),
        across: "offset e of the target's edge, mm".to_owned(),
        up: "spread of the waist's zero, deg".to_owned(),
        curves: vec![curve("spread", steps(0.0, 2.0, 80), spread)],
        scattered: false,
    }
}

fn heights(arm: Initialization) -> Figure {
    let after = |cycle: usize| {
        curve(format!("n = {cycle}"), steps(255.0, 300.0, 180), move |start| {
            arm.wrist_height(start.to_radians(), cycle).ok()
        })
    };
    Figure {
        file_name: "figure-06-height".to_owned(),
        title: "Figure 6: wrist height at line B after n further cycles".to_owned(),
        across: "forearm's start Bi, deg".to_owned(),
        up: "wrist height, mm".to_owned(),
        curves: (0..3).map(after).collect(),
        scattered: false,
    }
}

fn starts(arm: Initialization) -> Figure {
    Figure {
        file_name: "figure-07-start".to_owned(),
        title: "Figure 7: error after three further cycles against the forearm's start".to_owned(),
        across: "forearm's start Bi, deg".to_owned(),
        up: "error, micron".to_owned(),
        curves: vec![curve("error", steps(250.0, 360.0, 220), |start| error_micron(&arm, start))],
        scattered: false,
    }
}

fn back_rotations(arm: Initialization) -> Figure {
    let value = |degrees: f64| {
        error_micron(&Initialization { back_rotation: degrees.to_radians(), ..arm }, START_DEG)
    };
    Figure {
        file_name: "figure-08-back-rotation".to_owned(),
        title: "Figure 8: error after three further cycles against the back rotation".to_owned(),
        across: "back rotation Br, deg".to_owned(),
        up: "error, micron".to_owned(),
        curves: vec![curve("error", steps(0.0, 20.0, 200), value)],
        scattered: false,
    }
}

fn distances(arm: Initialization) -> Figure {
    let value = |distance: f64| error_micron(&Initialization { edge_distance: distance, ..arm }, START_DEG);
    Figure {
        file_name: "figure-09-distance".to_owned(),
        title: "Figure 9: error after three further cycles against the place of the target".to_owned(),
        across: "distance K of line B from the waist, mm".to_owned(),
        up: "error, micron".to_owned(),
        curves: vec![curve("error", steps(60.0, 220.0, 160), value)],
        scattered: false,
    }
}

fn trigger_heights(arm: Initialization) -> Figure {
    let value = |height: f64| error_micron(&Initialization { trigger_height: height, ..arm }, START_DEG);
    Figure {
        file_name: "figure-10-trigger-height".to_owned(),
        title: "Figure 10: error after three further cycles against the wrist's trigger height".to_owned(),
        across: "trigger height D, mm".to_owned(),
        up: "error, micron".to_owned(),
        curves: vec![curve("error", steps(80.0, 150.0, 140), value)],
        scattered: false,
    }
}

fn tolerances(arm: Initialization) -> Figure {
    let value = |clearance: f64| start_tolerance(arm.forearm, clearance).map(f64::to_degrees);
    Figure {
        file_name: "figure-12-tolerance".to_owned(),
        title: "Figure 12: how far from vertical the forearm may start".to_owned(),
        across: "working distance h of the sensor, mm".to_owned(),
        up: "tolerance about the vertical, deg".to_owned(),
        curves: vec![curve("tolerance", steps(0.0, 15.0, 150), value)],
        scattered: false,
    }
}

/// By how much an elbow that is off at the start changes the wrist's height after so many further cycles, micron.
fn elbow_cost(arm: Initialization, start: f64, elbow_error: f64, cycle: usize) -> f64 {
    let disturbed = arm.wrist_height(start + elbow_error, cycle).unwrap_or(f64::NAN);
    (disturbed - arm.wrist_height(start, cycle).unwrap_or(f64::NAN)).abs() * 1e3
}

/// The single numbers of sections 4, 4.4, 4.5 and 6.
pub(crate) fn statements() -> Vec<Statement> {
    let arm = Initialization::table_2_1();
    let (start, elbow_error) = ((-75.0_f64).to_radians(), 0.1_f64.to_radians());
    let elbow_cost = |arm, cycle| elbow_cost(arm, start, elbow_error, cycle);
    let settled = |arm: Initialization| arm.wrist_height(start, 20).unwrap_or(f64::NAN);
    let turned = Initialization { back_rotation: arm.back_rotation + elbow_error, ..arm };
    let every_cycle = (settled(turned) - settled(arm)).abs();
    let height_loss = hand_height_loss(HAND, 1.0_f64.to_radians(), 0.1_f64.to_radians());
    let lower = Initialization { trigger_height: arm.trigger_height - height_loss, ..arm };
    let height_cost =
        arm.wrist_height(start, 2).unwrap_or(f64::NAN) - lower.wrist_height(start, 2).unwrap_or(f64::NAN);
    let tolerance = start_tolerance(arm.forearm, 8.0).unwrap_or(f64::NAN).to_degrees();
    let spread = waist_spread(1.0, 140.0, 180.0).unwrap_or(f64::NAN).to_degrees();
    vec![
        Statement {
            what: "section 4: spread of the waist's zero, target 1 mm off",
            paper: "< 0.1 deg",
            ours: format!("{spread:.4} deg"),
        },
        Statement {
            what: "section 4.4: elbow 0.1 deg off at Bi = -75 deg, after 1 and 2 further cycles",
            paper: "0.6 micron",
            ours: format!("{:.2} and {:.3} micron: not reproduced", elbow_cost(arm, 1), elbow_cost(arm, 2)),
        },
        Statement {
            what: "    the same with the sensor at h = 5 mm (D = 114), within section 5's range, after 1 further cycle",
            paper: "0.6 micron",
            ours: format!(
                "{:.2} micron; cut short as -10138.6 is in Table 2-1 it reads 0.6, so perhaps h was 5 mm then",
                elbow_cost(Initialization { trigger_height: 114.0, ..arm }, 1)
            ),
        },
        Statement {
            what: "    a shoulder that turns the elbow by 0.1 deg in every cycle, not only at the start",
            paper: "left out",
            ours: format!("{:.1} micron, for good: it is a back rotation of 5.1 deg", every_cycle * 1e3),
        },
        Statement {
            what: "section 4.5: trigger height lost when the hand tilts from 1 to 1.1 deg",
            paper: "3 micron",
            ours: format!("{:.2} micron", height_loss * 1e3),
        },
        Statement {
            what: "section 4.5: what that costs the hand's height after 2 further cycles",
            paper: "4 micron",
            ours: format!(
                "{:.2} micron: less than the {:.2} it comes from",
                height_cost * 1e3,
                height_loss * 1e3
            ),
        },
        Statement {
            what: "section 6: tolerance of the forearm's start about the vertical, h = 8 mm",
            paper: "17 deg 15 min",
            ours: format!("{} deg {:.1} min", tolerance.trunc(), tolerance.fract() * 60.0),
        },
    ]
}
