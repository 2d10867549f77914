//! Connected components of runs, corners included.

use super::runs::Runs;

/// A connected component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Component {
    /// Its name: the place of its first run.
    pub(super) root: u32,
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
#[derive(Debug, Clone, Default)]
pub(super) struct Components {
    /// For every run an earlier run of the same component, or itself.
    earlier: Vec<u32>,
    found: Vec<Component>,
    /// For every run that is a root, its component's place.
    place_of_root: Vec<u32>,
}

impl Components {
    /// Joins the runs of a picture.
    pub(super) fn find(&mut self, runs: &Runs) {
        let all = runs.all();
        self.earlier.clear();
        self.earlier.extend(0..all.len() as u32);
        for row in 1..runs.rows() {
            let (mut above, mut here) = (runs.of_row(row - 1), runs.of_row(row));
            while let (Some(upper), Some(lower)) = (all.get(above.start), all.get(here.start)) {
                if above.is_empty() || here.is_empty() {
                    break;
                }
                if upper.touches(*lower) {
                    self.join(above.start as u32, here.start as u32);
                }
                if upper.end < lower.end {
                    above.start += 1;
                } else {
                    here.start += 1;
                }
            }
        }
        self.collect(runs);
    }

    /// The components, from the top.
    pub(super) fn all(&self) -> &[Component] {
        &self.found
    }

    /// The name of a run's component.
    #[inline]
    pub(super) fn root(&self, run: usize) -> u32 {
        self.earlier.get(run).copied().unwrap_or(u32::MAX)
    }

    #[inline]
    fn earliest(&mut self, run: u32) -> u32 {
        let mut at = run as usize;
        while let Some(next) = self.earlier.get(at).map(|next| *next as usize) {
            if next == at {
                break;
            }
            let beyond = self.root(next);
            if let Some(shorter) = self.earlier.get_mut(at) {
                *shorter = beyond;
            }
            at = next;
        }
        at as u32
    }

    #[inline]
    fn join(&mut self, one: u32, other: u32) {
        let (one, other) = (self.earliest(one), self.earliest(other));
        let (first, second) = (one.min(other), one.max(other));
        if let Some(joined) = self.earlier.get_mut(second as usize) {
            *joined = first;
        }
    }

    /// Gives every run its component's root, and measures the components.
    fn collect(&mut self, runs: &Runs) {
        self.found.clear();
        self.place_of_root.clear();
        self.place_of_root.resize(self.earlier.len(), 0);
        for row in 0..runs.rows() {
            for place in runs.of_row(row) {
                // A root lies before all others of its component, so that what it points to is settled already.
                let root = self.root(self.root(place) as usize);
                let (Some(run), Some(earlier)) = (runs.all().get(place), self.earlier.get_mut(place)) else {
                    continue;
                };
                *earlier = root;
                let length = u32::from(run.length());
                if root as usize == place {
                    self.name(place);
                    let row = row as u32;
                    self.found.push(Component { root, top: row, bottom: row, pixels: length, runs: 1 });
                } else if let Some(component) = self.component_mut(root) {
                    component.bottom = row as u32;
                    component.pixels += length;
                    component.runs += 1;
                }
            }
        }
    }

    /// The next component found is this run's.
    #[inline]
    fn name(&mut self, run: usize) {
        if let Some(place) = self.place_of_root.get_mut(run) {
            *place = self.found.len() as u32;
        }
    }

    #[inline]
    fn component_mut(&mut self, root: u32) -> Option<&mut Component> {
        let place = *self.place_of_root.get(root as usize)?;
        self.found.get_mut(place as usize)
    }
}
