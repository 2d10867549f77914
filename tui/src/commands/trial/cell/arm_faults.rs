//! What can be wrong with a PUMA 560: the `imperfections` of its world, and what the lab calls them.

use plumb_simulated::physics::campaign::Hidden;
use plumb_simulated::physics::random::Random;

use super::super::TrialError;
use super::{Fault, hidden, site_for};

/// One fault: its line under `imperfections:`, and its name in the lab.
pub(super) type Drawn = (String, Hidden);

/// Joints that give way, and between what, rad/(N m): the less a joint carries the more shows.
const SOFT: [(&str, (f64, f64)); 2] = [("shoulder", (0.8e-4, 2e-4)), ("elbow", (1.5e-4, 3e-4))];

/// Joints in which something can turn wrongly: all but the last, whose own turn hardly moves what the hand carries.
const TURNING: [(&str, ()); 5] =
    [("waist", ()), ("shoulder", ()), ("elbow", ()), ("wrist_roll", ()), ("wrist_bend", ())];

/// Joints that others drag along.
const DRAGGED: [(&str, &str); 4] =
    [("flange", "wrist_bend"), ("wrist_bend", "wrist_roll"), ("wrist_roll", "elbow"), ("elbow", "shoulder")];

/// Rows whose numbers can be wrong and move the hand.
const LENGTHS: [(&str, ()); 2] = [("shoulder", ()), ("elbow", ())];
const OFFSETS: [(&str, ()); 2] = [("shoulder", ()), ("wrist_roll", ())];
const LEANING: [(&str, ()); 3] = [("waist", ()), ("shoulder", ()), ("elbow", ())];

/// Waves a turn that wheels of the arm make.
const WAVES: [f64; 6] = [1.0, 2.0, 3.0, 4.0, 6.0, 8.0];

/// A fault that is one number at one joint, of either sign.
struct OneNumber {
    /// As `--fault` names it.
    name: &'static str,
    /// The effect, as the library and the world name it.
    effect: &'static str,
    /// The key of its number in the world file.
    key: &'static str,
    unit: &'static str,
    sites: &'static [(&'static str, ())],
    /// Least and greatest size.
    range: (f64, f64),
    digits: usize,
}

/// The faults that are one number at one joint.
const ONE_NUMBER: [OneNumber; 5] = [
    OneNumber {
        name: "gain",
        effect: "joint_gain",
        key: "deg_per_deg",
        unit: "1",
        sites: &TURNING,
        range: (0.002, 0.005),
        digits: 6,
    },
    OneNumber {
        name: "length",
        effect: "link_length",
        key: "mm",
        unit: "mm",
        sites: &LENGTHS,
        range: (0.8, 1.6),
        digits: 4,
    },
    OneNumber {
        name: "offset",
        effect: "link_offset",
        key: "mm",
        unit: "mm",
        sites: &OFFSETS,
        range: (0.8, 1.6),
        digits: 4,
    },
    OneNumber {
        name: "twist",
        effect: "link_twist",
        key: "deg",
        unit: "deg",
        sites: &LEANING,
        range: (0.1, 0.2),
        digits: 5,
    },
    OneNumber {
        name: "skew",
        effect: "axis_skew",
        key: "deg",
        unit: "deg",
        sites: &LEANING,
        range: (0.1, 0.2),
        digits: 5,
    },
];

/// What chance gives for a fault; drawn whole whatever the fault, so that the rest of the world does not depend on it.
struct Chance {
    drawn: usize,
    fraction: f64,
    sign: f64,
    phase_deg: f64,
}

impl Chance {
    fn draw(rng: &mut Random) -> Self {
        let drawn = rng.below(60);
        let fraction = rng.between(0.0, 1.0);
        let sign = if rng.chance(0.5) { 1.0 } else { -1.0 };
        Self { drawn, fraction, sign, phase_deg: rng.between(0.0, 360.0) }
    }

    fn size(&self, (low, high): (f64, f64)) -> f64 {
        low + (high - low) * self.fraction
    }
}

/// Draws a fault of the arm; nothing for one that is none of it.
pub(super) fn draw(fault: &Fault, rng: &mut Random) -> Result<Option<Drawn>, TrialError> {
    let chance = Chance::draw(rng);
    if let Some(one) = ONE_NUMBER.iter().find(|one| one.name == fault.name) {
        return one_number(one, fault, &chance).map(Some);
    }
    Ok(Some(match fault.name.as_str() {
        "compliance" => compliance(fault, &chance)?,
        "stiffening" => stiffening(fault, &chance)?,
        "sag" => {
            let (joint, ()) = site_for(fault, &[("shoulder", ())], chance.drawn)?;
            let give = chance.size((1e-4, 3e-4));
            let text = format!("link_sag: {{joint: {joint}, per_nm2: {give:.4e}}}");
            (text, hidden("link_sag", joint, give, "1/(N m2)"))
        }
        "backlash" => {
            let (joint, ()) = site_for(fault, &TURNING, chance.drawn)?;
            let play = chance.size((0.2, 0.4));
            let text = format!("joint_backlash: {{joint: {joint}, width_deg: {play:.4}}}");
            (text, hidden("joint_backlash", joint, play, "deg"))
        }
        "harmonic" => harmonic(fault, &chance)?,
        "coupling" => coupling(fault, &chance)?,
        "warm_up" => warm_up(fault, &chance)?,
        _ => return Ok(None),
    }))
}

fn one_number(one: &OneNumber, fault: &Fault, chance: &Chance) -> Result<Drawn, TrialError> {
    let (joint, ()) = site_for(fault, one.sites, chance.drawn)?;
    let (size, digits) = (chance.sign * chance.size(one.range), one.digits);
    let text = format!("{}: {{joint: {joint}, {}: {size:.digits$}}}", one.effect, one.key);
    Ok((text, hidden(one.effect, joint, size, one.unit)))
}

fn compliance(fault: &Fault, chance: &Chance) -> Result<Drawn, TrialError> {
    let (joint, range) = site_for(fault, &SOFT, chance.drawn)?;
    let give = chance.size(*range);
    let text = format!("joint_compliance: {{joint: {joint}, rad_per_nm: {give:.4e}}}");
    Ok((text, hidden("joint_compliance", joint, give, "rad/(N m)")))
}

fn stiffening(fault: &Fault, chance: &Chance) -> Result<Drawn, TrialError> {
    let (joint, range) = site_for(fault, &SOFT, chance.drawn)?;
    let give = 1.5 * chance.size(*range);
    let text = format!("joint_stiffening: {{joint: {joint}, rad_per_nm: {give:.4e}, knee_nm: 12}}");
    Ok((text, hidden("joint_stiffening", joint, give, "rad/(N m)")))
}

fn harmonic(fault: &Fault, chance: &Chance) -> Result<Drawn, TrialError> {
    let (joint, ()) = site_for(fault, &TURNING, chance.drawn)?;
    let wave = chance.size((0.1, 0.3));
    let per_turn = WAVES.get(chance.drawn % WAVES.len()).copied().unwrap_or(1.0);
    let phase = chance.phase_deg;
    let text = format!(
        "joint_harmonic: {{joint: {joint}, per_turn: {per_turn}, amplitude_deg: {wave:.4}, phase_deg: {phase:.2}}}"
    );
    let mut hidden = hidden("joint_harmonic", joint, wave, "deg");
    hidden.details.insert("n".to_owned(), per_turn.into());
    Ok((text, hidden))
}

fn coupling(fault: &Fault, chance: &Chance) -> Result<Drawn, TrialError> {
    let (joint, driver) = site_for(fault, &DRAGGED, chance.drawn)?;
    let drag = chance.sign * chance.size((0.01, 0.02));
    let text = format!("joint_coupling: {{joint: {joint}, driver: {driver}, deg_per_deg: {drag:.5}}}");
    let mut hidden = hidden("joint_coupling", joint, drag, "1");
    hidden.details.insert("with".to_owned(), (*driver).into());
    Ok((text, hidden))
}

fn warm_up(fault: &Fault, chance: &Chance) -> Result<Drawn, TrialError> {
    let (joint, ()) = site_for(fault, &LEANING, chance.drawn)?;
    let drift = chance.sign * chance.size((0.1, 0.3));
    let text = format!("warm_up: {{joint: {joint}, zero_deg: {drift:.5}, time_constant_s: 300}}");
    let mut hidden = hidden("warm_up", joint, drift, "deg");
    hidden.details.insert("of".to_owned(), "zero".into());
    Ok((text, hidden))
}
