#![doc = include_str!("zero_trust.md")]

use std::ops::RangeInclusive;

/// A joint of the drive as it was left and as it reads now, in one unit: rad or mm.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JointThen {
    pub(crate) joint: String,
    pub(crate) recorded: f64,
    pub(crate) reads: f64,
    /// One step of its drive.
    pub(crate) resolution: f64,
    /// Where the step in which the last run was cut off may have brought it.
    pub(crate) may_be: MayBe,
}

/// Where a joint may be although nothing but its run has moved it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum MayBe {
    /// Where it was left.
    There,
    /// On its way to this target.
    Towards(f64),
    /// Anywhere: a search moved it.
    Anywhere,
}

/// What is known when a robot is connected.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Evidence {
    /// A joint of `initialize:` has a zero in force.
    pub(crate) has_zeros: bool,
    pub(crate) is_new_world: bool,
    /// Every joint of the drive; none when the record holds no position of it.
    pub(crate) joints: Option<Vec<JointThen>>,
}

/// Whether the zeros found before still hold, and why.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Verdict {
    NothingToLose,
    NewWorld,
    NoRecord,
    Unmoved,
    OnItsWay,
    /// This joint reads elsewhere.
    Elsewhere(JointThen),
}

/// When a robot is connected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stage {
    /// A procedure begins.
    AtTheStart,
    /// A procedure goes on: it is resumed, or a host was started again.
    InMidRun,
}

/// What the procedure wants with the robot, and who is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Situation {
    pub(crate) stage: Stage,
    pub(crate) finds_zeros: bool,
    pub(crate) moves: bool,
    pub(crate) attended: bool,
}

/// What is done about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Consequence {
    /// The zeros hold.
    Hold,
    /// They are lost; the procedure goes on.
    LoseAndGoOn,
    /// A person is asked whether they hold.
    Ask,
    /// They are lost, and the procedure needs them.
    LoseAndEnd,
}

/// What rounding makes of a number that went through the record in degrees: rad or mm.
const ROUNDING: f64 = 1e-6;

impl JointThen {
    fn is_explained(&self) -> bool {
        let slack = self.resolution + ROUNDING;
        let near =
            |range: RangeInclusive<f64>| (range.start() - slack..=range.end() + slack).contains(&self.reads);
        match self.may_be {
            MayBe::There => near(self.recorded..=self.recorded),
            MayBe::Towards(target) => near(self.recorded.min(target)..=self.recorded.max(target)),
            MayBe::Anywhere => self.reads.is_finite(),
        }
    }

    fn is_where_it_was(&self) -> bool {
        (self.reads - self.recorded).abs() <= self.resolution + ROUNDING
    }
}

impl Verdict {
    /// Whether it means that the zeros hold.
    pub(crate) fn holds(&self) -> bool {
        match self {
            Self::NothingToLose | Self::NewWorld | Self::Unmoved | Self::OnItsWay => true,
            Self::NoRecord | Self::Elsewhere(_) => false,
        }
    }
}

/// The first table of this page.
pub(crate) fn judge(evidence: Evidence) -> Verdict {
    if !evidence.has_zeros {
        return Verdict::NothingToLose;
    }
    if evidence.is_new_world {
        return Verdict::NewWorld;
    }
    let Some(joints) = evidence.joints else { return Verdict::NoRecord };
    if joints.iter().all(JointThen::is_where_it_was) {
        return Verdict::Unmoved;
    }
    match joints.into_iter().find(|joint| !joint.is_explained()) {
        None => Verdict::OnItsWay,
        Some(joint) => Verdict::Elsewhere(joint),
    }
}

/// The second table of this page, but for its last line.
pub(crate) fn consequence(verdict: &Verdict, situation: Situation) -> Consequence {
    if verdict.holds() {
        return Consequence::Hold;
    }
    let begins_to_find = situation.finds_zeros && situation.stage == Stage::AtTheStart;
    match (begins_to_find || !situation.moves, situation.attended) {
        (true, _) => Consequence::LoseAndGoOn,
        (false, true) => Consequence::Ask,
        (false, false) => Consequence::LoseAndEnd,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joint(joint: &str, recorded: f64, reads: f64, may_be: MayBe) -> JointThen {
        JointThen { joint: joint.to_owned(), recorded, reads, resolution: 0.001, may_be }
    }

    fn evidence(joints: &[JointThen]) -> Evidence {
        Evidence { has_zeros: true, is_new_world: false, joints: Some(joints.to_vec()) }
    }

    fn moved() -> JointThen {
        joint("waist", 0.5, 0.0, MayBe::There)
    }

    #[test]
    fn without_zeros_nothing_is_lost() {
        let first_run = Evidence { has_zeros: false, is_new_world: false, joints: None };
        assert_eq!(judge(first_run), Verdict::NothingToLose);
    }

    #[test]
    fn a_new_simulated_world_counts_from_where_each_does() {
        assert_eq!(judge(Evidence { is_new_world: true, ..evidence(&[moved()]) }), Verdict::NewWorld);
    }

    #[test]
    fn a_robot_the_record_never_saw_is_not_vouched_for() {
        assert_eq!(judge(Evidence { joints: None, ..evidence(&[]) }), Verdict::NoRecord);
    }

    #[test]
    fn a_drive_that_reads_where_it_was_left_to_one_step_has_kept_its_count() {
        let within = joint("waist", 0.5, 0.501, MayBe::There);
        assert_eq!(judge(evidence(&[within])), Verdict::Unmoved);
        let beyond = joint("waist", 0.5, 0.5021, MayBe::There);
        assert_eq!(judge(evidence(std::slice::from_ref(&beyond))), Verdict::Elsewhere(beyond));
    }

    #[test]
    fn a_drive_whose_counters_began_anew_is_elsewhere() {
        let still = joint("elbow", 0.0, 0.0, MayBe::There);
        assert_eq!(judge(evidence(&[still, moved()])), Verdict::Elsewhere(moved()));
    }

    #[test]
    fn counters_that_begin_anew_where_the_arm_was_left_cannot_be_distinguished() {
        let home = joint("waist", 0.0, 0.0, MayBe::There);
        assert_eq!(judge(evidence(&[home])), Verdict::Unmoved);
    }

    #[test]
    fn a_run_killed_in_a_move_leaves_its_joints_between_both_ends_of_the_way() {
        let towards = |reads| joint("waist", 0.5, reads, MayBe::Towards(-0.5));
        let still = joint("elbow", 1.0, 1.0, MayBe::There);
        for reads in [0.5, 0.1, -0.5] {
            assert!(matches!(
                judge(evidence(&[towards(reads), still.clone()])),
                Verdict::OnItsWay | Verdict::Unmoved
            ));
        }
        assert_eq!(judge(evidence(&[towards(0.6), still.clone()])), Verdict::Elsewhere(towards(0.6)));
        let power_cycled = joint("elbow", 1.0, 0.0, MayBe::There);
        assert_eq!(judge(evidence(&[towards(0.1), power_cycled.clone()])), Verdict::Elsewhere(power_cycled));
    }

    #[test]
    fn a_run_killed_in_a_search_leaves_the_searched_joint_anywhere_and_the_others_where_they_were() {
        let searched = joint("waist", 0.5, -0.9, MayBe::Anywhere);
        let still = joint("elbow", 1.0, 1.0, MayBe::There);
        assert_eq!(judge(evidence(&[searched.clone(), still])), Verdict::OnItsWay);
        let elsewhere = joint("elbow", 1.0, 0.0, MayBe::There);
        assert_eq!(judge(evidence(&[searched, elsewhere.clone()])), Verdict::Elsewhere(elsewhere));
    }

    #[test]
    fn a_drive_that_reads_no_number_is_elsewhere() {
        for may_be in [MayBe::There, MayBe::Towards(1.0), MayBe::Anywhere] {
            let none = joint("waist", 0.5, f64::NAN, may_be);
            assert!(matches!(judge(evidence(&[none])), Verdict::Elsewhere(_)));
        }
    }

    const BEGINS: Situation =
        Situation { stage: Stage::AtTheStart, finds_zeros: false, moves: true, attended: true };

    #[test]
    fn zeros_that_hold_change_nothing() {
        for verdict in [Verdict::NothingToLose, Verdict::NewWorld, Verdict::Unmoved, Verdict::OnItsWay] {
            for attended in [true, false] {
                assert_eq!(consequence(&verdict, Situation { attended, ..BEGINS }), Consequence::Hold);
            }
        }
    }

    #[test]
    fn what_needs_lost_zeros_asks_or_ends() {
        for verdict in [Verdict::NoRecord, Verdict::Elsewhere(moved())] {
            assert_eq!(consequence(&verdict, BEGINS), Consequence::Ask);
            let alone = Situation { attended: false, ..BEGINS };
            assert_eq!(consequence(&verdict, alone), Consequence::LoseAndEnd);
        }
    }

    #[test]
    fn what_finds_the_zeros_or_moves_nothing_goes_on_without_them() {
        let elsewhere = Verdict::Elsewhere(moved());
        for attended in [true, false] {
            let finds = Situation { finds_zeros: true, attended, ..BEGINS };
            assert_eq!(consequence(&elsewhere, finds), Consequence::LoseAndGoOn);
            let still = Situation { moves: false, attended, ..BEGINS };
            assert_eq!(consequence(&elsewhere, still), Consequence::LoseAndGoOn);
        }
    }

    #[test]
    fn what_was_found_before_the_loss_is_of_no_use_to_a_run_in_its_middle() {
        let elsewhere = Verdict::Elsewhere(moved());
        let resumed = Situation { stage: Stage::InMidRun, finds_zeros: true, ..BEGINS };
        assert_eq!(consequence(&elsewhere, resumed), Consequence::Ask);
        let alone = Situation { attended: false, ..resumed };
        assert_eq!(consequence(&elsewhere, alone), Consequence::LoseAndEnd);
    }
}
