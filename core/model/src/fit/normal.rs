//! Normal equations, gathered row by row and never holding all derivatives at once.

use std::cell::Cell;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{DMatrix, DVector};

use super::machine::{Machine, Scratch};
use super::state::State;
use crate::effect::Effect;

/// Rows handled at once by one thread.
const CHUNK: usize = 128;

/// `J'WJ`, `J'Wr` and `r'Wr` over some rows.
#[derive(Debug, Clone)]
pub(crate) struct Normal {
    pub(crate) matrix: DMatrix<f64>,
    pub(crate) gradient: DVector<f64>,
    pub(crate) squares: f64,
    pub(crate) equations: usize,
}

impl Normal {
    pub(crate) fn zeros(size: usize) -> Self {
        Self {
            matrix: DMatrix::zeros(size, size),
            gradient: DVector::zeros(size),
            squares: 0.0,
            equations: 0,
        }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.gradient += &other.gradient;
        self.squares += other.squares;
        self.equations += other.equations;
    }

    pub(crate) fn subtract(&mut self, other: &Self) {
        self.matrix -= &other.matrix;
        self.gradient -= &other.gradient;
        self.squares -= other.squares;
        self.equations -= other.equations;
    }

    pub(crate) fn take(&mut self, residuals: &[f64], jacobian: &DMatrix<f64>) {
        let transposed = jacobian.transpose();
        self.matrix.gemm(1.0, jacobian, &transposed, 1.0);
        self.gradient.gemv(1.0, jacobian, &DVector::from_column_slice(residuals), 1.0);
        self.squares += residuals.iter().map(|residual| residual * residual).sum::<f64>();
        self.equations += residuals.len();
    }
}

thread_local! {
    /// Whether this thread is one of several at work already.
    static BUSY: Cell<bool> = const { Cell::new(false) };
}

/// How many threads a computation that starts here may use. Asked of the system once: it takes as long as a small fit.
fn cores() -> usize {
    static CORES: OnceLock<usize> = OnceLock::new();
    if BUSY.get() {
        return 1;
    }
    *CORES.get_or_init(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get))
}

/// Does `work` for every item on as many threads as the machine has, and answers in the items' order. What `work` itself would
/// share among threads it does alone.
pub(crate) fn for_each<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let threads = cores().min(items.len());
    if threads < 2 {
        return items.iter().map(work).collect();
    }
    let next = AtomicUsize::new(0);
    let share = || {
        BUSY.set(true);
        let mut own: Vec<(usize, R)> = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else { return own };
            own.push((index, work(item)));
        }
    };
    let mut all: Vec<(usize, R)> = std::thread::scope(|scope| {
        let handles: Vec<_> = (0..threads).map(|_| scope.spawn(share)).collect();
        let joined = handles.into_iter().map(std::thread::ScopedJoinHandle::join);
        joined.flat_map(|own| own.unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    });
    all.sort_by_key(|(index, _)| *index);
    all.into_iter().map(|(_, answer)| answer).collect()
}

/// Runs `work` over chunks of `rows` on as many threads as the machine has, and hands each thread's sum to `join`.
pub(crate) fn over_rows<S: Send>(
    rows: &[usize],
    start: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, &[usize]) + Sync,
    mut join: impl FnMut(S),
) {
    let threads = cores().min(rows.len().div_ceil(4 * CHUNK)).max(1);
    if threads == 1 {
        let mut sum = start();
        rows.chunks(CHUNK).for_each(|chunk| work(&mut sum, chunk));
        return join(sum);
    }
    let share = rows.len().div_ceil(threads);
    let sums: Vec<S> = std::thread::scope(|scope| {
        let spawn = |part: &[usize]| {
            let part = part.to_vec();
            let (start, work) = (&start, &work);
            scope.spawn(move || {
                let mut sum = start();
                part.chunks(CHUNK).for_each(|chunk| work(&mut sum, chunk));
                sum
            })
        };
        let handles: Vec<_> = rows.chunks(share).map(spawn).collect();
        handles.into_iter().filter_map(|handle| handle.join().ok()).collect()
    });
    sums.into_iter().for_each(join);
}

impl Machine<'_> {
    /// Normal equations of the free slots and the probes over `rows`.
    pub(crate) fn normal(
        &self,
        state: &State,
        rows: &[usize],
        weights: &[f64],
        probes: &[&dyn Effect],
    ) -> Normal {
        let size = self.slots.len() + probes.iter().map(|probe| probe.parameters().len()).sum::<usize>();
        let mut total = Normal::zeros(size);
        over_rows(
            rows,
            || Normal::zeros(size),
            |sum, chunk| {
                let block = self.block(state, chunk, weights, probes);
                sum.take(&block.residuals, &block.jacobian);
            },
            |sum| total.add(&sum),
        );
        self.place_distances(state, &mut total);
        total
    }

    /// Normal equations of some rows alone, without what is known between places.
    pub(crate) fn normal_of_rows(&self, state: &State, rows: &[usize], weights: &[f64]) -> Normal {
        let mut total = Normal::zeros(self.slots.len());
        let block = self.block(state, rows, weights, &[]);
        total.take(&block.residuals, &block.jacobian);
        total
    }

    /// Weighted sum of squares over `rows`, without derivatives.
    pub(crate) fn squares(&self, state: &State, rows: &[usize], weights: &[f64]) -> f64 {
        let mut total = 0.0;
        over_rows(
            rows,
            || (0.0, Scratch::default(), Vec::new()),
            |(sum, scratch, residuals), chunk| {
                for row in chunk {
                    residuals.clear();
                    self.row_residuals(state, *row, scratch, residuals);
                    let weight = weights.get(*row).copied().unwrap_or(1.0);
                    let scaled = residuals.iter().zip(self.observations.of_row(*row));
                    *sum += weight
                        * scaled.map(|(residual, equation)| (residual / equation.sigma).powi(2)).sum::<f64>();
                }
            },
            |(sum, _, _)| total += sum,
        );
        let mut constraints = Normal::zeros(self.slots.len());
        self.place_distances(state, &mut constraints);
        total + constraints.squares
    }

    /// Residuals of all equations of the table, mm and rad, in order.
    pub fn residuals(&self, state: &State) -> Vec<f64> {
        let mut scratch = Scratch::default();
        let mut out = Vec::with_capacity(self.observations.equations.len());
        for row in 0..self.observations.rows() {
            self.row_residuals(state, row, &mut scratch, &mut out);
        }
        out
    }

    /// Residuals of all equations when `held` rows were not fitted: places that none of the `fitted` rows touched are
    /// put where the held rows themselves say, so that what is left is how far these disagree.
    pub(crate) fn residuals_apart(&self, state: &State, held: &[usize], fitted: &[usize]) -> Vec<f64> {
        let mut state = state.clone();
        let touched = |rows: &[usize]| -> Vec<Option<u32>> {
            rows.iter().map(|row| self.table.touch.of_row.get(*row).copied().flatten()).collect()
        };
        let known = touched(fitted);
        let mut alone = state.clone();
        super::align::place_touched(self, &mut alone, held);
        for place in touched(held).into_iter().flatten() {
            let index = place as usize;
            if !known.contains(&Some(place))
                && let (Some(slot), Some(own)) = (state.places.get_mut(index), alone.places.get(index))
            {
                *slot = *own;
            }
        }
        let mut scratch = Scratch::default();
        let mut out = vec![f64::NAN; self.observations.equations.len()];
        let mut residuals = Vec::new();
        for row in held {
            residuals.clear();
            self.row_residuals(&state, *row, &mut scratch, &mut residuals);
            if let Some(slots) = out.get_mut(self.observations.range(*row)) {
                slots.copy_from_slice(&residuals);
            }
        }
        out
    }

    /// Known distances between touched places.
    pub(crate) fn place_distances(&self, state: &State, total: &mut Normal) {
        for known in &self.observations.place_distances {
            let (Some(first), Some(second)) = (state.places.get(known.first), state.places.get(known.second))
            else {
                continue;
            };
            let offset = first - second;
            let length = offset.norm();
            let residual = (known.length - length) / known.sigma;
            let mut row = DVector::zeros(total.gradient.len());
            let away = if length > 1e-6 { offset / length } else { nalgebra::Vector3::x() };
            for (index, slot) in self.slots.iter().enumerate() {
                if let super::state::Slot::Place(place, axis) = *slot {
                    let sign = f64::from(u8::from(place == known.first))
                        - f64::from(u8::from(place == known.second));
                    row[index] = sign * away.get(axis).copied().unwrap_or(0.0) / known.sigma;
                }
            }
            total.matrix.ger(1.0, &row, &row, 1.0);
            total.gradient.axpy(residual, &row, 1.0);
            total.squares += residual * residual;
            total.equations += 1;
        }
    }
}
