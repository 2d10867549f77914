//! Worlds for the study: the cell's own, with joints' zeros, rig and one hidden effect wrong by what a seed draws.

use plumb_estimation::Random;

use super::cell_text::with_value;

/// What is hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Hidden {
    /// Zeros and rig alone.
    Nothing,
    /// The shoulder gives way to the arm's weight.
    Shoulder,
    /// The elbow has play.
    Elbow,
    /// The shoulder's wheel runs out of true.
    Wheel,
    /// The lens bends straight lines.
    Lens,
    /// Pictures are exposed later than their times say, and scanned in motion: for an arm that reports where it is on its way.
    Delay,
}

impl Hidden {
    /// Those that are studied unless specified otherwise.
    pub const ALL: [Self; 6] =
        [Self::Nothing, Self::Shoulder, Self::Elbow, Self::Wheel, Self::Lens, Self::Delay];

    /// For tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing else",
            Self::Shoulder => "shoulder gives way",
            Self::Elbow => "elbow has play",
            Self::Wheel => "wheel out of true",
            Self::Lens => "lens bends lines",
            Self::Delay => "exposed late",
        }
    }

    /// What the lab has to name: the effect and where; whatever the order of a wheel's periods.
    pub fn is_named_by(self, name: &str) -> bool {
        match self {
            Self::Nothing => false,
            Self::Shoulder => name == "joint_compliance(shoulder)",
            Self::Elbow => name == "joint_backlash(elbow)",
            Self::Wheel => name.starts_with("joint_harmonic(shoulder"),
            Self::Lens => name == "lens_distortion(sensor)",
            Self::Delay => name == "clock_skew(sensor)",
        }
    }

    /// How fast the cell scans in motion, mm/s; 0: at rest for every stripe.
    pub fn fly_mm_s(self) -> f64 {
        if self == Self::Delay { 160.0 } else { 0.0 }
    }

    /// Lines under the arm's `imperfections:`.
    fn imperfection(self, chance: &mut Random) -> String {
        let size = 0.7 + 0.6 * chance.uniform();
        match self {
            Self::Shoulder => {
                format!("\n      - joint_compliance: {{joint: shoulder, rad_per_nm: {:.6}}}", 1.5e-4 * size)
            }
            Self::Elbow => {
                format!("\n      - joint_backlash: {{joint: elbow, width_deg: {:.5}}}", 0.4 * size)
            }
            Self::Wheel => format!(
                "\n      - joint_harmonic: {{joint: shoulder, per_turn: 3, amplitude_deg: {:.5}, phase_deg: {:.2}}}",
                0.35 * size,
                360.0 * chance.uniform()
            ),
            Self::Nothing | Self::Lens | Self::Delay => String::new(),
        }
    }
}

/// What a ruler and a level leave of joints' zeros, deg either way.
const ZERO_WITHIN_DEG: f64 = 0.2;
/// By how much the rig sits beside its drawing, mm either way.
const SHIFT_MM: f64 = 1.0;
/// By how much camera and projector are turned each, deg either way.
const TURN_DEG: f64 = 0.25;

/// The world of a seed, from the cell's world file; none when that does not hold what has to change in it.
pub fn world(text: &str, hidden: Hidden, seed: u64) -> Option<String> {
    let mut chance = Random::seeded(seed);
    let mut either = |size: f64| size * (2.0 * chance.uniform() - 1.0);
    let zeros = ["shoulder", "elbow", "wrist_roll", "wrist_bend", "flange"];
    let zeros: Vec<String> =
        zeros.iter().map(|joint| format!("{joint}_deg: {:.5}", either(ZERO_WITHIN_DEG))).collect();
    let shift: Vec<f64> = (0..3).map(|_| either(SHIFT_MM)).collect();
    let mut turns = || [either(TURN_DEG), either(TURN_DEG), either(TURN_DEG)];
    let (camera, projector) = (turns(), turns());
    let text = with_value(text, "seed", &seed.to_string())?;
    let mut imperfections = hidden.imperfection(&mut chance);
    if !imperfections.is_empty() {
        imperfections.insert_str(0, "\n    imperfections:");
    }
    let faults = format!("encoder\n    zero_error: {{{}}}{imperfections}", zeros.join(", "));
    let text = with_value(&text, "resolution", &faults)?;
    let text = placed(&text, "camera:", &shift, &camera)?;
    let text = placed(&text, "projector:", &shift, &projector)?;
    let size = 0.7 + 0.6 * chance.uniform();
    let (anchor, line) = match hidden {
        Hidden::Lens => ("    blur_px:", format!("    distortion: {{k1: {:.5}}}\n", -0.45 * size)),
        Hidden::Delay => ("  camera:", format!("  exposure_delay_ms: {:.4}\n", 15.0 * size)),
        _ => return Some(text),
    };
    let (before, after) = text.split_at(text.find(anchor)?);
    Some(format!("{before}{line}{after}"))
}

/// The text with the first `in_flange:` after a word shifted and turned.
fn placed(text: &str, after: &str, shift: &[f64], turn: &[f64]) -> Option<String> {
    let at = text.find(after)?;
    let begin = at + text.get(at..)?.find("in_flange:")?;
    let end = begin + text.get(begin..)?.find('\n')?;
    let line = text.get(begin..end)?;
    let list = |key: &str| -> Option<Vec<f64>> {
        let from = line.find(key)? + key.len();
        let inside = line.get(from..)?.split_once('[')?.1.split_once(']')?.0;
        inside.split(',').map(|number| number.trim().parse().ok()).collect()
    };
    let sum = |numbers: &[f64], more: &[f64]| {
        let sums = numbers.iter().zip(more).map(|(a, b)| format!("{:.6}", a + b));
        sums.collect::<Vec<_>>().join(", ")
    };
    let xyz = sum(&list("xyz_mm:")?, shift);
    let rpy = sum(&list("rpy_deg:").unwrap_or_else(|| vec![0.0; 3]), turn);
    let placed = format!("in_flange: {{xyz_mm: [{xyz}], rpy_deg: [{rpy}]}}");
    Some(format!("{}{placed}{}", text.get(..begin)?, text.get(end..)?))
}

#[cfg(test)]
mod tests {
    use plumb_simulated::world_file::{Described, read};

    use super::*;

    #[test]
    fn every_hidden_effect_makes_a_world_that_can_be_read_and_only_one_is_in_it() {
        let paper = include_str!("../../../../workcells/light-stripe/world.yaml");
        let modern = include_str!("../../../../workcells/light-stripe/world-modern.yaml");
        for (hidden, text) in Hidden::ALL.into_iter().flat_map(|hidden| [(hidden, paper), (hidden, modern)]) {
            let changed = world(text, hidden, 7).unwrap();
            let folder = tempfile::tempdir().unwrap();
            let file = folder.path().join("world.yaml");
            std::fs::write(&file, &changed).unwrap();
            let Described::Arm(described) = read(&file).unwrap() else { panic!("no PUMA") };
            assert_eq!(described.seed, 7);
            let expected = usize::from(matches!(hidden, Hidden::Shoulder | Hidden::Elbow | Hidden::Wheel));
            assert_eq!(described.imperfections.len(), expected, "{changed}");
            assert!(described.zero_error[1] != 0.0 && described.zero_error[0] == 0.0);
            let light = described.light.unwrap();
            assert_eq!(light.camera.radial[0] != 0.0, hidden == Hidden::Lens);
            assert_eq!(light.exposure_delay_ns != 0, hidden == Hidden::Delay);
            assert_eq!(world(text, hidden, 7), Some(changed), "the same seed makes the same world");
        }
    }
}
