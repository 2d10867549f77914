//! What can be wrong with a PUMA 560: the `imperfections` of its world, and what the lab calls them.

use plumb_simulated::physics::campaign::Hidden;
use plumb_simulated::physics::random::Random;

use super::super::TrialError;
use super::{Fault, hidden, place};

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

/// Draws a fault of the arm; nothing for one that is none of it.
pub(super) fn draw(fault: &Fault, lot: &mut Random) -> Result<Option<Drawn>, TrialError> {
    let drawn = lot.below(60);
    let share = lot.between(0.0, 1.0);
    let sign = if lot.chance(0.5) { 1.0 } else { -1.0 };
    let phase = lot.between(0.0, 360.0);
    let size = |(low, high): (f64, f64)| low + (high - low) * share;
    let one = |text: String, hidden: Hidden| Ok(Some((text, hidden)));
    match fault.name.as_str() {
        "compliance" => {
            let (joint, range) = place(fault, &SOFT, drawn)?;
            let give = size(*range);
            let text = format!("joint_compliance: {{joint: {joint}, rad_per_nm: {give:.4e}}}");
            one(text, hidden("joint_compliance", joint, give, "rad/(N m)"))
        }
        "stiffening" => {
            let (joint, range) = place(fault, &SOFT, drawn)?;
            let give = 1.5 * size(*range);
            let text = format!("joint_stiffening: {{joint: {joint}, rad_per_nm: {give:.4e}, knee_nm: 12}}");
            one(text, hidden("joint_stiffening", joint, give, "rad/(N m)"))
        }
        "sag" => {
            let (joint, ()) = place(fault, &[("shoulder", ())], drawn)?;
            let give = size((1e-4, 3e-4));
            let text = format!("link_sag: {{joint: {joint}, per_nm2: {give:.4e}}}");
            one(text, hidden("link_sag", joint, give, "1/(N m2)"))
        }
        "backlash" => {
            let (joint, ()) = place(fault, &TURNING, drawn)?;
            let play = size((0.2, 0.4));
            let text = format!("joint_backlash: {{joint: {joint}, width_deg: {play:.4}}}");
            one(text, hidden("joint_backlash", joint, play, "deg"))
        }
        "harmonic" => {
            let (joint, ()) = place(fault, &TURNING, drawn)?;
            let (wave, per_turn) = (size((0.1, 0.3)), WAVES.get(drawn % WAVES.len()).copied().unwrap_or(1.0));
            let text = format!(
                "joint_harmonic: {{joint: {joint}, per_turn: {per_turn}, amplitude_deg: {wave:.4}, phase_deg: {phase:.2}}}"
            );
            let mut hidden = hidden("joint_harmonic", joint, wave, "deg");
            hidden.details.insert("n".to_owned(), per_turn.into());
            one(text, hidden)
        }
        "coupling" => {
            let (joint, driver) = place(fault, &DRAGGED, drawn)?;
            let drag = sign * size((0.01, 0.02));
            let text =
                format!("joint_coupling: {{joint: {joint}, driver: {driver}, deg_per_deg: {drag:.5}}}");
            let mut hidden = hidden("joint_coupling", joint, drag, "1");
            hidden.details.insert("with".to_owned(), (*driver).into());
            one(text, hidden)
        }
        "gain" => {
            let (joint, ()) = place(fault, &TURNING, drawn)?;
            let more = sign * size((0.002, 0.005));
            let text = format!("joint_gain: {{joint: {joint}, deg_per_deg: {more:.6}}}");
            one(text, hidden("joint_gain", joint, more, "1"))
        }
        "length" => {
            let (joint, ()) = place(fault, &LENGTHS, drawn)?;
            let longer = sign * size((0.8, 1.6));
            one(
                format!("link_length: {{joint: {joint}, mm: {longer:.4}}}"),
                hidden("link_length", joint, longer, "mm"),
            )
        }
        "offset" => {
            let (joint, ()) = place(fault, &OFFSETS, drawn)?;
            let further = sign * size((0.8, 1.6));
            one(
                format!("link_offset: {{joint: {joint}, mm: {further:.4}}}"),
                hidden("link_offset", joint, further, "mm"),
            )
        }
        "twist" => {
            let (joint, ()) = place(fault, &LEANING, drawn)?;
            let more = sign * size((0.1, 0.2));
            one(
                format!("link_twist: {{joint: {joint}, deg: {more:.5}}}"),
                hidden("link_twist", joint, more, "deg"),
            )
        }
        "skew" => {
            let (joint, ()) = place(fault, &LEANING, drawn)?;
            let more = sign * size((0.1, 0.2));
            one(
                format!("axis_skew: {{joint: {joint}, deg: {more:.5}}}"),
                hidden("axis_skew", joint, more, "deg"),
            )
        }
        "warm_up" => {
            let (joint, ()) = place(fault, &LEANING, drawn)?;
            let drift = sign * size((0.1, 0.3));
            let text = format!("warm_up: {{joint: {joint}, zero_deg: {drift:.5}, time_constant_s: 300}}");
            let mut hidden = hidden("warm_up", joint, drift, "deg");
            hidden.details.insert("of".to_owned(), "zero".into());
            one(text, hidden)
        }
        _ => Ok(None),
    }
}
