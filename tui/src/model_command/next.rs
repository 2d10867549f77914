//! `plumb model next`.

use std::error::Error;

use plumb_model::diagnosis::{NextPoses, Wanted};

use super::arguments::NextArguments;
use super::progress::watched;

/// Chooses poses, prints them.
pub(super) fn run(arguments: &NextArguments) -> Result<String, Box<dyn Error>> {
    let opened = arguments.pair.open()?;
    let wanted = Wanted {
        count: usize::from(arguments.number),
        keep_out: arguments.keep_out.clone(),
        payloads: arguments.payload.clone(),
    };
    let poses = watched(|progress| opened.laboratory.next_poses(&wanted, progress))?;
    if arguments.pair.json {
        return Ok(super::json(&poses)?);
    }
    let names: Vec<&str> =
        opened.laboratory.model().chain.joints.iter().map(|joint| joint.name.as_str()).collect();
    Ok(tell(&poses, &names))
}

fn tell(poses: &NextPoses, joints: &[&str]) -> String {
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
                1 => " from +",
                -1 => " from -",
                _ => "",
            };
            text.push_str(&format!(" {:>11}", format!("{q:.1}{side}")));
        }
        if loaded {
            text.push_str(&format!("  load {} kg", pose.payload_kg));
        }
        if let Some(wait) = pose.predicted.get("after_waiting_s").and_then(serde_json::Value::as_f64) {
            text.push_str(&format!("  after waiting {:.0} min", wait / 60.0));
        }
        text.push('\n');
    }
    format!("{text}\n{}\n", poses.sentence)
}
