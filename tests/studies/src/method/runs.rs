//! Many runs of one line, one after the other.

use std::io::{IsTerminal as _, Write as _};
use std::path::PathBuf;
use std::time::Instant;

use super::StudyError;
use super::bench::{Bench, Run, StudyFolder};
use super::statistics::Summary;
use plumb::commands::study::study_file::{Common, Quantity, Shown, Statistic};
use plumb::interrupt::Interrupt;

/// Where and how runs are made.
pub(super) struct Runs {
    folder: StudyFolder,
    interrupt: Interrupt,
    plugins: Vec<PathBuf>,
    began: Instant,
    made: usize,
    planned: usize,
}

impl Runs {
    /// For a study of so many runs.
    pub(super) fn new(planned: usize, plugins: &[PathBuf]) -> Result<Self, StudyError> {
        let (folder, interrupt) = (StudyFolder::new()?, Interrupt::listen()?);
        Ok(Self { folder, interrupt, plugins: plugins.to_vec(), began: Instant::now(), made: 0, planned })
    }

    /// Makes `count` runs with seeds from `seed` on.
    pub(super) fn make(
        &mut self,
        title: &str,
        with: Common,
        count: u32,
        seed: u64,
    ) -> Result<Vec<Run>, StudyError> {
        let mut bench = Bench::new(with, &self.folder, &self.plugins)?;
        let mut runs = Vec::new();
        for number in 0..u64::from(count) {
            if self.interrupt.is_asked() {
                return Err(StudyError::Interrupted);
            }
            runs.push(bench.run(seed + number)?);
            self.made += 1;
            self.show(title);
        }
        self.clear();
        Ok(runs)
    }

    /// How many runs a second, so far.
    pub(super) fn rate(&self) -> f64 {
        self.made as f64 / self.began.elapsed().as_secs_f64()
    }

    /// How many so far.
    pub(super) fn made(&self) -> usize {
        self.made
    }

    fn show(&self, title: &str) {
        let mut errors = std::io::stderr();
        if errors.is_terminal() {
            let left = self.planned.saturating_sub(self.made) as f64 / self.rate();
            let _ =
                write!(errors, "\r\x1b[K{} of {} runs, {title}, {left:.0} s to go", self.made, self.planned);
        }
    }

    fn clear(&self) {
        let mut errors = std::io::stderr();
        if errors.is_terminal() {
            let _ = write!(errors, "\r\x1b[K");
        }
    }
}

/// One quantity of the runs that passed.
pub(super) fn values(runs: &[Run], quantity: Quantity) -> Vec<f64> {
    runs.iter().filter_map(|run| run.missed.as_ref()).map(|missed| missed.of(quantity)).collect()
}

/// What a figure shows of runs; none when fewer than two passed.
pub(super) fn shown(runs: &[Run], shown: Shown) -> Option<f64> {
    let summary = Summary::of(&values(runs, shown.of));
    let value = match shown.r#as {
        Statistic::Bias => summary.mean,
        Statistic::Spread => summary.spread,
        Statistic::Rms => summary.rms(),
    };
    (summary.count > 1 && value.is_finite()).then_some(value)
}
