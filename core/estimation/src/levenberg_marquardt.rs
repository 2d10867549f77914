//! Levenberg-Marquardt descent on scaled normal equations.
//!
//! The damped step is Marquardt's (1963), with the diagonal of `J'J` as the scale; the scale never shrinks (Moré 1978). The
//! damping follows Nielsen's rule `1 - (2g - 1)^3` of the gain ratio `g` (Nielsen 1999; Madsen, Nielsen and Tingleff 2004,
//! Methods for Non-Linear Least Squares Problems, section 3.2). A descent has converged where the gain that a further step
//! predicts is small beside the variance of one measurement. Where residuals stay large, their curvature counts as well, see
//! [`curvature`]. Where a valley bends, steps bend with it: the predictions' second derivative along a step corrects it to second order (geodesic
//! acceleration, Transtrum and Sethna 2012, arXiv:1201.5885), or steps would be as short as the valley is narrow.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::{Cancelled, NormalEquations, Progress, RankRevealingCholesky};

mod curvature;

use curvature::Curvature;

/// A nonlinear least-squares problem. Its state may be anything that a vector of parameter changes moves.
pub trait Problem {
    /// Values of all parameters.
    type State: Clone;

    /// The normal equations at a state: residuals and their negative derivatives, divided by the sigmas.
    fn normal_equations(&self, state: &Self::State) -> NormalEquations;

    /// The state after a change of the parameters.
    fn stepped(&self, state: &Self::State, change: &DVector<f64>) -> Self::State;

    /// Whether all numbers of a state are finite.
    fn is_finite(&self, state: &Self::State) -> bool;

    /// The derivatives of the predictions at a state times their second derivative along a change, `J' p''`, divided by the sigmas squared; nothing where it is not
    /// worked out, and steps stay straight. To be worked out without the first derivatives along the change: what those are off by would look like a bend.
    fn second_derivative_along(&self, _state: &Self::State, _change: &DVector<f64>) -> Option<DVector<f64>> {
        None
    }
}

/// Where a descent ended.
#[derive(Debug, Clone)]
pub struct Descent<S> {
    /// The state reached.
    pub state: S,
    /// The normal equations there.
    pub normal: NormalEquations,
    /// Steps taken.
    pub steps: usize,
    /// Whether it converged, rather than ran out of steps.
    pub converged: bool,
}

/// How to descend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Steps at most.
    pub steps: usize,
    /// Damping of the first step, relative to the scales: [`CAREFUL`], [`CLOSE`] or [`NEAR`].
    pub damping: f64,
}

/// Damping, relative to the scales, of the first step from anywhere (Madsen, Nielsen and Tingleff 2004: 1e-3 for a start that
/// is not far off).
pub const CAREFUL: f64 = 1e-3;

/// Damping of the first step from a state that is believed to be close to the minimum, such as that of nearly the same problem (Madsen, Nielsen and Tingleff 2004: 1e-6). With
/// that of a start from anywhere the first steps would do little but take the damping away again.
pub const CLOSE: f64 = 1e-6;

/// Damping of the first step from a state that was the minimum until a few weights changed.
pub const NEAR: f64 = 1e-8;

/// Least damping: below it the damped matrix is the undamped one in double precision.
const LEAST_DAMPING: f64 = 1e-14;

/// Damping that a refused step begins to grow from.
const LEAST_REFUSED_DAMPING: f64 = 1e-12;

/// Damping beyond which steps move nothing any more.
const GREATEST_DAMPING: f64 = 1e12;

/// Least scale of a parameter that moves nothing, so that the damped matrix stays positive definite.
const LEAST_SCALE: f64 = 1e-300;

/// Gain of the sum of squares, in variances of one measurement, that counts as nothing: a thousandth of a measurement's own
/// scatter cannot be seen in any result.
const NO_GAIN: f64 = 3e-3;

/// The same in absolute terms, where the residuals vanish.
const NO_GAIN_AT_ALL: f64 = 1e-18;

/// Least ratio of the gain reached to the gain predicted for a step to be taken (Moré 1978: 1e-4).
const LEAST_GAIN_RATIO: f64 = 1e-4;

/// Range of the factor by which an accepted step changes the damping.
const DAMPING_FACTOR: (f64, f64) = (0.1, 2.0);

/// Steps in a row that gain next to nothing before a descent counts as converged whatever a full step promises.
const IDLE_STEPS: usize = 10;

/// Steps refused in a row after which a small promise ends a descent.
const REFUSED_STEPS: usize = 3;

/// That small promise, as a fraction of the sum of squares. Where derivatives are good to first order only, the last thousandths
/// are promised again and again, and never come.
const UNKEPT_PROMISE: f64 = 3e-4;

/// Damping from which a step is short and goes down the gradient: there any smooth sum of squares falls by what its gradient promises, however it is curved.
const DOWN_THE_GRADIENT: f64 = 1.0;

/// Fraction of the promise below which such a step shows that the derivatives are not those of the residuals (Moré 1978, section 4: a quarter, from which on a step counts as bad).
const BROKEN_PROMISE: f64 = 0.25;

/// Broken promises in a row that end a descent whose gains are as small as [`UNKEPT_PROMISE`]: ever shorter steps would come no nearer.
const BROKEN_PROMISES: usize = 3;

/// Ratio of the gain reached to the gain predicted below which a valley seems to bend, so that the next steps are asked how they do (Nielsen 1999: from about here on the damping no
/// longer falls by much).
const STRAIGHT: f64 = 0.75;

/// Length of the correction to second order, relative to the step, above which a step leads beyond where two orders describe anything, and is not tried (Transtrum and Sethna 2012; the GNU
/// Scientific Library has the same value).
const MOST_BENT: f64 = 0.75;

/// The same, below which the valley is straight again.
const HARDLY_BENT: f64 = 0.1;

/// Fraction of the sum of squares below which the gain of a refused step counts as none.
const NEGLIGIBLE: f64 = 1e-8;

/// The normal equations with the parameters in `held` taken out: zero rows and columns.
fn without_held(normal: &NormalEquations, held: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
    let (mut matrix, mut gradient) = (normal.matrix.clone(), normal.gradient.clone());
    for parameter in held {
        matrix.row_mut(*parameter).fill(0.0);
        matrix.column_mut(*parameter).fill(0.0);
        gradient[*parameter] = 0.0;
    }
    (matrix, gradient)
}

/// The Gauss-Newton step: to the minimum if the problem were linear. The parameters in `held` stay where they are.
pub fn full_step(normal: &NormalEquations, held: &[usize]) -> DVector<f64> {
    let (matrix, gradient) = without_held(normal, held);
    RankRevealingCholesky::new(&matrix).solve(&gradient)
}

/// What a full step would gain if the problem were linear: under heavy damping a step promises little however far the
/// minimum is.
fn promised(normal: &NormalEquations, held: &[usize]) -> f64 {
    normal.gradient.dot(&full_step(normal, held))
}

/// Descends from `start` until neither steps nor gains matter any more. The parameters in `held` stay where they are.
///
/// # Errors
/// The computation was cancelled.
pub fn descend<P: Problem>(
    problem: &P,
    start: &P::State,
    held: &[usize],
    settings: Settings,
    progress: &Progress,
) -> Result<Descent<P::State>, Cancelled> {
    let normal = problem.normal_equations(start);
    descend_from(problem, (start.clone(), normal), held, settings, progress)
}

/// The same from a state whose normal equations are known.
///
/// # Errors
/// The computation was cancelled.
pub fn descend_from<P: Problem>(
    problem: &P,
    (state, normal): (P::State, NormalEquations),
    held: &[usize],
    settings: Settings,
    progress: &Progress,
) -> Result<Descent<P::State>, Cancelled> {
    let scales = normal.matrix.diagonal();
    let damping = Damping { value: settings.damping, growth: 2.0 };
    let curvature = Curvature::unknown(normal.gradient.len());
    let mut run = Run {
        problem,
        held,
        state,
        normal,
        scales,
        damping,
        curvature,
        bends: false,
        idle: 0,
        refused: 0,
        broken: 0,
    };
    for step in 0..settings.steps {
        progress.check()?;
        if let Some(converged) = run.step() {
            return Ok(run.end(step, converged));
        }
    }
    Ok(run.end(settings.steps, false))
}

/// Marquardt's damping with Nielsen's update.
#[derive(Debug, Clone, Copy)]
struct Damping {
    value: f64,
    growth: f64,
}

impl Damping {
    fn accept(&mut self, gain_ratio: f64) {
        let (least, most) = DAMPING_FACTOR;
        self.value *= (1.0 - (2.0 * gain_ratio - 1.0).powi(3)).clamp(least, most);
        self.value = self.value.max(LEAST_DAMPING);
        self.growth = 2.0;
    }

    fn refuse(&mut self) {
        self.value = (self.value * self.growth).max(LEAST_REFUSED_DAMPING);
        self.growth *= 2.0;
    }

    fn is_exhausted(&self) -> bool {
        self.value > GREATEST_DAMPING
    }
}

/// A descent under way.
struct Run<'a, P: Problem> {
    problem: &'a P,
    held: &'a [usize],
    state: P::State,
    normal: NormalEquations,
    scales: DVector<f64>,
    damping: Damping,
    curvature: Curvature,
    /// Whether the valley seems to bend.
    bends: bool,
    /// Accepted steps in a row that gained next to nothing.
    idle: usize,
    /// Refused steps in a row.
    refused: usize,
    /// Steps in a row that were short and gained less than their gradient promised.
    broken: usize,
}

/// A damped step, the gain it predicts, and the factor of the damped matrix.
struct DampedStep {
    change: DVector<f64>,
    predicted: f64,
    factor: Cholesky<f64, Dyn>,
}

impl<P: Problem> Run<'_, P> {
    fn end(self, steps: usize, converged: bool) -> Descent<P::State> {
        Descent { state: self.state, normal: self.normal, steps, converged }
    }

    /// One step; whether the descent converged, once it ends.
    fn step(&mut self) -> Option<bool> {
        // The scale never shrinks (Moré 1978, section 6): a parameter that a curve makes idle for a while does not run away.
        for (scale, fresh) in self.scales.iter_mut().zip(self.normal.matrix.diagonal().iter()) {
            *scale = scale.max(*fresh);
        }
        let Some(DampedStep { change, predicted, factor }) = self.damped_step() else {
            // With curvature the matrix need not be positive definite; without, damping makes it so.
            match self.curvature.added() {
                Some(_) => self.curvature.set_aside(),
                None => self.damping.refuse(),
            }
            return self.damping.is_exhausted().then_some(false);
        };
        let no_gain = NO_GAIN * self.normal.squares / self.normal.equations.max(1) as f64 + NO_GAIN_AT_ALL;
        if predicted <= no_gain && (self.idle >= IDLE_STEPS || promised(&self.normal, self.held) <= no_gain) {
            return Some(true);
        }
        let Some(change) = self.bent(change, &factor) else {
            self.damping.refuse();
            return self.damping.is_exhausted().then_some(false);
        };
        let state = self.problem.stepped(&self.state, &change);
        // Nearly every step is taken: its normal equations come with its sum of squares.
        let normal = self.problem.normal_equations(&state);
        let gain = self.normal.squares - normal.squares;
        let gain_ratio = gain / predicted;
        // Written so that what is not a number bends.
        let is_straight = gain_ratio >= STRAIGHT;
        self.bends |= !is_straight;
        self.curvature.choose(&self.normal, &change, gain);
        let finite = normal.squares.is_finite() && self.problem.is_finite(&state);
        if finite && gain_ratio > LEAST_GAIN_RATIO {
            self.idle = if gain <= no_gain { self.idle + 1 } else { 0 };
            self.refused = 0;
            let is_broken = self.damping.value > DOWN_THE_GRADIENT && gain_ratio < BROKEN_PROMISE;
            self.broken = if is_broken { self.broken + 1 } else { 0 };
            self.curvature.learn((&self.normal, &normal), &change, self.held);
            (self.state, self.normal) = (state, normal);
            self.damping.accept(gain_ratio);
            let ends = self.broken >= BROKEN_PROMISES && gain <= UNKEPT_PROMISE * self.normal.squares;
            return ends.then_some(true);
        }
        self.refuse(predicted)
    }

    /// A step that follows a valley to second order where that bends, else the step itself; nothing where it leads beyond what two orders describe.
    fn bent(&mut self, change: DVector<f64>, factor: &Cholesky<f64, Dyn>) -> Option<DVector<f64>> {
        let second = self.bends.then(|| self.problem.second_derivative_along(&self.state, &change)).flatten();
        let Some(mut second) = second else { return Some(change) };
        for parameter in self.held {
            second[*parameter] = 0.0;
        }
        let correction = -factor.solve(&second);
        let fraction = 2.0 * (self.scaled_square(&correction) / self.scaled_square(&change)).sqrt();
        // Written so that what is not a number bends too far.
        let is_straight = fraction < HARDLY_BENT;
        self.bends = !is_straight;
        (fraction <= MOST_BENT).then(|| change + correction * 0.5)
    }

    /// Squared length of a change, each parameter in its scale.
    fn scaled_square(&self, change: &DVector<f64>) -> f64 {
        change.iter().zip(self.scales.iter()).map(|(change, scale)| change * change * scale).sum()
    }

    /// The damped step and the gain it predicts; nothing where the damped matrix is not positive definite.
    fn damped_step(&self) -> Option<DampedStep> {
        let (mut damped, gradient) = without_held(&self.normal, self.held);
        if let Some(curvature) = self.curvature.added() {
            damped += curvature;
        }
        for index in 0..damped.nrows() {
            damped[(index, index)] += self.damping.value * self.scales[index].max(LEAST_SCALE);
        }
        // A held parameter's row is zero; one on the diagonal leaves it where it is and the rest untouched.
        for parameter in self.held {
            damped[(*parameter, *parameter)] = 1.0;
        }
        let factor = Cholesky::new(damped)?;
        let change = factor.solve(&gradient);
        // What the linear model gains by this step: (lambda h'Dh + h'g), Madsen, Nielsen and Tingleff 2004, equation 3.14, without its 1/2.
        let predicted = self.damping.value * self.scaled_square(&change) + change.dot(&gradient);
        Some(DampedStep { change, predicted, factor })
    }

    /// A step that gains too little is not taken; whether the descent converged, if that ends it.
    fn refuse(&mut self, predicted: f64) -> Option<bool> {
        self.refused += 1;
        let little = promised(&self.normal, self.held) <= UNKEPT_PROMISE * self.normal.squares;
        if self.damping.is_exhausted() || (self.refused >= REFUSED_STEPS && little) {
            return Some(predicted <= NEGLIGIBLE * self.normal.squares || little);
        }
        self.damping.refuse();
        None
    }
}

#[cfg(test)]
mod nist_tests;
#[cfg(test)]
mod tests;
