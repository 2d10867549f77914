//! Headers that are written otherwise: the model's own names of its joints, names that are said to mean others, and what may have been meant
//! by a header that is none of these.

use std::str::FromStr;

/// How the headers of a table are to be read.
#[derive(Debug, Clone, Default)]
pub struct Naming {
    /// The model's joints in their order: `shoulder_deg` means `q2_deg` where the second is called so.
    pub joints: Vec<String>,
    /// Headers that mean others.
    pub renamed: Vec<Rename>,
}

/// A header that means another, written `OLD=NEW`; a column without a new name is left aside.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rename {
    /// As the file has it.
    pub old: String,
    /// As it is read.
    pub new: String,
}

impl FromStr for Rename {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (old, new) =
            text.split_once('=').ok_or("write OLD=NEW, as in J1=q1_deg; OLD= leaves a column out")?;
        let (old, new) = (old.trim().to_owned(), new.trim().to_owned());
        if old.is_empty() {
            return Err("the old name is missing before the `=`".to_owned());
        }
        Ok(Self { old, new })
    }
}

impl Naming {
    /// What a header is read as.
    pub(super) fn canonical(&self, header: &str) -> String {
        // What the user says goes before what a name looks like.
        if let Some(rename) = self.renamed.iter().find(|rename| rename.old == header) {
            return self.of_joint(&rename.new).unwrap_or_else(|| rename.new.clone());
        }
        self.of_joint(header).unwrap_or_else(|| header.to_owned())
    }

    /// `shoulder_deg` as `q2_deg`, `approach_shoulder` as `approach_q2`, and `shoulder` alone as `q2`, whose unit is missing.
    fn of_joint(&self, header: &str) -> Option<String> {
        self.joints.iter().enumerate().find_map(|(index, joint)| {
            let number = index + 1;
            if let Some(rest) = header.strip_prefix(joint.as_str()) {
                let is_unit = rest.strip_prefix('_').is_some_and(|unit| UNITS.contains(&unit));
                return (rest.is_empty() || is_unit).then(|| format!("q{number}{rest}"));
            }
            let approached = header.strip_prefix("approach_")?;
            (approached == joint).then(|| format!("approach_q{number}"))
        })
    }

    /// A rename of a column that is not there, with the columns there are.
    pub(super) fn missing<'a>(&self, headers: impl Iterator<Item = &'a str> + Clone) -> Option<String> {
        let lost = self.renamed.iter().find(|rename| !headers.clone().any(|header| header == rename.old))?;
        let near = plumb_document::did_you_mean(&lost.old, headers.filter(|header| !header.is_empty()));
        Some(format!("there is no column `{}` to read as `{}`; {near}", lost.old, lost.new))
    }
}

/// Units that the header of a joint can end in.
const UNITS: [&str; 5] = ["deg", "rad", "mm", "m", "in"];

/// The ends of headers that say how something is turned: quaternions, rotation vectors, angles about axes.
const ORIENTATIONS: [&str; 17] = [
    "qw", "qx", "qy", "qz", "quat_w", "quat_x", "quat_y", "quat_z", "rx", "ry", "rz", "roll", "pitch", "yaw",
    "rotx", "roty", "rotz",
];

/// Why a column that says how something is turned is refused, where it does not say so in one of the ways that are read.
pub(super) fn refused_orientation(header: &str) -> Option<String> {
    let lower = header.to_lowercase();
    let (name, unit) = split_unit(&lower);
    let numbered = name.split_once('_').filter(|(body, _)| {
        ["board", "flange"].contains(body)
            || body.strip_prefix('p').is_some_and(|number| number.parse::<u32>().is_ok())
    });
    let (body, what) = numbered.unwrap_or(("p1", name));
    let is_angle = unit.is_none_or(|unit| unit == "deg" || unit == "rad");
    // What is read, or lacks its unit, is reported by what reads headers.
    let is_read = header == lower && numbered.is_some() && READ.contains(&what);
    if !is_angle || !ORIENTATIONS.contains(&what) || is_read {
        return None;
    }
    let part = what.trim_start_matches("quat_").trim_start_matches('q');
    let read_as = match what {
        "rx" | "ry" | "rz" => format!("{body}_{what}_{}", unit.unwrap_or("rad")),
        _ if what.starts_with('q') => format!("{body}_q{part}"),
        _ => {
            return Some(format!(
                "angles about axes do not say in which order they turn: give the orientation as a unit quaternion ({body}_qw, {body}_qx, {body}_qy, {body}_qz) or \
                 as a rotation vector ({body}_rx_rad, {body}_ry_rad, {body}_rz_rad); --columns {header}= leaves the column out, --columns {header}=note_{header} \
                 keeps it to test the residuals against"
            ));
        }
    };
    Some(format!(
        "orientations are called {body}_qw, {body}_qx, {body}_qy, {body}_qz (a unit quaternion) or {body}_rx_rad, {body}_ry_rad, {body}_rz_rad (a rotation vector); \
         if that is what it is: --columns {header}={read_as}; --columns {header}= leaves the column out"
    ))
}

/// The ends of headers by which orientations are read.
const READ: [&str; 7] = ["qw", "qx", "qy", "qz", "rx", "ry", "rz"];

/// A header without its unit: `x [mm]`, `q1 (deg)`, `x.mm`, `x_mm`.
fn split_unit(header: &str) -> (&str, Option<&str>) {
    let trimmed = header.trim().trim_end_matches([']', ')']);
    match trimmed.rsplit_once(['[', '(', '_', '.', ' ']) {
        Some((name, unit)) if UNITS.contains(&unit.trim()) => {
            (name.trim_end_matches(['_', ' ', '.']), Some(unit.trim()))
        }
        _ => (header.trim(), None),
    }
}

/// A number after one of some words, as in `joint_3`.
fn after<'a>(text: &'a str, words: &[&str]) -> Option<&'a str> {
    let rest = words.iter().find_map(|word| text.strip_prefix(word))?;
    let number = rest.trim_start_matches(['_', ' ', '.']);
    (!number.is_empty() && number.len() <= 2 && number.bytes().all(|byte| byte.is_ascii_digit()))
        .then_some(number)
}

/// The header that may be meant by one that is not known: `J1` is likely `q1_deg`, `X [mm]` is likely `p1_x_mm`. The unit is a guess where none is
/// given.
pub(super) fn likely(header: &str) -> Option<String> {
    let lower = header.to_lowercase();
    let (name, unit) = split_unit(&lower);
    if let Some(number) = after(name, &["joint", "axis", "theta", "j", "a", "q"]) {
        return Some(format!("q{}_{}", number.trim_start_matches('0'), unit.unwrap_or("deg")));
    }
    let rest = name
        .trim_start_matches("pos")
        .trim_start_matches("tcp")
        .trim_start_matches(['p', 't', '_', ' ', '1', '.']);
    let axis = ["x", "y", "z"].into_iter().find(|axis| *axis == rest)?;
    let unit = unit.filter(|unit| ["mm", "m", "in"].contains(unit)).unwrap_or("mm");
    Some(format!("p1_{axis}_{unit}"))
}

/// The option that would read these headers, where their names suggest what they are.
pub(crate) fn suggestion<'a>(headers: impl Iterator<Item = &'a str>) -> Option<String> {
    let likely: Vec<String> = headers
        .filter_map(|header| Some((header, likely(header)?)))
        .filter(|(header, meant)| header != meant)
        .map(|(header, meant)| format!("{header}={meant}"))
        .collect();
    let option = likely.join(",");
    let quoted = if option.contains([' ', '(', '[']) { format!("'{option}'") } else { option };
    (!likely.is_empty())
        .then(|| format!("if these are what their names suggest, in these units: --columns {quoted}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_are_known_by_the_models_names() {
        let naming =
            Naming { joints: vec!["waist".into(), "arm".into(), "arm_2".into()], renamed: Vec::new() };
        let read = |header: &str| naming.canonical(header);
        assert_eq!(read("waist_deg"), "q1_deg");
        assert_eq!(read("arm_2_mm"), "q3_mm", "a name that begins with another joint's");
        assert_eq!(read("approach_arm"), "approach_q2");
        assert_eq!(read("arm"), "q2");
        assert_eq!(read("waist_current"), "waist_current", "a covariate");
    }

    #[test]
    fn a_rename_may_lead_to_a_joints_name_and_an_empty_one_leaves_the_column_out() {
        let renamed = ["S=waist_deg", "note ="].map(|text| text.parse::<Rename>().unwrap()).to_vec();
        let naming = Naming { joints: vec!["waist".into()], renamed };
        assert_eq!((naming.canonical("S").as_str(), naming.canonical("note").as_str()), ("q1_deg", ""));
        assert!("=q1_deg".parse::<Rename>().is_err() && "J1".parse::<Rename>().is_err());
        let lost = naming.missing(["s", "note"].into_iter()).unwrap();
        assert!(lost.starts_with("there is no column `S` to read as `waist_deg`; "), "{lost}");
    }

    #[test]
    fn usual_headers_are_recognized() {
        for (header, meant) in [
            ("J1", "q1_deg"),
            ("joint_02", "q2_deg"),
            ("q1 (deg)", "q1_deg"),
            ("A3 [rad]", "q3_rad"),
            ("X", "p1_x_mm"),
            ("y_m", "p1_y_m"),
            ("pos_z [mm]", "p1_z_mm"),
            ("p1x", "p1_x_mm"),
        ] {
            assert_eq!(likely(header).as_deref(), Some(meant), "{header}");
        }
        for header in ["humidity", "time", "note", "x_current", "jog"] {
            assert_eq!(likely(header), None, "{header}");
        }
    }

    #[test]
    fn orientations_under_other_names_are_refused_with_their_right_names() {
        for (header, read_as) in [
            ("qx", "--columns qx=p1_qx;"),
            ("p2_quat_w", "--columns p2_quat_w=p2_qw;"),
            ("RX", "--columns RX=p1_rx_rad;"),
            ("rz_deg", "--columns rz_deg=p1_rz_deg;"),
            ("yaw", "--columns yaw= leaves"),
            ("Roll_rad", "in which order they turn"),
            ("p1_pitch (deg)", "p1_qw, p1_qx"),
            ("board_yaw_deg", "board_rx_rad"),
        ] {
            let reason = refused_orientation(header).unwrap_or_default();
            assert!(reason.contains(read_as), "{header}: {reason}");
        }
        for header in
            ["p1_qw", "p2_rx_deg", "p1_rx", "q1_deg", "p1_x_mm", "rz_mm", "wrist_roll_deg", "quality"]
        {
            assert_eq!(refused_orientation(header), None, "{header}");
        }
    }
}
