//! Pose accuracy and repeatability of manipulating industrial robots: ISO 9283:1998, clauses 7.2.1 (accuracy `AP`), 7.2.2 (repeatability `RP`), 7.2.3
//! (variation of accuracy with the direction of approach, `vAP`) and 7.6 (drift, of positions). Orientations are in `orientation.rs`.

use nalgebra::{Rotation3, Vector3};
use serde::Serialize;

use crate::orientation::{self, GreatestOrientation, OrientationAtPose};
use crate::pose_run::{CommandedFrom, PoseRun, PoseVisits, Visit};

/// The figures of one pose, reached by one way.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AtPose {
    /// The pose.
    pub pose: String,
    /// Side from which each joint arrived; nothing where that was not logged.
    pub sides: Option<Vec<i8>>,
    /// Visits, `n`.
    pub visits: usize,
    /// Mean of what was reached, mm.
    pub barycentre_mm: [f64; 3],
    /// Pose accuracy `AP_P`: from the commanded position to the barycentre, mm.
    #[serde(rename = "AP_mm")]
    pub accuracy: Option<f64>,
    /// Its parts along x, y and z, mm.
    #[serde(rename = "AP_xyz_mm")]
    pub accuracy_parts: Option<[f64; 3]>,
    /// Mean distance from the barycentre, mm.
    pub l_mean_mm: f64,
    /// Standard deviation of these distances, mm, with `n - 1` degrees of freedom.
    pub s_l_mm: f64,
    /// Pose repeatability `RP_l = l_mean + 3 S_l`, mm: the radius of a ball about the barycentre.
    #[serde(rename = "RP_mm")]
    pub repeatability: f64,
    /// Of its orientation; nothing where none was read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orientation: Option<OrientationAtPose>,
    /// Drift over the run; nothing without times or with too few visits.
    pub drift: Option<Drift>,
}

/// How figures change over a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Drift {
    /// Greatest change of the pose accuracy against the first measurement, mm; nothing where the commanded position is not known.
    #[serde(rename = "dAP_mm")]
    pub accuracy: Option<f64>,
    /// Greatest change of the pose repeatability, mm.
    #[serde(rename = "dRP_mm")]
    pub repeatability: f64,
    /// From the first visit to the last, s.
    pub over_s: f64,
    /// Measurements of so many visits each that were compared.
    pub measurements: usize,
}

/// How far apart a pose is reached by different ways.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SideVariation {
    /// The pose.
    pub pose: String,
    /// Ways by which it was reached.
    pub ways: usize,
    /// Greatest distance between their barycentres, mm.
    #[serde(rename = "vAP_mm")]
    pub variation: f64,
}

/// A report after ISO 9283.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Iso9283 {
    /// Which standard.
    pub standard: &'static str,
    /// The target that was read.
    pub target: String,
    /// Where the commanded positions are from.
    pub commanded: CommandedFrom,
    /// Greatest accuracy figure of all poses, mm.
    #[serde(rename = "AP_mm")]
    pub accuracy: Option<f64>,
    /// Greatest repeatability figure of all poses, mm.
    #[serde(rename = "RP_mm")]
    pub repeatability: f64,
    /// Greatest variation with the way of approach, mm.
    #[serde(rename = "vAP_mm")]
    pub variation: Option<f64>,
    /// Greatest figures of the orientation; nothing where none was read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orientation: Option<GreatestOrientation>,
    /// Pose by pose.
    pub at: Vec<AtPose>,
    /// Poses that were reached by several ways.
    pub variations: Vec<SideVariation>,
    /// Where the run is not what the standard asks for, and what else to know.
    pub notes: Vec<String>,
}

/// Cycles that the standard asks for (clause 7.2).
const CYCLES: usize = 30;

/// Poses that the standard asks for (clause 6.8).
const POSES: usize = 5;

/// Visits that make one measurement of a drift (clause 7.6: ten cycles at a time).
const DRIFT_VISITS: usize = 10;

/// The figures of a run.
pub fn iso_9283(run: &PoseRun) -> Iso9283 {
    let at: Vec<AtPose> = run.poses.iter().map(at_pose).collect();
    let variations = variations(&at);
    let greatest = |values: &mut dyn Iterator<Item = f64>| {
        values.fold(None, |most: Option<f64>, value| Some(most.map_or(value, |most| most.max(value))))
    };
    Iso9283 {
        standard: "ISO 9283:1998",
        target: run.target.clone(),
        commanded: run.commanded_from,
        accuracy: greatest(&mut at.iter().filter_map(|pose| pose.accuracy)),
        repeatability: greatest(&mut at.iter().map(|pose| pose.repeatability)).unwrap_or(0.0),
        variation: greatest(&mut variations.iter().map(|one| one.variation)),
        orientation: greatest_orientation(run, &at),
        notes: notes(run, &variations),
        at,
        variations,
    }
}

/// The orientations that were reached, where every visit has one.
fn rotations(visits: &[Visit]) -> Option<Vec<Rotation3<f64>>> {
    visits.iter().map(|visit| visit.rotation).collect()
}

fn of_orientation(visits: &[Visit]) -> Option<OrientationAtPose> {
    let commanded: Option<Vec<Rotation3<f64>>> =
        visits.iter().map(|visit| visit.commanded_rotation).collect();
    orientation::at_pose(&rotations(visits)?, commanded.as_deref())
}

fn greatest_orientation(run: &PoseRun, at: &[AtPose]) -> Option<GreatestOrientation> {
    let each: Vec<OrientationAtPose> = at.iter().filter_map(|pose| pose.orientation).collect();
    let mut variations = Vec::new();
    for (index, one) in run.poses.iter().enumerate() {
        if run.poses.iter().take(index).any(|known| known.pose == one.pose) {
            continue;
        }
        let ways = run.poses.iter().filter(|other| other.pose == one.pose);
        let means: Vec<Rotation3<f64>> = ways
            .filter_map(|way| rotations(&way.visits))
            .filter_map(|rotations| orientation::mean(&rotations))
            .collect();
        variations.extend(orientation::variation(&means));
    }
    Some(GreatestOrientation {
        accuracy: orientation::greatest(each.iter().filter_map(|one| one.accuracy)),
        repeatability: orientation::greatest(each.iter().map(|one| one.repeatability))?,
        variation: orientation::greatest(variations.into_iter()),
    })
}

/// Barycentre, mean distance from it, and the standard deviation of the distances.
fn spread(visits: &[Visit]) -> (Vector3<f64>, f64, f64) {
    let count = visits.len().max(1) as f64;
    let barycentre = visits.iter().map(|visit| visit.attained).sum::<Vector3<f64>>() / count;
    let distances: Vec<f64> = visits.iter().map(|visit| (visit.attained - barycentre).norm()).collect();
    let mean = distances.iter().sum::<f64>() / count;
    let squares: f64 = distances.iter().map(|distance| (distance - mean).powi(2)).sum();
    (barycentre, mean, (squares / (count - 1.0).max(1.0)).sqrt())
}

/// From what was commanded to what was reached, on average.
fn accuracy(visits: &[Visit]) -> Option<Vector3<f64>> {
    let off: Option<Vec<Vector3<f64>>> =
        visits.iter().map(|visit| Some(visit.attained - visit.commanded?)).collect();
    let off = off?;
    Some(off.iter().sum::<Vector3<f64>>() / off.len().max(1) as f64)
}

fn at_pose(pose: &PoseVisits) -> AtPose {
    let (barycentre, mean, s) = spread(&pose.visits);
    let off = accuracy(&pose.visits);
    AtPose {
        pose: pose.pose.clone(),
        sides: pose.sides.clone(),
        visits: pose.visits.len(),
        barycentre_mm: barycentre.into(),
        accuracy: off.map(|off| off.norm()),
        accuracy_parts: off.map(Into::into),
        l_mean_mm: mean,
        s_l_mm: s,
        repeatability: mean + 3.0 * s,
        orientation: of_orientation(&pose.visits),
        drift: drift(&pose.visits),
    }
}

/// Measurements of ten visits each, the first against all others.
fn drift(visits: &[Visit]) -> Option<Drift> {
    let over_s = visits.last()?.time? - visits.first()?.time?;
    let measurements: Vec<&[Visit]> = visits.chunks_exact(DRIFT_VISITS).collect();
    let (first, later) = measurements.split_first()?;
    if later.is_empty() {
        return None;
    }
    let size = |visits: &[Visit]| accuracy(visits).map(|off| off.norm());
    let ball = |visits: &[Visit]| {
        let (_, mean, s) = spread(visits);
        mean + 3.0 * s
    };
    let changes = later.iter().map(|now| Some((size(now)? - size(first)?).abs()));
    let changes: Option<Vec<f64>> = changes.collect();
    Some(Drift {
        accuracy: changes.map(|changes| changes.into_iter().fold(0.0, f64::max)),
        repeatability: later.iter().map(|now| (ball(now) - ball(first)).abs()).fold(0.0, f64::max),
        over_s,
        measurements: measurements.len(),
    })
}

/// Of each pose that was reached by several ways, how far apart its barycentres lie.
fn variations(at: &[AtPose]) -> Vec<SideVariation> {
    let mut found: Vec<SideVariation> = Vec::new();
    for (index, one) in at.iter().enumerate() {
        if found.iter().any(|known| known.pose == one.pose) {
            continue;
        }
        let same: Vec<&AtPose> = at.iter().skip(index).filter(|other| other.pose == one.pose).collect();
        if same.len() < 2 {
            continue;
        }
        let apart = |left: &AtPose, right: &AtPose| {
            (Vector3::from(left.barycentre_mm) - Vector3::from(right.barycentre_mm)).norm()
        };
        let variation =
            same.iter().flat_map(|left| same.iter().map(move |right| apart(left, right))).fold(0.0, f64::max);
        found.push(SideVariation { pose: one.pose.clone(), ways: same.len(), variation });
    }
    found
}

fn notes(run: &PoseRun, variations: &[SideVariation]) -> Vec<String> {
    let mut notes = Vec::new();
    let fewest = run.poses.iter().map(|pose| pose.visits.len()).min().unwrap_or(0);
    if fewest < CYCLES {
        notes.push(format!("{fewest} returns to some pose; the standard asks for {CYCLES} cycles"));
    }
    let mut poses: Vec<&str> = run.poses.iter().map(|pose| pose.pose.as_str()).collect();
    poses.dedup();
    if poses.len() < POSES {
        notes.push(format!(
            "{} poses; the standard asks for {POSES} in a plane through the cube of the working space",
            poses.len()
        ));
    }
    match run.commanded_from {
        CommandedFrom::Unknown => notes.push(
            "nobody says where the target was commanded to: no accuracy (columns commanded_x_mm ..., or --model)".to_owned(),
        ),
        CommandedFrom::Model => notes.push(
            "commanded places are where the model has the target, with base and targets that the model leaves free placed by these rows".to_owned(),
        ),
        CommandedFrom::Table => {}
    }
    if run.axes.contains(&false) {
        notes.push("not all three axes were read: distances are in those that were".to_owned());
    }
    let has_orientations =
        run.poses.iter().flat_map(|pose| &pose.visits).any(|visit| visit.rotation.is_some());
    let has_commanded =
        run.poses.iter().flat_map(|pose| &pose.visits).any(|visit| visit.commanded_rotation.is_some());
    if has_orientations && !has_commanded && run.commanded_from != CommandedFrom::Unknown {
        notes.push(
            "nobody says how the target was to be turned: no accuracy of the orientation (columns commanded_qw ... or commanded_rx_deg ...)".to_owned(),
        );
    }
    if run.single_rows > 0 {
        notes.push(format!("{} rows are no returns and were left aside", run.single_rows));
    }
    if !variations.is_empty() {
        notes.push(
            "poses were reached by several ways: accuracy and repeatability are given for each".to_owned(),
        );
    }
    notes
}
