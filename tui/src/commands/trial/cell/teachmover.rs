//! The TeachMover's cell, with the proximity sensor in its hand over a T target.

use plumb_simulated::physics::campaign::{Hidden, Truth};
use plumb_simulated::physics::random::Random;

use super::super::TrialError;
use super::{Fault, TrialCell, hidden, site_for, truth};

/// The cell.
pub(in super::super) const CELL: TrialCell = TrialCell {
    name: "teachmover",
    faults: &["none", "spot", "backlash", "coupling", "droop", "lost_steps", "length", "trim", "hysteresis"],
    files,
    world,
    commands,
};

/// Where `measure-poses` looks for the poses it is to take.
pub(in super::super) const POSES: &str = "poses.csv";

const FILES: [(&str, &str); 11] = [
    ("cell.yaml", include_str!("../../../../../workcells/teachmover/cell-trial.yaml")),
    ("trial.model.yaml", include_str!("../../../../../workcells/teachmover/trial.model.yaml")),
    ("answers-trial.yaml", include_str!("../../../../../workcells/teachmover/answers-trial.yaml")),
    (
        "procedures/find-zeros.yaml",
        include_str!("../../../../../workcells/teachmover/procedures/find-zeros.yaml"),
    ),
    (
        "procedures/waist-initialization.yaml",
        include_str!("../../../../../workcells/teachmover/procedures/waist-initialization.yaml"),
    ),
    (
        "procedures/shoulder-elbow-initialization.yaml",
        include_str!("../../../../../workcells/teachmover/procedures/shoulder-elbow-initialization.yaml"),
    ),
    (
        "procedures/measure-by-triggers.yaml",
        include_str!("../../../../../workcells/teachmover/procedures/measure-by-triggers.yaml"),
    ),
    (
        "procedures/measure-poses.yaml",
        include_str!("../../../../../workcells/teachmover/procedures/measure-poses.yaml"),
    ),
    ("poses.csv", include_str!("../../../../../workcells/teachmover/poses.csv")),
    (
        "procedures/verify-by-points.yaml",
        include_str!("../../../../../workcells/teachmover/procedures/verify-by-points.yaml"),
    ),
    (
        "procedures/read-point.yaml",
        include_str!("../../../../../workcells/teachmover/procedures/read-point.yaml"),
    ),
];

const OPEN_WORLD: &str = include_str!("../../../../../workcells/teachmover/world-trial.yaml");

/// Noise of a trigger pose, mm.
const NOISE_MM: f64 = 0.06;

/// Joint, motor, and half-steps a second at full speed: those rated without load, and for the elbow those of the gripper, whose motor turns along.
const MOTORS: [(&str, (&str, f64)); 3] =
    [("waist", ("base", 472.0)), ("shoulder", ("shoulder", 405.0)), ("elbow", ("elbow", 292.0))];

/// Joints whose gears can have play.
const GEARS: [(&str, ()); 4] = [("waist", ()), ("shoulder", ()), ("elbow", ()), ("wrist_pitch", ())];

/// Joints that can give way, and how much of a range of one each does: the less it carries the more.
const SOFT: [(&str, (f64, f64)); 3] =
    [("shoulder", (0.15, 0.4)), ("elbow", (0.5, 1.0)), ("wrist_pitch", (1.0, 3.0))];

/// Joints that cables drag along, and by which.
const DRAGGED: [(&str, &str); 3] =
    [("elbow", "shoulder"), ("wrist_pitch", "shoulder"), ("wrist_pitch", "elbow")];

/// Lengths that can be wrong: key of the world's file, mm on paper, the effect with its site, and what is the same thing in this cell's readings.
type Length = (&'static str, f64, (&'static str, &'static str), Option<(&'static str, &'static str)>);
const LENGTHS: [(&str, Length); 4] = [
    ("shoulder", ("upper_arm_mm", 177.8, ("link_length", "shoulder"), None)),
    ("elbow", ("forearm_mm", 177.8, ("link_length", "elbow"), None)),
    ("wrist_roll", ("hand_mm", 109.0, ("link_offset", "wrist_roll"), Some(("tool_offset", "p1")))),
    ("waist", ("shoulder_height_mm", 195.0, ("link_offset", "waist"), Some(("base_position", "base")))),
];

/// What a fault changes in the world's file.
#[derive(Default)]
struct Change {
    /// Keys of `arm: teachmover:`.
    arm: String,
    /// Of the sensor: mm, mm, percent.
    site: Option<f64>,
    trim: Option<f64>,
    hysteresis: Option<f64>,
    hidden: Vec<Hidden>,
}

fn files() -> Vec<(&'static str, String)> {
    // The way to the zeros is driven without haste, so that steps are lost where they can be dated.
    let changed = |text: &str| {
        text.replace("world-trial.yaml", super::WORLD)
            .replace("chunk_deg: 1, speed: 1}", "chunk_deg: 1, speed: 0.3}")
    };
    FILES.iter().map(|(name, text)| (*name, changed(text))).collect()
}

fn commands(at: &str) -> String {
    let record = format!("--record {at}/record");
    format!(
        "  plumb run {at}/cell.yaml find-zeros {record}\n  \
         plumb run {at}/cell.yaml measure-by-triggers {record}\n  \
         plumb show --procedure measure-by-triggers --table {record} > {at}/table.csv\n  \
         plumb model diagnose {at}/trial.model.yaml --data {at}/table.csv\n  \
         plumb run {at}/cell.yaml verify-by-points {record}\n"
    )
}

fn world(fault: &Fault, seed: u64, rng: &mut Random) -> Result<(String, Truth), TrialError> {
    // Drawn first, so that the same seed is the same arm whatever is hidden in it.
    let [waist, shoulder, elbow, pitch] = [1.5, 1.5, 1.0, 0.5].map(|most| rng.between(-most, most));
    let [x, y, turn] = [0.3, 0.3, 0.1].map(|most| rng.between(-most, most));
    let change = change(fault, rng)?;
    let zeros = "zero_error: {waist_deg: 1.2, shoulder_deg: -1.4, elbow_deg: 0.8, wrist_pitch_deg: 0.4}";
    let arm = if change.arm.is_empty() { String::new() } else { format!("\n    {}", change.arm) };
    let drawn = format!(
        "zero_error: {{waist_deg: {waist:.4}, shoulder_deg: {shoulder:.4}, elbow_deg: {elbow:.4}, wrist_pitch_deg: {pitch:.4}}}{arm}"
    );
    let text = OPEN_WORLD
        .replace("seed: 1\n", &format!("seed: {seed}\n"))
        .replace(zeros, &drawn)
        .replace("diameter_mm: 1,", &format!("diameter_mm: {:.3},", change.site.unwrap_or(1.0)))
        .replace(
            "trimmed_to_fire_at_mm: 8,",
            &format!("trimmed_to_fire_at_mm: {:.3},", change.trim.unwrap_or(8.0)),
        )
        .replace(
            "hysteresis_percent: 10,",
            &format!("hysteresis_percent: {:.2},", change.hysteresis.unwrap_or(10.0)),
        )
        .replace(
            "    patch_margin_mm",
            &format!(
                "    misplaced: {{x_mm: {x:.4}, y_mm: {y:.4}, turn_deg: {turn:.4}}}\n    patch_margin_mm"
            ),
        );
    Ok((text, truth(seed, NOISE_MM, change.hidden)))
}

fn change(fault: &Fault, rng: &mut Random) -> Result<Change, TrialError> {
    let drawn = rng.below(12);
    let fraction = rng.between(0.0, 1.0);
    let sign = if rng.chance(0.5) { 1.0 } else { -1.0 };
    let size = |(low, high): (f64, f64)| {
        let value: f64 = low + (high - low) * fraction;
        (value * 1e4).round() / 1e4
    };
    let of_arm = |arm: String, hidden: Hidden| Change { arm, hidden: vec![hidden], ..Change::default() };
    Ok(match fault.name.as_str() {
        "spot" => {
            let wider = size((2.0, 4.0));
            let hidden = vec![hidden("trigger_spot", "sensor", wider, "mm")];
            Change { site: Some(1.0 + wider), hidden, ..Change::default() }
        }
        "trim" => {
            let higher = sign * size((0.3, 0.8));
            let hidden = vec![hidden("trigger_height", "sensor", higher, "mm")];
            Change { trim: Some(8.0 + higher), hidden, ..Change::default() }
        }
        "hysteresis" => {
            let more = size((8.0, 15.0));
            let hidden = vec![hidden("trigger_hysteresis", "sensor", 0.01 * more, "1")];
            Change { hysteresis: Some(10.0 + more), hidden, ..Change::default() }
        }
        "backlash" => {
            let (joint, ()) = site_for(fault, &GEARS, drawn)?;
            let play = size((0.3, 0.7));
            of_arm(format!("backlash: {{{joint}_deg: {play}}}"), hidden("joint_backlash", joint, play, "deg"))
        }
        "coupling" => {
            let (joint, driver) = site_for(fault, &DRAGGED, drawn)?;
            let drag = sign * size((0.01, 0.02));
            let mut hidden = hidden("joint_coupling", joint, drag, "1");
            hidden.details.insert("with".to_owned(), (*driver).into());
            of_arm(format!("cable_drag: {{{joint}_deg_per_{driver}_deg: {drag}}}"), hidden)
        }
        "droop" => {
            let (joint, range) = site_for(fault, &SOFT, drawn)?;
            let give = size(*range);
            let masses = "upper_arm_kg: 0.9, forearm_kg: 0.5, hand_kg: 0.4";
            let text = format!("droop: {{{masses}, {joint}_deg_per_nm: {give}}}");
            of_arm(text, hidden("joint_compliance", joint, give.to_radians(), "rad/(N m)"))
        }
        "lost_steps" => {
            let (joint, (motor, rated)) = site_for(fault, &MOTORS, drawn)?;
            let holds = (rated * size((0.8, 0.9))).round();
            // How far it will be off (0 here: not known) depends on where in its turns the motor falls out of step.
            let text = format!("pull_out_half_steps_per_s: {{{motor}: {holds}}}");
            of_arm(text, hidden("joint_step", joint, 0.0, "deg"))
        }
        "length" => {
            let longer = sign * size((0.8, 1.6));
            longer_link(fault, drawn, longer)?
        }
        _ => Change::default(),
    })
}

/// A link that is longer than its drawing, with the effects that are the same in this cell's readings.
fn longer_link(fault: &Fault, drawn: usize, longer_mm: f64) -> Result<Change, TrialError> {
    let (_, (key, on_paper, (effect, joint), same)) = site_for(fault, &LENGTHS, drawn)?;
    let plain = format!("{effect}({joint})");
    let mut all = vec![hidden(effect, joint, longer_mm, "mm")];
    all.extend(same.map(|(effect, joint)| {
        let mut other = hidden(effect, joint, longer_mm, "mm");
        other.details.insert("same_as".to_owned(), plain.clone().into());
        other
    }));
    Ok(Change { arm: format!("{key}: {:.4}", on_paper + longer_mm), hidden: all, ..Change::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arm_of_a_seed_is_the_same_whatever_is_hidden_in_it() {
        let zeros = |name: &str| {
            let fault = Fault { name: name.to_owned(), site: None };
            let (text, _) = world(&fault, 7, &mut Random::new(7, "cell trial")).unwrap();
            text.lines().find(|line| line.contains("zero_error")).unwrap().to_owned()
        };
        assert_eq!(zeros("none"), zeros("droop"));
    }
}
