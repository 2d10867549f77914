//! `plumb study design`: the paper's numerical experiment for any arm with its joints (section 4.3 of Yang & Siegel 1987): which distance of the target, trigger
//! height and back rotation leave least of the error that the method itself makes, and how far each may be from there.

use std::f64::consts::FRAC_PI_2;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use plumb_calibration::arm_model::Model;
use plumb_kinematics::Motion;
use plumb_kinematics::yang_siegel::{Initialization, start_tolerance};

use plumb_report::figure::{self, Curve, Figure, FigureError};

/// Which arm, and what is fixed already.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The arm's model file: a waist that turns about the vertical, then shoulder and elbow, whose axes are level and parallel.
    model: PathBuf,
    /// Distance K of line B from the waist's axis, mm; searched for if left out.
    #[arg(long = "K", value_name = "MM")]
    edge_distance: Option<f64>,
    /// Height D of the wrist's axis at which the sensor fires, mm; if left out, the length of the hand and `--h`.
    #[arg(long = "D", value_name = "MM")]
    trigger_height: Option<f64>,
    /// Back rotation Br of the elbow between cycles, degrees; searched for if left out.
    #[arg(long = "Br", value_name = "DEG")]
    back_rotation: Option<f64>,
    /// Working distance h of the sensor from the paper, mm.
    #[arg(long = "h", value_name = "MM", default_value_t = 8.0)]
    working_distance: f64,
}

/// Cycles after the first in the paper's figures 7 to 10.
const CYCLES: usize = 3;

/// Error of the method after these that no drive would show, mm: a hundredth of the finest half-step of the paper's arm.
const NEGLIGIBLE: f64 = 1e-3;

/// Back rotation that is tried first, deg: the paper's.
const USUAL_BACK_DEG: f64 = 5.0;

/// Greatest back rotation that is looked at, deg.
const MOST_BACK_DEG: f64 = 25.0;

/// Starts of the forearm looked at within its tolerance.
const STARTS: usize = 9;

/// Steps in which a quantity is looked through.
const STEPS: usize = 400;

/// The paper's lengths in an arm.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Lengths {
    upper_arm: f64,
    forearm: f64,
    shoulder_height: f64,
    /// From the wrist's axis to the point the sensor works from, hand hanging.
    hand: f64,
}

/// Why there is no design.
#[derive(Debug, thiserror::Error)]
pub(super) enum DesignError {
    /// An arm for which the method cannot be designed.
    #[error("{0}")]
    Arm(String),
    /// Its figures.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// Standard output is gone.
    #[error("it cannot be written: {0}")]
    Output(#[from] std::io::Error),
}

/// Prints what is best, and writes the figures where asked.
pub(super) fn run(arguments: &Arguments, folder: Option<&Path>) -> Result<(), DesignError> {
    let model = Model::read(&arguments.model).map_err(|error| DesignError::Arm(error.to_string()))?;
    let refused = |reason: String| DesignError::Arm(format!("{}: {reason}", arguments.model.display()));
    let lengths = lengths(&model).map_err(refused)?;
    let design = Design::of(lengths, arguments).map_err(refused)?;
    let mut output = std::io::stdout().lock();
    output.write_all(design.report(&model.arm, arguments).as_bytes())?;
    if let Some(folder) = folder {
        for drawn in design.figures() {
            figure::write(folder, &drawn)?;
        }
        writeln!(output, "\nfigures written to {} as SVG and CSV", folder.display())?;
    }
    Ok(())
}

/// Reads the paper's lengths off the rows, or says what is not as the method needs it.
fn lengths(model: &Model) -> Result<Lengths, String> {
    let [waist, shoulder, elbow, ..] = model.chain.joints.as_slice() else {
        return Err(format!(
            "the method needs waist, shoulder and elbow, and this arm has {} joints",
            model.chain.len()
        ));
    };
    let square = |angle: f64| (angle.abs() - FRAC_PI_2).abs() < 1e-3;
    let level = |angle: f64| angle.sin().abs() < 1e-3;
    if let Some(joint) = [waist, shoulder, elbow].iter().find(|joint| joint.motion != Motion::Turns) {
        return Err(format!("`{}` slides; the method turns waist, shoulder and elbow", joint.name));
    }
    if !square(waist.alpha) || waist.a.abs() > 1e-6 {
        return Err(format!(
            "the axes of `{}` and `{}` must meet at a right angle: the row of `{}` needs alpha_deg 90 or -90 and a_mm 0",
            waist.name, shoulder.name, waist.name
        ));
    }
    if !level(shoulder.alpha) || shoulder.a.abs() < 1.0 {
        return Err(format!(
            "the axes of `{}` and `{}` must be parallel and apart: the row of `{}` needs alpha_deg 0 and the upper arm's length as a_mm",
            shoulder.name, elbow.name, shoulder.name
        ));
    }
    let last = model.chain.len() == 3;
    if elbow.a.abs() < 1.0 || !(last || level(elbow.alpha)) {
        return Err(format!(
            "the axis after `{}` must be parallel to its own, a forearm's length as a_mm apart: the wrist hangs there",
            elbow.name
        ));
    }
    // The hand hangs on the axis of the wrist's pitch: across it by that row's length, then along and across the axes after it.
    let rows = || model.chain.joints.iter().enumerate();
    let across: f64 = rows().skip(3).map(|(_, joint)| joint.a.abs()).sum();
    let hand = across + rows().skip(4).map(|(_, joint)| joint.d.abs()).sum::<f64>();
    Ok(Lengths {
        upper_arm: shoulder.a.abs(),
        forearm: elbow.a.abs(),
        shoulder_height: waist.d + model.base.pose.translation.vector.z,
        hand,
    })
}

/// What is best, and from where to where it is as good as that.
struct Design {
    best: Initialization,
    lengths: Lengths,
    working_distance: f64,
    /// How far from hanging down the forearm may start, rad.
    tolerance: f64,
    /// Worst error over all starts within the tolerance, mm.
    error: f64,
    distances: Option<(f64, f64)>,
    heights: Option<(f64, f64)>,
    back_rotations: Option<(f64, f64)>,
}

/// Every number that was given has to be above zero.
fn check_given(arguments: &Arguments) -> Result<(), String> {
    let given = [
        ("K", arguments.edge_distance),
        ("D", arguments.trigger_height),
        ("Br", arguments.back_rotation),
        ("h", Some(arguments.working_distance)),
    ];
    if let Some((name, value)) = given
        .iter()
        .filter_map(|(name, value)| value.map(|value| (name, value)))
        .find(|(_, value)| !(value.is_finite() && *value > 0.0))
    {
        return Err(format!("--{name} {value}: write a number above 0"));
    }
    Ok(())
}

/// Why an arm cannot do what was chosen.
fn unreachable_with(chosen: Initialization, tolerance: f64) -> String {
    let why = STARTING
        .iter()
        .map(|fraction| chosen.errors(-FRAC_PI_2 + fraction * tolerance, CYCLES + 1))
        .find_map(Result::err)
        .map_or_else(String::new, |error| error.to_string());
    format!(
        "K = {:.1}, D = {:.1} mm and Br = {:.1} deg cannot be done by this arm: {why}",
        chosen.edge_distance,
        chosen.trigger_height,
        chosen.back_rotation.to_degrees()
    )
}

/// The error after the cycles from a start of the forearm, micron.
fn micron(arm: Initialization, start: f64) -> Option<f64> {
    arm.errors(start, CYCLES + 1).ok().and_then(|errors| errors.last().map(|error| error * 1e3))
}

/// A figure of one curve, the error over what is varied.
fn error_figure(name: &str, title: &str, across: &str, points: Vec<(f64, f64)>) -> Figure {
    Figure {
        file_name: name.to_owned(),
        title: title.to_owned(),
        across: across.to_owned(),
        up: "error, micron".to_owned(),
        curves: vec![Curve { name: "error".to_owned(), points }],
        scattered: false,
    }
}

impl Design {
    fn of(lengths: Lengths, arguments: &Arguments) -> Result<Self, String> {
        check_given(arguments)?;
        let h = arguments.working_distance;
        let tolerance = start_tolerance(lengths.forearm, h)
            .ok_or_else(|| format!("--h {h}: no sensor works further off than the forearm is long"))?;
        let height = arguments.trigger_height.unwrap_or(lengths.hand + h);
        let reach = lengths.upper_arm + lengths.forearm;
        let first = Initialization {
            upper_arm: lengths.upper_arm,
            forearm: lengths.forearm,
            shoulder_height: lengths.shoulder_height,
            edge_distance: arguments.edge_distance.unwrap_or(0.5 * reach),
            trigger_height: height,
            back_rotation: arguments.back_rotation.unwrap_or(USUAL_BACK_DEG).to_radians(),
        };
        let at_distance = |distance: f64| Initialization { edge_distance: distance, ..first };
        let mut best = first;
        if arguments.edge_distance.is_none() {
            let searched = least(0.02 * reach, reach, |distance| worst(at_distance(distance), tolerance));
            best = searched.map(at_distance).ok_or_else(|| {
                format!(
                    "with the sensor firing at D = {height:.1} mm under a shoulder at {:.1} mm no distance of the target can be reached from every start; try another --h or --D",
                    lengths.shoulder_height
                )
            })?;
        }
        if worst(best, tolerance).is_none() {
            return Err(unreachable_with(best, tolerance));
        }
        let at_height = |height: f64| Initialization { trigger_height: height, ..best };
        let at_rotation = |degrees: f64| Initialization { back_rotation: degrees.to_radians(), ..best };
        let at_best_distance = |distance: f64| Initialization { edge_distance: distance, ..best };
        let good = |from: f64, to: f64, at: f64, arm: &dyn Fn(f64) -> Initialization| {
            around(from, to, at, |value| {
                worst(arm(value), tolerance).is_some_and(|error| error <= NEGLIGIBLE)
            })
        };
        Ok(Self {
            distances: good(0.02 * reach, reach, best.edge_distance, &at_best_distance),
            heights: good(1.0, lengths.shoulder_height, best.trigger_height, &at_height),
            back_rotations: good(0.1, MOST_BACK_DEG, best.back_rotation.to_degrees(), &at_rotation),
            error: worst(best, tolerance).unwrap_or(f64::NAN),
            best,
            lengths,
            working_distance: h,
            tolerance,
        })
    }

    fn report(&self, arm: &str, arguments: &Arguments) -> String {
        let Lengths { upper_arm, forearm, shoulder_height, hand } = self.lengths;
        let chosen = |given: bool| if given { "as given" } else { "recommended" };
        let range = |range: Option<(f64, f64)>, unit: &str| {
            range.map_or_else(
                || format!("nowhere near within {:.0} micron", NEGLIGIBLE * 1e3),
                |(low, high)| format!("{low:.1} to {high:.1} {unit} within {:.0} micron", NEGLIGIBLE * 1e3),
            )
        };
        let line = |name: &str, value: String, given: bool, range: String| {
            format!("{name:<28} {value:>10}  {:<12} {range}\n", chosen(given))
        };
        let best = &self.best;
        let mut text = format!(
            "{arm}: L1 = {upper_arm:.1}, L2 = {forearm:.1}, H = {shoulder_height:.1}, hand {hand:.1} mm; sensor at h = {:.1} mm\n\n",
            self.working_distance
        );
        text.push_str(&line(
            "K, distance of line B",
            format!("{:.1} mm", best.edge_distance),
            arguments.edge_distance.is_some(),
            range(self.distances, "mm"),
        ));
        text.push_str(&line(
            "D, the wrist's trigger height",
            format!("{:.1} mm", best.trigger_height),
            arguments.trigger_height.is_some(),
            range(self.heights, "mm"),
        ));
        text.push_str(&line(
            "Br, back rotation",
            format!("{:.1} deg", best.back_rotation.to_degrees()),
            arguments.back_rotation.is_some(),
            range(self.back_rotations, "deg"),
        ));
        text.push_str(&format!(
            "\nThe forearm may start {:.1} deg either side of hanging down. From the worst such start the method itself leaves {:.3} micron after {CYCLES} further cycles.\n\
             Each range is with the other two as chosen. A smaller Br saves time; it must be more than play and the sensor's hysteresis take.\n",
            self.tolerance.to_degrees(),
            self.error * 1e3
        ));
        text
    }

    /// Figures 7 to 10 and 12 of the paper, for this arm.
    fn figures(&self) -> Vec<Figure> {
        let best = self.best;
        let reach = self.lengths.upper_arm + self.lengths.forearm;
        let start = -FRAC_PI_2;
        let along = |from: f64, to: f64, value: &dyn Fn(f64) -> Option<f64>| {
            through(from, to).filter_map(|x| value(x).map(|y| (x, y))).collect::<Vec<_>>()
        };
        let tolerances = along(0.0, 2.0 * self.working_distance, &|clearance| {
            start_tolerance(self.lengths.forearm, clearance).map(f64::to_degrees)
        });
        vec![
            error_figure(
                "design-07-start",
                "Error after three further cycles against the forearm's start",
                "forearm's start Bi, deg",
                along(250.0, 360.0, &|degrees| micron(best, degrees.to_radians())),
            ),
            error_figure(
                "design-08-back-rotation",
                "Error after three further cycles against the back rotation",
                "back rotation Br, deg",
                along(0.0, MOST_BACK_DEG, &|degrees| {
                    micron(Initialization { back_rotation: degrees.to_radians(), ..best }, start)
                }),
            ),
            error_figure(
                "design-09-distance",
                "Error after three further cycles against the place of the target",
                "distance K of line B from the waist, mm",
                along(0.02 * reach, reach, &|distance| {
                    micron(Initialization { edge_distance: distance, ..best }, start)
                }),
            ),
            error_figure(
                "design-10-trigger-height",
                "Error after three further cycles against the wrist's trigger height",
                "trigger height D, mm",
                along(1.0, self.lengths.shoulder_height, &|height| {
                    micron(Initialization { trigger_height: height, ..best }, start)
                }),
            ),
            Figure {
                up: "tolerance about the vertical, deg".to_owned(),
                ..error_figure(
                    "design-12-tolerance",
                    "How far from vertical the forearm may start",
                    "working distance h of the sensor, mm",
                    tolerances,
                )
            },
        ]
    }
}

/// Starts of the forearm, as shares of its tolerance about hanging down.
const STARTING: [f64; STARTS] = [-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0];

/// The greatest error the method leaves over all starts, mm; nothing where some cycle is out of reach.
fn worst(arm: Initialization, tolerance: f64) -> Option<f64> {
    STARTING.iter().try_fold(0.0_f64, |worst, fraction| {
        let errors = arm.errors(-FRAC_PI_2 + fraction * tolerance, CYCLES + 1).ok()?;
        errors.last().filter(|error| error.is_finite()).map(|error| worst.max(error.abs()))
    })
}

fn through(from: f64, to: f64) -> impl Iterator<Item = f64> {
    (0..=STEPS).map(move |step| from + (to - from) * step as f64 / STEPS as f64)
}

/// Where a value is least; nothing where there is none.
fn least(from: f64, to: f64, value: impl Fn(f64) -> Option<f64>) -> Option<f64> {
    let known = through(from, to).filter_map(|at| value(at).map(|value| (at, value)));
    known.min_by(|left, right| left.1.total_cmp(&right.1)).map(|(at, _)| at)
}

/// The range around a value in which something holds throughout; nothing where it does not hold there.
fn around(from: f64, to: f64, at: f64, holds: impl Fn(f64) -> bool) -> Option<(f64, f64)> {
    if !holds(at) {
        return None;
    }
    let step = (to - from) / STEPS as f64;
    let edge = |sign: f64, end: f64| {
        let mut last = at;
        for count in 1..=STEPS {
            let next = at + sign * step * count as f64;
            if sign * (next - end) > 0.0 || !holds(next) {
                break;
            }
            last = next;
        }
        last
    };
    Some((edge(-1.0, from), edge(1.0, to)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARM: &str = "
arm: made-up
convention: distal
joints:
  - {name: waist, a_mm: 0, alpha_deg: 90, d_mm: 195}
  - {name: shoulder, a_mm: 177.8, alpha_deg: 0}
  - {name: elbow, a_mm: 177.8, alpha_deg: 0, less: shoulder}
  - {name: wrist_pitch, alpha_deg: 90, theta_deg: 90, less: elbow}
  - {name: wrist_roll, d_mm: 109}
";

    fn model(from: &str, to: &str) -> Model {
        Model::parse("arm.yaml", &ARM.replace(from, to)).unwrap()
    }

    fn free() -> Arguments {
        Arguments {
            model: PathBuf::new(),
            edge_distance: None,
            trigger_height: None,
            back_rotation: None,
            working_distance: 8.0,
        }
    }

    #[test]
    fn for_the_papers_arm_its_own_choice_is_as_good_as_the_best() {
        let lengths = lengths(&model("", "")).unwrap();
        assert_eq!(
            lengths,
            Lengths { upper_arm: 177.8, forearm: 177.8, shoulder_height: 195.0, hand: 109.0 }
        );
        let design = Design::of(lengths, &free()).unwrap();
        assert!((design.best.trigger_height - 117.0).abs() < 1e-9);
        assert!((design.tolerance.to_degrees() - 17.253).abs() < 0.01);
        let (near, far) = design.distances.unwrap();
        assert!(near < 140.0 && 140.0 < far, "the paper's K is 140 mm, here {near} to {far}");
        let (_, most) = design.back_rotations.unwrap();
        assert!(most > USUAL_BACK_DEG, "the paper's Br is 5 deg, here up to {most}");
        assert!(design.error <= NEGLIGIBLE);
        // What is recommended is no worse than what the paper chose.
        let paper = Initialization::table_2_1();
        assert!(design.error <= worst(paper, design.tolerance).unwrap());
        assert_eq!(design.figures().len(), 5);
    }

    #[test]
    fn of_an_arm_without_the_papers_joints_it_is_said_what_it_lacks() {
        let refused = |from: &str, to: &str| lengths(&model(from, to)).unwrap_err();
        assert!(refused("a_mm: 0, alpha_deg: 90", "a_mm: 25, alpha_deg: 90").contains("must meet"));
        assert!(
            refused("a_mm: 177.8, alpha_deg: 0}", "a_mm: 177.8, alpha_deg: 30}").contains("must be parallel")
        );
        assert!(refused("d_mm: 195}", "d_mm: 195, slides: true}").contains("`waist` slides"));
    }

    #[test]
    fn numbers_that_cannot_be_are_refused_with_the_reason() {
        let lengths = lengths(&model("", "")).unwrap();
        let refused = |arguments: Arguments| Design::of(lengths, &arguments).err().unwrap();
        assert!(refused(Arguments { edge_distance: Some(-1.0), ..free() }).contains("--K -1"));
        assert!(refused(Arguments { edge_distance: Some(2000.0), ..free() }).contains("cannot be done"));
        assert!(refused(Arguments { working_distance: 500.0, ..free() }).contains("--h 500"));
        assert!(refused(Arguments { trigger_height: Some(1e4), ..free() }).contains("D = 10000.0"));
    }
}
