//! Which poses to measure next: where the effects in question differ most, for what is known of each. A sequential design for
//! distinguishing models (T-optimality: Atkinson and Fedorov 1975; Atkinson and Donev 1992, Optimum Experimental Designs,
//! chapter 20), each effect's own uncertainty taken into account (Box and Hill 1967).

mod choose;
mod design;
mod not_shown;
mod outcome;
mod pictures;
mod report;
mod rivals;
mod view;

pub use outcome::{Asked, Instead, OtherWay};

use plumb_kinematics::HalfSpace;
use serde::Serialize;

use crate::candidates::{self, Candidates};
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::noise_floor::{Floor, Replicates};
use crate::outcome::{NextPose, Verdict};
use crate::thresholds::{SEARCH_ROWS, SETTLES};
use crate::unlisted;
use crate::verdict::Finding;
use choose::Chooser;
use design::PoseRequest;
use plumb_estimation::Progress;
use report::{approached_from_the_other_side, what_would};

/// What poses are wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct Requested {
    /// New poses, not counting the repeats.
    pub count: usize,
    /// Where the arm must not go.
    pub keep_out: Vec<HalfSpace>,
    /// Loads that can be carried, kg; none given means those of the table.
    pub payloads: Vec<f64>,
}

/// Poses to measure, and what they would settle.
#[derive(Debug, Clone, Serialize)]
pub struct NextPoses {
    /// The poses: new ones, then returns to the first two.
    pub next: Vec<NextPose>,
    /// The effects they distinguish, as written.
    pub between: Vec<String>,
    /// How far apart the predictions of two effects lie over all poses, in standard errors: the least of the pairs that are reported
    /// apart, the greatest of all pairs where none is.
    pub separation: f64,
    /// Poses among them that are no returns.
    #[serde(skip)]
    pub new: usize,
    /// What the poses are for.
    #[serde(skip)]
    pub asked: Asked,
    /// What would separate them if these poses do not.
    #[serde(skip)]
    pub instead: Option<Instead>,
}

impl Laboratory {
    /// Chooses poses that distinguish what the data cannot.
    ///
    /// # Errors
    /// Nothing can be fitted, no pose is allowed, or cancellation.
    pub fn next_poses(
        &self,
        requested: &Requested,
        progress: &Progress,
    ) -> Result<NextPoses, LaboratoryError> {
        // The same rows as in a diagnosis: what is asked about is what it could not settle.
        let thin = self.thinned(SEARCH_ROWS);
        let lab = thin.as_ref().unwrap_or(self);
        let problem = lab.problem(&[])?;
        let fit = lab.fit(&problem, progress)?;
        let returns = Replicates::gather(&problem, &fit, &lab.context());
        let floor = Floor::among(&problem, returns.as_ref());
        let candidates = Candidates { listed: candidates::probes(lab), unlisted: unlisted::probes(lab) };
        let finding = lab.find(&floor, &candidates, progress)?;
        if finding.verdict == Verdict::AtFloor
            && let Some(poses) = lab.poses_for_not_shown(&finding.stage, &floor, requested, progress)?
        {
            return Ok(poses);
        }
        let (rivals, noise) = lab.rivals_of(&finding, &floor, progress)?;
        progress.report(0.7, "choosing poses")?;
        let mut chooser = Chooser::new(lab, rivals, noise)?;
        let request = PoseRequest {
            count: requested.count,
            keep_out: &requested.keep_out,
            payloads: &requested.payloads,
        };
        let choice = chooser.choose(request, progress)?;
        if choice.designs.is_empty() {
            return Err(no_pose());
        }
        let labels = chooser.labels();
        let (separation, alike) = (choice.separation(), choice.alike(&labels));
        // Each other way of measuring costs a search of its own: asked only where poses alone do not do.
        let instead = match labels.len() > 1 && separation < SETTLES {
            true => Some(what_would(&mut chooser, request, separation, progress)?),
            false => None,
        };
        let pair = |(one, other): &(&str, &str)| ((*one).to_owned(), (*other).to_owned());
        let asked = Asked::Rivals {
            named: finding.verdict == Verdict::Named,
            alike: alike.iter().map(pair).collect(),
        };
        let next = with_returns(chooser.to_poses(&choice.designs));
        let new = choice.designs.len();
        Ok(NextPoses { next, between: labels, separation, new, asked, instead })
    }

    /// A few poses that distinguish what a finding could not, none if it left no question; and how far apart its candidates lie over them (standard errors, [`NextPoses::separation`]).
    pub(super) fn poses_for(
        &self,
        finding: &Finding<'_>,
        floor: &Floor,
        progress: &Progress,
    ) -> Result<(Vec<NextPose>, Option<f64>), LaboratoryError> {
        let requested = Requested { count: FEW, keep_out: Vec::new(), payloads: Vec::new() };
        if finding.verdict == Verdict::AtFloor {
            let poses = self.poses_for_not_shown(&finding.stage, floor, &requested, progress)?;
            let next = poses.map_or_else(Vec::new, |poses| poses.next.into_iter().take(FEW).collect());
            return Ok((next, None));
        }
        // A name has no rival to be distinguished from, and what nothing explains no prediction.
        if finding.close.len() < 2 || !matches!(finding.verdict, Verdict::Tied | Verdict::Located) {
            return Ok((Vec::new(), None));
        }
        let (rivals, noise) = self.rivals_of(finding, floor, progress)?;
        let mut chooser = Chooser::new(self, rivals, noise)?;
        let request = PoseRequest { count: FEW, keep_out: &[], payloads: &[] };
        let choice = chooser.choose(request, progress)?;
        Ok((chooser.to_poses(&choice.designs), Some(choice.separation())))
    }
}

/// Poses that a diagnosis lists.
const FEW: usize = 4;

/// The poses, then returns to the first two from the other side: they distinguish play from everything else, and carry the noise floor.
fn with_returns(mut poses: Vec<NextPose>) -> Vec<NextPose> {
    let returns: Vec<NextPose> = poses.iter().take(2).map(approached_from_the_other_side).collect();
    poses.extend(returns);
    poses
}

/// Why no pose was chosen.
fn no_pose() -> LaboratoryError {
    LaboratoryError::Refused(
        "no pose within the limits stays clear of what must be kept out; check `limits` and the keep-out planes".to_owned(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links_with;

    #[test]
    fn poses_keep_clear_of_limits_distinguish_the_name_from_what_comes_next_and_end_with_returns() {
        let lines = "free: [joint_zero(*)]\nnoise: {p1_mm: 0.05}";
        let lab = two_links_with(lines, 30, 0.05, 51, |q| [0.0, 0.01 * q[1]]);
        let requested = Requested { count: 3, keep_out: Vec::new(), payloads: Vec::new() };
        let chosen = lab.next_poses(&requested, &Progress::unwatched()).unwrap();
        assert_eq!(chosen.next.len(), 5, "{chosen:?}");
        assert_eq!(chosen.between[0], "joint_gain(elbow)");
        assert_eq!(chosen.next[3].q_deg, chosen.next[0].q_deg);
        assert_eq!(chosen.next[4].q_deg, chosen.next[1].q_deg);
        // A fiftieth of the range is kept from either limit: 6.8 of 340 deg, 6 of 300.
        assert!(
            chosen.next.iter().all(|pose| pose.q_deg[0].abs() <= 163.21 && pose.q_deg[1].abs() <= 144.01)
        );
        for pose in &chosen.next[..3] {
            assert!(chosen.between.iter().all(|label| pose.predicted.contains_key(label)), "{pose:?}");
        }
        assert!(chosen.separation > SETTLES && chosen.instead.is_none(), "{chosen:?}");
        let again = lab.next_poses(&requested, &Progress::unwatched()).unwrap();
        assert_eq!(chosen.next, again.next, "the same question has the same answer");
    }

    #[test]
    fn a_plane_that_leaves_no_room_is_reported_and_one_that_does_is_kept() {
        let lab = two_links_with("free: [joint_zero(*)]\nnoise: {p1_mm: 0.05}", 30, 0.05, 52, |q| {
            [0.0, 0.01 * q[1]]
        });
        let beyond = |offset: f64| Requested {
            count: 2,
            keep_out: vec![HalfSpace { normal: [0.0, 1.0, 0.0], offset }],
            payloads: Vec::new(),
        };
        let refused = lab.next_poses(&beyond(500.0), &Progress::unwatched()).unwrap_err().to_string();
        assert!(refused.contains("no pose within the limits"), "{refused}");
        let kept = lab.next_poses(&beyond(-150.0), &Progress::unwatched()).unwrap();
        for pose in &kept.next {
            let first = pose.q_deg[0].to_radians();
            let tip = 200.0 * first.sin() + 150.0 * (first + pose.q_deg[1].to_radians()).sin();
            assert!(tip > -152.0, "{pose:?} at {tip}");
        }
    }
}
