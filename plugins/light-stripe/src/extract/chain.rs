//! The stripe in a component: the longest way down it, one run a row. What branches off and ends, a spur, is left behind.

use super::components::{Component, Components};
use super::runs::{Run, Runs};

/// The runs of a stripe, from the top, one a row.
#[derive(Debug, Clone, Default)]
pub(super) struct Chain {
    /// Row of the first run.
    pub(super) top: usize,
    /// The runs.
    pub(super) runs: Vec<Run>,
    /// The median of their lengths, pixels; 0 where there are none.
    pub(super) median_width: f32,
    /// The greatest of their lengths, pixels.
    pub(super) greatest_width: u16,
    /// The indices of those a spur is joined to, once [`Chain::find_spurs`] looked.
    pub(super) spurs: Vec<usize>,
    steps: Vec<Step>,
}

/// A run wider than this many times the stripe's median has something joined to it.
const WIDEST: f32 = 2.5;

/// Runs at least this long are counted together.
const LONGEST_COUNTED: usize = 255;

/// A run on its way down.
#[derive(Debug, Clone, Copy)]
struct Step {
    run: Run,
    row: u32,
    /// Rows of the longest way that ends here.
    length: u32,
    /// The step before, in `steps`; its own index at the beginning of a way.
    before: u32,
}

impl Chain {
    /// Finds the longest way down a component.
    pub(super) fn follow(&mut self, component: &Component, components: &Components, runs: &Runs) {
        if component.runs == component.height() {
            self.take_all(component, components, runs);
        } else {
            self.follow_longest(component, components, runs);
        }
        self.greatest_width = self.runs.iter().map(|run| run.length()).max().unwrap_or(0);
        self.median_width = self.median();
    }

    /// Finds the runs that are far wider than the stripe is, and if wanted cuts off what does not go on from it above and below. Where
    /// nothing decides, an empty run is left.
    pub(super) fn find_spurs(&mut self, cut: bool) {
        self.spurs.clear();
        let widest = (WIDEST * self.median_width).max(6.0);
        let is_spurred = |run: &Run| f32::from(run.length()) > widest;
        if f32::from(self.greatest_width) <= widest {
            return;
        }
        let mut above = None;
        let mut rest = self.runs.as_mut_slice();
        let mut index = 0;
        while let Some((run, later)) = rest.split_first_mut() {
            if is_spurred(run) {
                self.spurs.push(index);
                if cut {
                    let below = later.iter().find(|run| !is_spurred(run)).copied();
                    *run = without_spur(*run, above, below).unwrap_or_default();
                }
            } else {
                above = Some(*run);
            }
            (rest, index) = (later, index + 1);
        }
    }

    /// Of a component with one run a row there is one way down: all of it.
    fn take_all(&mut self, component: &Component, components: &Components, runs: &Runs) {
        let (top, bottom) = (component.top as usize, component.bottom as usize);
        let indices = runs.of_row(top).start..runs.of_row(bottom).end;
        let among = runs.all().get(indices.clone()).unwrap_or_default();
        self.top = top;
        self.runs.clear();
        self.runs.resize(component.runs as usize + 1, Run::default());
        // Every run is written down, and over those of others the next: that is faster than to guess which are.
        let mut count = 0;
        for (run, index) in among.iter().zip(indices) {
            if let Some(here) = self.runs.get_mut(count) {
                *here = *run;
            }
            count += usize::from(components.of_run(index) == component.name);
        }
        self.runs.truncate(count);
    }

    fn median(&self) -> f32 {
        let mut counts = [0_u32; LONGEST_COUNTED + 1];
        for run in &self.runs {
            if let Some(count) = counts.get_mut(usize::from(run.length()).min(LONGEST_COUNTED)) {
                *count += 1;
            }
        }
        let (mut seen, middle) = (0, self.runs.len() as u32 / 2);
        let median = counts.iter().position(|count| {
            seen += count;
            seen > middle
        });
        match median {
            None => 0.0,
            Some(LONGEST_COUNTED) => {
                let mut lengths: Vec<u16> = self.runs.iter().map(|run| run.length()).collect();
                f32::from(*lengths.select_nth_unstable(middle as usize).1)
            }
            Some(length) => length as f32,
        }
    }

    fn follow_longest(&mut self, component: &Component, components: &Components, runs: &Runs) {
        self.steps.clear();
        let mut above = 0..0;
        let mut longest = 0_usize;
        for row in component.top as usize..=component.bottom as usize {
            let begin = self.steps.len();
            for index in runs.of_row(row) {
                if components.of_run(index) == component.name
                    && let Some(run) = runs.all().get(index)
                {
                    let step = self.step(*run, row as u32, above.clone());
                    self.steps.push(step);
                }
            }
            above = begin..self.steps.len();
            // The later row wins only where it is truly longer: of two ways of one length the first found counts.
            for step in above.clone() {
                if self.length(step) > self.length(longest) {
                    longest = step;
                }
            }
        }
        self.collect(longest);
    }

    fn length(&self, step: usize) -> u32 {
        self.steps.get(step).map_or(0, |step| step.length)
    }

    /// The run as the end of the longest way to it; of several, that with the most in common with the run above.
    fn step(&self, run: Run, row: u32, above: std::ops::Range<usize>) -> Step {
        let common = |upper: Run| i32::from(run.end.min(upper.end)) - i32::from(run.start.max(upper.start));
        let mut best = Step { run, row, length: 1, before: self.steps.len() as u32 };
        let mut most = i32::MIN;
        for index in above {
            let Some(upper) = self.steps.get(index) else { break };
            let longer = (upper.length + 1, common(upper.run));
            if upper.run.touches(run) && longer > (best.length, most) {
                best = Step { run, row, length: upper.length + 1, before: index as u32 };
                most = longer.1;
            }
        }
        best
    }

    fn collect(&mut self, longest: usize) {
        self.runs.clear();
        let Some(end) = self.steps.get(longest).copied() else { return };
        self.runs.resize(end.length as usize, end.run);
        self.top = (end.row + 1 - end.length) as usize;
        let mut at = longest;
        for run in self.runs.iter_mut().rev() {
            let Some(step) = self.steps.get(at) else { break };
            *run = step.run;
            at = step.before as usize;
        }
    }
}

/// The part of a run with a spur joined to it that goes on from the stripe above and below; none where nothing decides.
fn without_spur(whole: Run, above: Option<Run>, below: Option<Run>) -> Option<Run> {
    let (start, end) = match (above, below) {
        (Some(above), Some(below)) => (above.start.min(below.start), above.end.max(below.end)),
        (Some(one), None) | (None, Some(one)) => (one.start, one.end),
        (None, None) => return None,
    };
    let run = Run { start: whole.start.max(start), end: whole.end.min(end) };
    (run.start < run.end).then_some(run)
}
