//! Connected components of runs, corners included.

use super::runs::{Run, Runs};

/// A connected component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Component {
    /// What [`Components::of_run`] calls it.
    pub(super) name: u32,
    /// Its first row.
    pub(super) top: u32,
    /// Its last row.
    pub(super) bottom: u32,
    /// Its lit pixels.
    pub(super) pixels: u32,
    /// Its runs.
    pub(super) runs: u32,
}

impl Component {
    /// Rows from its first to its last.
    pub(super) fn height(&self) -> u32 {
        self.bottom - self.top + 1
    }
}

/// Which component every run belongs to. Its memory is kept from picture to picture.
///
/// From the top on, a run is part of what it touches above, or begins a new part. Where it touches two parts they are one component, and
/// the part that began later says so: a picture has few parts, and only they are put in order in the end.
#[derive(Debug, Clone, Default)]
pub(super) struct Components {
    part_of_run: Vec<u32>,
    /// For every part an earlier one of the same component, or itself.
    earlier: Vec<u32>,
    /// Every part, then every component.
    found: Vec<Component>,
}

impl Components {
    /// Joins the runs of a picture.
    pub(super) fn find(&mut self, runs: &Runs) {
        self.part_of_run.clear();
        self.earlier.clear();
        self.found.clear();
        let mut above: (&[Run], usize) = (&[], 0);
        for (row, here) in (0..).zip(runs.of_rows()) {
            let begin = self.part_of_run.len();
            match (above.0, here) {
                // Most rows: the stripe goes on, and nothing else is lit.
                ([upper], [run]) if upper.touches(*run) => {
                    let part = self.part_of_run.get(above.1).copied().unwrap_or_default();
                    self.add(part, row, *run);
                }
                _ => self.join_row(row, above.0, above.1, here),
            }
            above = (here, begin);
        }
        self.settle();
    }

    /// The components, from the top.
    pub(super) fn all(&self) -> &[Component] {
        &self.found
    }

    /// The name of a run's component.
    #[inline]
    pub(super) fn of_run(&self, run: usize) -> u32 {
        let part = self.part_of_run.get(run).copied().unwrap_or(u32::MAX);
        self.earlier_of(part)
    }

    /// Gives a row's runs to the parts of the row above, whose first run has the index `begin`.
    fn join_row(&mut self, row: u32, mut above: &[Run], mut begin: usize, here: &[Run]) {
        for run in here {
            // What ends before this run begins touches none of those that follow either.
            while let Some((upper, others)) = above.split_first()
                && upper.end < run.start
            {
                (above, begin) = (others, begin + 1);
            }
            let mut part = None;
            for (index, _) in (begin..).zip(above.iter().take_while(|upper| upper.start <= run.end)) {
                let upper = self.part_of_run.get(index).copied().unwrap_or_default();
                part = Some(part.map_or(upper, |part| self.join(part, upper)));
            }
            let part = part.unwrap_or_else(|| self.begin(row));
            self.add(part, row, *run);
        }
    }

    /// The next run belongs to a part.
    #[inline]
    fn add(&mut self, part: u32, row: u32, run: Run) {
        self.part_of_run.push(part);
        if let Some(component) = self.found.get_mut(part as usize) {
            component.bottom = row;
            component.pixels += u32::from(run.length());
            component.runs += 1;
        }
    }

    /// A new part.
    fn begin(&mut self, row: u32) -> u32 {
        let name = self.found.len() as u32;
        self.found.push(Component { name, top: row, bottom: row, pixels: 0, runs: 0 });
        self.earlier.push(name);
        name
    }

    /// Two parts are one component. Returns the one that began earlier.
    fn join(&mut self, one: u32, other: u32) -> u32 {
        if one == other {
            return one;
        }
        let (one, other) = (self.earliest(one), self.earliest(other));
        let (first, second) = (one.min(other), one.max(other));
        self.set_earlier(second, first);
        first
    }

    #[inline]
    fn earlier_of(&self, part: u32) -> u32 {
        self.earlier.get(part as usize).copied().unwrap_or(part)
    }

    fn set_earlier(&mut self, part: u32, earlier: u32) {
        if let Some(entry) = self.earlier.get_mut(part as usize) {
            *entry = earlier;
        }
    }

    /// Follows a part to the first of its component, and halves the way for those who come after.
    fn earliest(&mut self, mut part: u32) -> u32 {
        loop {
            let next = self.earlier_of(part);
            if next == part {
                return part;
            }
            let beyond = self.earlier_of(next);
            self.set_earlier(part, beyond);
            part = next;
        }
    }

    /// Adds every part to the first one of its component, which alone is kept and gives it its name.
    fn settle(&mut self) {
        for part in 0..self.found.len() {
            // What came earlier is settled already.
            let first = self.earlier_of(self.earlier_of(part as u32));
            self.set_earlier(part as u32, first);
            let Some(part) = self.found.get(part).copied().filter(|part| part.name != first) else {
                continue;
            };
            if let Some(component) = self.found.get_mut(first as usize) {
                component.bottom = component.bottom.max(part.bottom);
                component.pixels += part.pixels;
                component.runs += part.runs;
            }
        }
        let earlier = &self.earlier;
        self.found.retain(|part| earlier.get(part.name as usize) == Some(&part.name));
    }
}
