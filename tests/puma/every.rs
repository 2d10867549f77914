//! Worlds over every effect that the world of a PUMA can hide: is it named, and does the tip then come to where it is sent?

use std::fmt;

use super::hidden::{Drawn, FLOOR_MM, Story, run_short_story};

/// The tip is at the floor where no more is left than this many times the floor.
const AT_FLOOR: f64 = 1.3;

/// A site at which an effect is hidden, the size it is given there, least and most.
struct HiddenEffect {
    effect: &'static str,
    words: &'static str,
    joint: &'static str,
    /// Sizes in the unit of the world's file, large enough to show at the tip and small enough to be met.
    least: f64,
    most: f64,
    unit: &'static str,
    /// What follows the joint in the world's file; `SIZE` and `PHASE` mean numbers.
    entry: &'static str,
}

const fn hide(
    effect: &'static str,
    words: &'static str,
    joint: &'static str,
    sizes: [f64; 2],
    unit: &'static str,
    entry: &'static str,
) -> HiddenEffect {
    let [least, most] = sizes;
    HiddenEffect { effect, words, joint, least, most, unit, entry }
}

/// Play.
const PLAY: &str = "width_deg: SIZE";
/// A joint that gives way.
const SOFT: &str = "rad_per_nm: SIZE";
/// Wheels out of true, once and twice a turn.
const WHEEL: &str = "per_turn: 1, amplitude_deg: SIZE, phase_deg: PHASE";
const WHEEL_TWICE: &str = "per_turn: 2, amplitude_deg: SIZE, phase_deg: PHASE";

/// Every effect the world's file knows, at the sites where it can be seen. Left out is the drift of a warming arm: a table of several runs has no time,
/// and the procedure's second pass says of it what is to be said.
const EFFECTS: [HiddenEffect; 36] = [
    hide("joint_backlash", "play", "waist", [0.12, 0.28], "deg", PLAY),
    hide("joint_compliance", "gives way", "shoulder", [3e-5, 9e-5], "rad/(N m)", SOFT),
    hide("joint_harmonic", "wheel out of true", "waist", [0.12, 0.28], "deg", WHEEL),
    hide(
        "joint_coupling",
        "wrist coupling",
        "flange",
        [0.01, 0.03],
        "deg/deg",
        "driver: wrist_bend, deg_per_deg: SIZE",
    ),
    hide(
        "joint_stiffening",
        "gives way less and less",
        "shoulder",
        [6e-5, 1.2e-4],
        "rad/(N m)",
        "rad_per_nm: SIZE, knee_nm: 20",
    ),
    hide("joint_gain", "wrong gear ratio", "waist", [0.002, 0.006], "deg/deg", "deg_per_deg: SIZE"),
    hide("link_length", "link too long", "shoulder", [0.5, 1.5], "mm", "mm: SIZE"),
    hide("joint_backlash", "play", "shoulder", [0.12, 0.28], "deg", PLAY),
    hide("link_twist", "axes at a wrong angle", "waist", [0.1, 0.3], "deg", "deg: SIZE"),
    hide("joint_harmonic", "wheel out of true", "shoulder", [0.12, 0.28], "deg", WHEEL),
    hide("link_sag", "link bends", "shoulder", [2e-4, 5e-4], "1/(N m2)", "per_nm2: SIZE"),
    hide("joint_backlash", "play", "elbow", [0.12, 0.28], "deg", PLAY),
    hide("joint_compliance", "gives way", "elbow", [1e-4, 3e-4], "rad/(N m)", SOFT),
    hide("joint_harmonic", "wheel out of true", "elbow", [0.12, 0.28], "deg", WHEEL),
    hide(
        "joint_coupling",
        "wrist coupling",
        "wrist_bend",
        [0.005, 0.015],
        "deg/deg",
        "driver: wrist_roll, deg_per_deg: SIZE",
    ),
    hide("joint_gain", "wrong gear ratio", "shoulder", [0.002, 0.006], "deg/deg", "deg_per_deg: SIZE"),
    hide("link_offset", "link beside its place", "shoulder", [0.5, 1.5], "mm", "mm: SIZE"),
    hide("joint_backlash", "play", "wrist_roll", [0.2, 0.4], "deg", PLAY),
    hide("axis_skew", "axes not parallel", "elbow", [0.1, 0.3], "deg", "deg: SIZE"),
    hide("joint_harmonic", "wheel out of true", "waist", [0.12, 0.28], "deg", WHEEL_TWICE),
    hide("joint_backlash", "play", "wrist_bend", [0.2, 0.4], "deg", PLAY),
    hide(
        "joint_coupling",
        "wrist coupling",
        "flange",
        [0.01, 0.03],
        "deg/deg",
        "driver: wrist_roll, deg_per_deg: SIZE",
    ),
    hide(
        "joint_stiffening",
        "gives way less and less",
        "elbow",
        [2e-4, 4e-4],
        "rad/(N m)",
        "rad_per_nm: SIZE, knee_nm: 8",
    ),
    hide("joint_gain", "wrong gear ratio", "elbow", [0.002, 0.006], "deg/deg", "deg_per_deg: SIZE"),
    hide("link_length", "link too long", "elbow", [0.5, 1.5], "mm", "mm: SIZE"),
    hide("joint_backlash", "play", "flange", [0.4, 0.8], "deg", PLAY),
    hide("link_twist", "axes at a wrong angle", "elbow", [0.1, 0.3], "deg", "deg: SIZE"),
    hide("joint_harmonic", "wheel out of true", "shoulder", [0.12, 0.28], "deg", WHEEL_TWICE),
    hide("joint_compliance", "gives way", "wrist_bend", [6e-4, 1.5e-3], "rad/(N m)", SOFT),
    hide("link_offset", "link beside its place", "wrist_roll", [0.5, 1.5], "mm", "mm: SIZE"),
    hide("joint_harmonic", "wheel out of true", "elbow", [0.12, 0.28], "deg", WHEEL_TWICE),
    hide("joint_gain", "wrong gear ratio", "wrist_bend", [0.008, 0.02], "deg/deg", "deg_per_deg: SIZE"),
    hide("link_twist", "axes at a wrong angle", "wrist_roll", [0.2, 0.5], "deg", "deg: SIZE"),
    hide("joint_harmonic", "wheel out of true", "wrist_bend", [0.3, 0.6], "deg", WHEEL),
    hide("joint_gain", "wrong gear ratio", "wrist_roll", [0.008, 0.02], "deg/deg", "deg_per_deg: SIZE"),
    hide("joint_harmonic", "wheel out of true", "wrist_roll", [0.3, 0.6], "deg", WHEEL),
];

/// Sites that no measurement of this arm can distinguish: the axes of shoulder and elbow are parallel, so a shift along the one is a shift along the other.
const SAME: [(&str, &str, &str); 1] = [("link_offset", "shoulder", "elbow")];

/// What world `number` of those from `first` hides, and its seed.
fn draw(number: u64, first: u64) -> (Drawn, u64) {
    let seed = first + number;
    let index = &EFFECTS[(number % EFFECTS.len() as u64) as usize];
    // Splitmix64, so that neighbouring seeds have nothing in common.
    let mut bits = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    let fraction = ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64;
    let size = index.least + (index.most - index.least) * fraction;
    let (size, phase) = (format!("{size:.3e}"), (seed * 77) % 360);
    let entry = index.entry.replace("SIZE", &size).replace("PHASE", &phase.to_string());
    let drawn = Drawn {
        effect: index.effect,
        site: index.joint.to_owned(),
        size: format!("{size} {}", index.unit),
        words: index.words,
        imperfection: format!("{{{}: {{joint: {}, {entry}}}}}", index.effect, index.joint),
    };
    (drawn, seed)
}

/// What was made of a world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    /// What is hidden was named, and nothing else.
    Named,
    /// It is among those that were said to be tied.
    Tied,
    /// Something else was named, or more.
    Wrong,
    /// Nothing was named.
    Nothing,
}

fn verdict(story: &Story) -> Verdict {
    let Drawn { effect, site, .. } = &story.drawn;
    let is_truth = |named: &str, at: &str| {
        let same = |(kind, one, other): &(&str, &str, &str)| {
            kind == effect && (one == site && *other == at || other == site && *one == at)
        };
        named == *effect && (at == site || SAME.iter().any(same))
    };
    let found = &story.with_tracker;
    match found.added.as_slice() {
        [(named, at, _)] if is_truth(named, at) => Verdict::Named,
        added => {
            let last = found.verdicts.last().map(String::as_str).unwrap_or_default();
            let truth = format!("{effect}({site}");
            if (last.starts_with("tied") || last.starts_with("located")) && last.contains(&truth) {
                Verdict::Tied
            } else if added.is_empty() {
                Verdict::Nothing
            } else {
                Verdict::Wrong
            }
        }
    }
}

/// What came out for all worlds.
#[derive(Debug, Default)]
pub(crate) struct Figures {
    rows: Vec<(&'static str, [usize; 5])>,
    worlds: usize,
    right: usize,
    at_floor: usize,
    others: Vec<String>,
}

/// Lives through so many worlds, each hiding the next effect in turn.
pub(crate) fn live_through(count: u64, first: u64, mut progress: impl FnMut(&Story, &str)) -> Figures {
    let mut figures = Figures::default();
    for number in 0..count {
        let (drawn, seed) = draw(number, first);
        let story = run_short_story(drawn, seed);
        let verdict = verdict(&story);
        progress(&story, &format!("{verdict:?}"));
        figures.add(&story, verdict);
    }
    figures
}

impl Figures {
    fn add(&mut self, story: &Story, verdict: Verdict) {
        let at_floor = story.with_tracker.left.tip_mm < AT_FLOOR * FLOOR_MM;
        let effect = story.drawn.effect;
        if !self.rows.iter().any(|(known, _)| *known == effect) {
            self.rows.push((effect, [0; 5]));
        }
        if let Some((_, counts)) = self.rows.iter_mut().find(|(known, _)| *known == effect) {
            let column = match verdict {
                Verdict::Named => 1,
                Verdict::Tied => 2,
                Verdict::Wrong | Verdict::Nothing => 3,
            };
            for (index, count) in counts.iter_mut().enumerate() {
                *count += usize::from(index == 0 || index == column || index == 4 && at_floor);
            }
        }
        self.worlds += 1;
        let right = matches!(verdict, Verdict::Named | Verdict::Tied);
        self.right += usize::from(right);
        self.at_floor += usize::from(at_floor);
        if !right || !at_floor {
            self.others.push(format!("{story} {verdict:?}; {:?}", story.with_tracker.verdicts));
        }
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            formatter,
            "| hidden | worlds | named, alone | tied with another | else | tip at the floor |"
        )?;
        writeln!(formatter, "|---|---|---|---|---|---|")?;
        for (effect, [worlds, named, tied, other, floor]) in &self.rows {
            writeln!(formatter, "| {effect} | {worlds} | {named} | {tied} | {other} | {floor} |")?;
        }
        let Self { worlds, right, at_floor, .. } = self;
        writeln!(
            formatter,
            "\nRight: {right} of {worlds}. Tip at the floor ({AT_FLOOR} x {FLOOR_MM} mm): {at_floor} of {worlds}."
        )?;
        for other in &self.others {
            writeln!(formatter, "{other}")?;
        }
        Ok(())
    }
}
