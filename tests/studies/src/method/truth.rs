//! What is true after a run, as only a simulated world can report: how far the zeros that were found are off, and how far the hand.

use std::collections::BTreeMap;

use plumb_cell::workcell::Workcell;
use plumb_kinematics::LinkFrames;
use plumb_record::AppliedCorrection;
use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::{TruthReport, WorldCommand};

use super::StudyError;
use plumb::commands::study::study_file::Quantity;

/// How far out of the check pose the arm first goes, so that it comes to it from the side from which the searches came, rad.
const FROM_OUTSIDE: f64 = 0.07;

/// Speed of the way there: slow enough for every motor.
const SPEED: f64 = 0.3;

/// Joints whose zeros an initialization finds.
const INITIALIZED: [&str; 3] = ["waist", "shoulder", "elbow"];

/// How far a run left the arm from the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Missed {
    /// True angle less the corrected one, deg: waist, shoulder, elbow.
    pub(super) zeros_deg: [f64; 3],
    /// The standard uncertainties the run states of these zeros, deg; none where it says "not determined".
    pub(super) stated_deg: [Option<f64>; 3],
    /// Where the hand truly is less where the corrected model has it, mm: away from the waist's axis, across, upward.
    pub(super) hand_mm: [f64; 3],
}

impl Missed {
    pub(super) fn of(&self, quantity: Quantity) -> f64 {
        let [waist, shoulder, elbow] = self.zeros_deg;
        let [radial, across, height] = self.hand_mm;
        match quantity {
            Quantity::WaistDeg => waist,
            Quantity::ShoulderDeg => shoulder,
            Quantity::ElbowDeg => elbow,
            Quantity::RadialMm => radial,
            Quantity::AcrossMm => across,
            Quantity::HeightMm => height,
            Quantity::HandMm => (radial.powi(2) + across.powi(2) + height.powi(2)).sqrt(),
        }
    }
}

/// Takes the error in the world, at a pose (the cell's units) the arm is sent to by its corrected angles.
pub(super) fn take(
    world: &mut WorldClient,
    cell: &Workcell,
    corrections: &[AppliedCorrection],
    pose: &BTreeMap<String, f64>,
) -> Result<Missed, StudyError> {
    let joints: Vec<String> = world.welcome().joints.iter().map(|joint| joint.name.clone()).collect();
    let zeros: Vec<f64> = joints.iter().map(|joint| zero_of(corrections, joint)).collect();
    let mut outside = [None; 6];
    let mut there = [None; 6];
    for (index, joint) in joints.iter().enumerate().take(6) {
        if let Some(angle) = pose.get(joint) {
            let position = angle.to_radians() - zeros.get(index).copied().unwrap_or(0.0);
            there[index] = Some(position);
            outside[index] = Some(position + FROM_OUTSIDE);
        }
    }
    for joints in [outside, there] {
        world.read(WorldCommand::Move { joints: joints.into(), relative: false, speed: SPEED })?;
    }
    let truth = world.look()?;
    let corrected: Vec<f64> =
        truth.counted.iter().zip(&zeros).map(|(counted, zero)| counted + zero).collect();
    let zeros_deg = INITIALIZED.map(|name| {
        let index = joints.iter().position(|joint| joint == name).unwrap_or(0);
        let believed = corrected.get(index).copied().unwrap_or(0.0);
        (truth.attitudes.get(index).copied().unwrap_or(0.0) - believed).to_degrees()
    });
    let stated_deg = INITIALIZED.map(|joint| stated(corrections, joint));
    Ok(Missed { zeros_deg, stated_deg, hand_mm: hand_missed(cell, &truth, &joints, &corrected)? })
}

fn stated(corrections: &[AppliedCorrection], joint: &str) -> Option<f64> {
    corrections.iter().find(|one| one.key.quantity == "joint_zero" && one.key.site == joint)?.uncertainty
}

fn zero_of(corrections: &[AppliedCorrection], joint: &str) -> f64 {
    let found = corrections.iter().find(|one| one.key.quantity == "joint_zero" && one.key.site == joint);
    found.map_or(0.0, |one| if one.unit == "deg" { one.value.to_radians() } else { one.value })
}

fn hand_missed(
    cell: &Workcell,
    truth: &TruthReport,
    joints: &[String],
    corrected: &[f64],
) -> Result<[f64; 3], StudyError> {
    let no_model = || {
        StudyError::Cell(
            "the cell's robot needs a `model` for its hand to be compared with the truth".to_owned(),
        )
    };
    let robot = cell.robots.first().ok_or_else(no_model)?;
    let model = robot.model.as_ref().ok_or_else(no_model)?;
    let in_order = robot.joints.iter().map(|(name, _)| {
        let index = joints.iter().position(|joint| joint == name);
        index.and_then(|index| corrected.get(index)).copied().unwrap_or(0.0)
    });
    let drive: Vec<f64> = in_order.collect();
    let believed = LinkFrames::of(model.chain(), &model.model_joints(&drive), &[]).flange.translation.vector;
    let [x, y, z] = truth.sensor_mm;
    let (sine, cosine) = truth.attitudes.first().copied().unwrap_or(0.0).sin_cos();
    let (dx, dy) = (x - believed.x, y - believed.y);
    Ok([dx * cosine + dy * sine, dy * cosine - dx * sine, z - believed.z])
}
