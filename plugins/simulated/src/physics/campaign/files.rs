//! A case as files: the table, the model as the user would hold it, and answers in the open where they are wanted.

use std::fmt::Write as _;

use crate::physics::description::{ArmDescription, Convention, Joint};

use super::case::Case;
use super::instrument::{DISTANCE_POINT, TABLE_HEIGHT, turn_of};
use super::nuisance::{frees_base, frees_target};
use super::specification::{Free, Reading};
use super::touch;

impl Case {
    /// The measurement table, CSV in the lab's format.
    pub fn table_csv(&self) -> String {
        let joints = self.specification.arm.joints.len();
        let mut header: Vec<String> = (1..=joints).map(|joint| format!("q{joint}_deg")).collect();
        header.extend((1..=joints).map(|joint| format!("approach_q{joint}")));
        header.extend(["payload_kg", "temperature_c", "time_s", "repeat"].map(str::to_owned));
        header.extend(self.specification.reading.columns().iter().map(|name| (*name).to_owned()));
        let mut text = header.join(",");
        text.push('\n');
        for row in 0..self.visits.len() {
            text.push_str(&self.table_row(row));
        }
        text
    }

    /// One row of the table, from 0, with its line end.
    pub fn table_row(&self, row: usize) -> String {
        let (Some(visit), Some(reading)) = (self.visits.get(row), self.readings.get(row)) else {
            return String::new();
        };
        let mut cells: Vec<String> = visit.commanded_deg.iter().map(|angle| format!("{angle:.3}")).collect();
        cells.extend(visit.sides.iter().map(|side| format!("{side:.0}")));
        cells.push(format!("{}", visit.payload_kg));
        cells.push(format!("{:.2}", visit.temperature_c));
        cells.push(format!("{:.0}", visit.time_s));
        cells.push(visit.repeat.map_or_else(String::new, |number| format!("r{number}")));
        match visit.touch {
            Some(socket) => cells.push(socket_name(socket)),
            None if self.specification.reading == Reading::Pose => {
                cells.extend(reading.iter().take(3).map(|value| format!("{value:.4}")));
                let turn = turn_of(reading).map_or([f64::NAN; 3], <[f64; 3]>::from);
                cells.extend(
                    turn.map(|value| if value.is_finite() { format!("{value:.7}") } else { String::new() }),
                );
            }
            None => cells.extend(reading.iter().map(|value| format!("{value:.4}"))),
        }
        cells.extend(self.specification.reading.against().map(str::to_owned));
        cells.join(",") + "\n"
    }

    /// The model file: the arm on paper, and what the user leaves free.
    pub fn model_yaml(&self) -> String {
        let specification = &self.specification;
        let (base, target) = (frees_base(specification), frees_target(specification));
        let mut text =
            model_yaml(&specification.arm, specification.free, base, target, specification.reading);
        if specification.reading == Reading::Touch
            && let [first, second, ..] = touch::sockets(specification, self.truth.seed)[..]
        {
            let (one, other) = (socket_name(0), socket_name(1));
            let apart = plain((first - second).norm());
            let _ =
                writeln!(text, "touch: {{p: p1, distances: [{{between: [{one}, {other}], mm: {apart}}}]}}");
        }
        text
    }
}

fn socket_name(socket: usize) -> String {
    format!("s{}", socket + 1)
}

/// Writes an arm as a model file.
fn model_yaml(
    arm: &ArmDescription,
    free: Free,
    base_free: bool,
    target_free: bool,
    reading: Reading,
) -> String {
    let convention = if arm.convention == Convention::Distal { "distal" } else { "proximal" };
    let mut text = format!("arm: {}\nconvention: {convention}\njoints:\n", arm.name);
    text.extend(arm.joints.iter().map(row_yaml));
    if !arm.weights.is_empty() {
        text.push_str("links:\n");
    }
    for weight in &arm.weights {
        let centre = <[f64; 3]>::from(weight.centre).map(plain).join(", ");
        let after = arm.joint_name(weight.after);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  - {{after: {after}, mass_kg: {}, centre_mm: [{centre}]}}", weight.mass);
    }
    let xyz = <[f64; 3]>::from(arm.base_position).map(plain).join(", ");
    let rpy = arm.base_orientation.map(|angle| plain(angle.to_degrees())).join(", ");
    let target = <[f64; 3]>::from(arm.target).map(plain).join(", ");
    let _ = writeln!(text, "base: {{xyz_mm: [{xyz}], rpy_deg: [{rpy}], free: {base_free}}}");
    let _ = writeln!(text, "targets: {{p1: {{xyz_mm: [{target}], free: {target_free}}}}}");
    let free = match free {
        Free::None => "",
        Free::Zeros => "joint_zero(*)",
        Free::Geometry => "joint_zero(*), geometry(*)",
    };
    let _ = writeln!(text, "free: [{free}]\neffects: []");
    text.push_str(&reading_yaml(arm, reading));
    text.push_str("measured_from: world\n");
    text
}

/// One joint's line of a model file.
fn row_yaml(joint: &Joint) -> String {
    let [low, high] = joint.limits.map(|limit| plain(limit.to_degrees()));
    let mut text = format!(
        "  - {{name: {}, a_mm: {}, alpha_deg: {}, d_mm: {}, theta_deg: {}, limits_deg: [{low}, {high}]",
        joint.name,
        plain(joint.length),
        plain(joint.twist.to_degrees()),
        plain(joint.offset),
        plain(joint.rest_angle.to_degrees()),
    );
    if joint.sign < 0.0 {
        text.push_str(", sign: -1");
    }
    if let Some(ratio) = joint.gear_ratio {
        let _ = write!(text, ", gear_ratio: {ratio}");
    }
    text.push_str("}\n");
    text
}

/// What a model file says of what is read, where that is not the target's position.
fn reading_yaml(arm: &ArmDescription, reading: Reading) -> String {
    match reading {
        Reading::Position | Reading::Pose | Reading::Touch => String::new(),
        Reading::Height => format!(
            "surfaces:\n  table: {{plane: {{normal: [0, 0, 1], offset_mm: {}}}, free: false}}\n",
            plain(TABLE_HEIGHT)
        ),
        Reading::Distance => {
            let point = <[f64; 3]>::from(DISTANCE_POINT).map(plain).join(", ");
            format!("surfaces:\n  post: {{point_mm: [{point}], free: false}}\n")
        }
        Reading::Tilt => {
            format!("level: {{after: {}}}\n", arm.joint_name(arm.joints.len().saturating_sub(1)))
        }
    }
}

/// A number without the tail that turning degrees into radians and back leaves.
fn plain(value: f64) -> String {
    let rounded = (value * 1e9).round() / 1e9;
    format!("{}", if rounded == 0.0 { 0.0 } else { rounded })
}
