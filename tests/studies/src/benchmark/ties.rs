//! Where the lab cannot distinguish candidates: whether further poses settle it, those it asks for and as many at random.

use plumb_simulated::physics::campaign::poses::{Chosen, plan};
use plumb_simulated::physics::campaign::specification::{Specification, Spread};
use plumb_simulated::physics::campaign::{Case, Verdict, generate_further};
use serde::Serialize;

use super::cells::Work;
use super::error::BenchmarkError;
use super::lab;
use super::report::describe;
use super::trials::{diagnosed, over_cases};
use crate::interval::Proportion;
use plumb::commands::trial::score::{Diagnosis, Score};

/// Further poses.
const POSES: usize = 8;

/// What became of a cell's ties.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    cell: &'static str,
    #[serde(skip)]
    title: &'static str,
    trials: usize,
    /// Trials that left several candidates, the truth among them.
    ties: usize,
    /// Of these, those of which the lab says that no pose distinguishes the candidates, and what poses at random made of them.
    #[serde(rename = "no_pose_tells")]
    no_pose_distinguishes: Settled,
    /// What the poses it asks for made of the others.
    asked_for: Settled,
    /// And poses at random.
    #[serde(rename = "by_lot")]
    at_random: Settled,
}

/// What one way of choosing poses did to the ties.
#[derive(Debug, Serialize)]
struct Settled {
    /// What is hidden is named now, and nothing else.
    settled: Proportion,
    /// Something else is named.
    falsely_named: Proportion,
    /// The trials that are not settled.
    left: Vec<Left>,
}

/// A tie that further poses have not settled, to be looked at.
#[derive(Debug, Clone, Serialize)]
struct Left {
    seed: u64,
    arm: String,
    hidden: Vec<String>,
    /// What the lab said at first.
    first: Vec<String>,
    /// What it says with the further poses.
    then: Vec<String>,
    #[serde(skip)]
    outcome: Outcome,
}

/// What each way of choosing poses made of one tie.
struct Tie {
    /// Nothing where the lab says that no pose distinguishes the candidates.
    asked_for: Option<Left>,
    at_random: Left,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outcome {
    Settled,
    Open,
    Wrong,
}

/// Looks for ties in a cell's trials, and measures on.
pub(super) fn settle(work: &Work, seed: u64, count: usize) -> Result<Row, BenchmarkError> {
    let ties: Vec<Option<Tie>> = over_cases(work, seed, count, |case| {
        let refused = |source| BenchmarkError::Lab { seed: case.truth.seed, source: Box::new(source) };
        let first = lab::diagnose(case).map_err(refused)?;
        if !is_tie(&first, case) {
            return Ok(None);
        }
        let chosen = lab::next_poses(case, POSES).map_err(refused)?;
        let left_by = |chosen: &[Chosen]| -> Result<Left, BenchmarkError> {
            let more = generate_further(&case.specification, case.truth.seed, chosen)?;
            let then = lab::diagnose(&more).map_err(refused)?;
            Ok(Left {
                seed: case.truth.seed,
                arm: case.specification.arm.name.clone(),
                hidden: case.truth.hidden.iter().map(describe).collect(),
                first: diagnosed(&first),
                then: diagnosed(&then),
                outcome: outcome(&then, case),
            })
        };
        let asked_for = chosen.map(|chosen| left_by(&chosen)).transpose()?;
        let at_random = left_by(&drawn(&case.specification, case.truth.seed))?;
        Ok(Some(Tie { asked_for, at_random }))
    })?;
    let trials = ties.len();
    let ties: Vec<Tie> = ties.into_iter().flatten().collect();
    let (open, hopeless): (Vec<&Tie>, Vec<&Tie>) = ties.iter().partition(|tie| tie.asked_for.is_some());
    Ok(Row {
        cell: work.name(),
        title: work.title(),
        trials,
        ties: ties.len(),
        no_pose_distinguishes: Settled::of(hopeless.iter().map(|tie| &tie.at_random)),
        asked_for: Settled::of(open.iter().filter_map(|tie| tie.asked_for.as_ref())),
        at_random: Settled::of(open.iter().map(|tie| &tie.at_random)),
    })
}

impl Settled {
    fn of<'t>(ties: impl Iterator<Item = &'t Left> + Clone) -> Self {
        let fraction = |outcome| Proportion::of(ties.clone().map(|tie| tie.outcome == outcome));
        Self {
            settled: fraction(Outcome::Settled),
            falsely_named: fraction(Outcome::Wrong),
            left: ties.clone().filter(|tie| tie.outcome != Outcome::Settled).cloned().collect(),
        }
    }
}

/// Whether the lab leaves several candidates, with what is hidden among them.
fn is_tie(diagnosis: &Diagnosis, case: &Case) -> bool {
    let several = match diagnosis.verdict {
        Verdict::Tied => diagnosis.tied.len() > 1,
        Verdict::Located => diagnosis.located.as_ref().is_some_and(|located| located.family.len() > 1),
        _ => false,
    };
    several && Score::of(diagnosis, &case.truth).truth_in_set
}

fn outcome(diagnosis: &Diagnosis, case: &Case) -> Outcome {
    match diagnosis.verdict {
        Verdict::Named if Score::of(diagnosis, &case.truth).false_name => Outcome::Wrong,
        Verdict::Named => Outcome::Settled,
        _ => Outcome::Open,
    }
}

/// As many poses from all over the joints' ranges, at random.
fn drawn(specification: &Specification, seed: u64) -> Vec<Chosen> {
    let wide = Specification {
        poses: POSES,
        repeated_poses: 0,
        spread: Spread::Wide,
        hidden: Vec::new(),
        ..specification.clone()
    };
    let visits = plan(&wide, !seed);
    let chosen = visits.into_iter().map(|visit| Chosen {
        commanded_deg: visit.commanded_deg,
        sides: visit.sides,
        payload_kg: visit.payload_kg,
    });
    chosen.collect()
}

/// The table's heading.
pub(super) fn heading() -> String {
    format!("{:<28}{:>20}{:>20}\n", "percent of ties", "settled", "false name")
}

/// A cell's lines of the table: percent, and the 95 % interval.
pub(super) fn lines(row: &Row) -> String {
    let line = |title: &str, way: &Settled| {
        format!("  {title:<26}{:>20}{:>20}\n", way.settled.percent(), way.falsely_named.percent())
    };
    format!(
        "{} ({} ties in {} trials)\n{}{}{}",
        row.title,
        row.ties,
        row.trials,
        line(
            &format!("no pose decides {}: at random", row.no_pose_distinguishes.settled.trials),
            &row.no_pose_distinguishes
        ),
        line(&format!("poses asked for, {}", row.asked_for.settled.trials), &row.asked_for),
        line(&format!("random poses, {}", row.at_random.settled.trials), &row.at_random)
    )
}
