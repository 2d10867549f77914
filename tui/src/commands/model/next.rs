//! `plumb model next`.

use std::error::Error;

use plumb_calibration::arm_model::Model;
use plumb_calibration::table::Table;
use plumb_diagnosis::{NextPose, NextPoses, Requested};
use plumb_kinematics::Motion;
use plumb_report::{json, next_poses_sentence};

use super::arguments::NextArguments;
use crate::progress::watched;

/// Chooses poses, prints them.
pub(super) fn run(arguments: &NextArguments) -> Result<String, Box<dyn Error>> {
    let opened = arguments.pair.open()?;
    let requested = Requested {
        count: usize::from(arguments.number),
        keep_out: arguments.keep_out.clone(),
        payloads: arguments.payload.clone(),
    };
    let poses = watched(|progress| opened.laboratory.next_poses(&requested, progress))?;
    if arguments.pair.json {
        return Ok(super::json(&json::next_poses(&poses)?)?);
    }
    if arguments.csv {
        return Ok(as_table(&poses, opened.laboratory.table(), opened.laboratory.model()));
    }
    let names: Vec<&str> =
        opened.laboratory.model().chain.joints.iter().map(|joint| joint.name.as_str()).collect();
    Ok(describe(&poses, &names))
}

/// A line a pose: joints, the side each is to arrive from (1 moving up, -1 moving down, 0 no matter), load, and a number that all returns to one pose share, none of which the data has; 0 for a pose without returns.
pub(crate) fn as_table(poses: &NextPoses, data: &Table, model: &Model) -> String {
    let numbers = data.repeat.names.iter().filter_map(|name| name.parse::<f64>().ok());
    let mut newest = numbers.fold(0.0, f64::max).max(data.repeat.names.len() as f64);
    let mut text = String::new();
    let joints = poses.next.first().map_or(0, |pose| pose.q_deg.len());
    let slides =
        |joint: usize| model.chain.joints.get(joint).is_some_and(|joint| joint.motion == Motion::Slides);
    let unit = |joint: usize| if slides(joint) { "mm" } else { "deg" };
    (0..joints).for_each(|joint| text.push_str(&format!("q{}_{},", joint + 1, unit(joint))));
    (1..=joints).for_each(|joint| text.push_str(&format!("approach_q{joint},")));
    text.push_str("payload_kg,repeat\n");
    let mut returns: Vec<(&[f64], f64, f64)> = Vec::new();
    for pose in &poses.next {
        let same = |other: &&NextPose| other.q_deg == pose.q_deg && other.payload_kg == pose.payload_kg;
        let known = returns.iter().find(|(q, load, _)| *q == pose.q_deg && *load == pose.payload_kg);
        let number = match known {
            Some((.., number)) => *number,
            None if poses.next.iter().filter(same).count() > 1 => {
                newest += 1.0;
                returns.push((&pose.q_deg, pose.payload_kg, newest));
                newest
            }
            None => 0.0,
        };
        pose.q_deg.iter().for_each(|q| text.push_str(&format!("{q},")));
        let side = |joint| pose.approach.get(joint).copied().unwrap_or(0);
        (0..joints).for_each(|joint| text.push_str(&format!("{},", side(joint))));
        text.push_str(&format!("{},{number}\n", pose.payload_kg));
    }
    text
}

pub(crate) fn describe(poses: &NextPoses, joints: &[&str]) -> String {
    let mut text = format!("{:>3}", "");
    for joint in joints {
        text.push_str(&format!(" {joint:>11}"));
    }
    text.push('\n');
    let loaded = poses.next.iter().any(|pose| pose.payload_kg != 0.0);
    for (index, pose) in poses.next.iter().enumerate() {
        text.push_str(&format!("{:>3}", index + 1));
        for (q, side) in pose.q_deg.iter().zip(&pose.approach) {
            let side = match side {
                1 => " up",
                -1 => " down",
                _ => "",
            };
            text.push_str(&format!(" {:>11}", format!("{q:.1}{side}")));
        }
        if loaded {
            text.push_str(&format!("  load {} kg", pose.payload_kg));
        }
        if let Some(surface) = &pose.on {
            text.push_str(&format!("  where the sensor triggers over {surface}"));
        }
        if let Some(wait) = pose.predicted.get("after_waiting_s").and_then(serde_json::Value::as_f64) {
            text.push_str(&format!("  after waiting {:.0} min", wait / 60.0));
        }
        text.push('\n');
    }
    if poses.next.iter().any(|pose| pose.approach.iter().any(|side| *side != 0)) {
        text.push_str("up, down: arrive so that the joint's coordinate grows, or falls: 1 and -1 under `approach_...` in the table\n");
    }
    format!("{text}\n{}\n", next_poses_sentence(poses))
}
