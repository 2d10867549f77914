//! What trials came to, as a table.

use std::collections::BTreeMap;

use super::{End, Rehearsal, Trial};

/// Times the floor within which an error counts as gone.
const NEAR: f64 = 1.3;

/// A line a trial, then what came of each kind of fault, and of all.
pub(super) fn table(done: &[Trial]) -> String {
    let mut text = format!(
        "{:<18} {:>4}  {:<44} {:<20} {:<34} {:>6} {:>6} {:>6} {:>7}\n",
        "fault", "seed", "hidden", "verdict", "added", "before", "after", "floor", "ratio"
    );
    for one in done {
        text.push_str(&format!("{:<18} {:>4}  {:<44} ", one.fault, one.seed, one.hidden));
        text.push_str(&match &one.end {
            End::Scored(scored) => line(scored),
            End::NotScored(reason) => format!("not scored: {reason}"),
            End::Failed(reason) => format!("FAILED: {reason}"),
        });
        text.push('\n');
    }
    text.push('\n');
    text.push_str(&by_fault(done));
    text.push_str(
        "mm RMS over fresh points; of lost steps, before: lost again at full speed, after: zeros found anew after that\n",
    );
    text
}

fn line(one: &Rehearsal) -> String {
    let text = if one.reported_not_shown { "(said not to show)" } else { one.added.as_str() };
    let wrong = if one.right { "" } else { "  WRONG" };
    format!(
        "{:<20} {text:<34} {:>6.2} {:>6.2} {:>6.2} {:>7.2}{wrong}",
        one.verdicts(),
        one.lost_again_mm.unwrap_or(one.before_mm),
        one.anew_mm.unwrap_or(one.after_mm),
        one.floor_mm,
        one.over_floor(),
    )
}

/// How trials of one kind ended.
#[derive(Default)]
struct Count {
    trials: usize,
    right: usize,
    named: usize,
    not_shown: usize,
    near: usize,
    not_scored: usize,
    failed: usize,
}

impl Count {
    fn take(&mut self, end: &End) {
        match end {
            End::Scored(scored) => {
                self.trials += 1;
                self.right += usize::from(scored.right);
                self.named += usize::from(scored.right && scored.verdict == "named");
                self.not_shown += usize::from(scored.reported_not_shown);
                self.near += usize::from(scored.over_floor() <= NEAR);
            }
            End::NotScored(_) => self.not_scored += 1,
            End::Failed(_) => self.failed += 1,
        }
    }

    fn line(&self, name: &str) -> String {
        format!(
            "{name:<28} {:>6} {:>6} {:>6} {:>17} {:>20} {:>10} {:>6}\n",
            self.trials, self.right, self.named, self.not_shown, self.near, self.not_scored, self.failed
        )
    }
}

fn by_fault(done: &[Trial]) -> String {
    let mut counts: BTreeMap<&str, Count> = BTreeMap::new();
    let mut all = Count::default();
    for one in done {
        let effect = one.hidden.split_once(' ').map_or(one.hidden.as_str(), |(effect, _)| effect);
        counts.entry(if effect.is_empty() { one.fault.as_str() } else { effect }).or_default().take(&one.end);
        all.take(&one.end);
    }
    let mut text = format!(
        "{:<28} {:>6} {:>6} {:>6} {:>17} {:>20} {:>10} {:>6}\n",
        "hidden",
        "scored",
        "right",
        "named",
        "said not to show",
        "error <= 1.3 x noise",
        "not scored",
        "failed"
    );
    for (effect, count) in &counts {
        text.push_str(&count.line(effect));
    }
    text.push_str(&all.line("all"));
    text
}
