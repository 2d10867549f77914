//! Test problems of Moré, Garbow and Hillstrom, Testing Unconstrained Optimization Software (ACM TOMS 7, 1981).

use super::*;

/// Residuals and Jacobian (one row an equation) at given parameters.
type Model = fn(&DVector<f64>) -> (DVector<f64>, DMatrix<f64>);

/// A small problem from a textbook.
struct Textbook(Model);

impl Problem for Textbook {
    type State = DVector<f64>;

    fn normal_equations(&self, state: &DVector<f64>) -> NormalEquations {
        let (residuals, jacobian) = (self.0)(state);
        let mut normal = NormalEquations::zeros(state.len());
        normal.take((-residuals).as_slice(), &jacobian.transpose());
        normal
    }

    fn stepped(&self, state: &DVector<f64>, change: &DVector<f64>) -> DVector<f64> {
        state + change
    }

    fn is_finite(&self, state: &DVector<f64>) -> bool {
        state.iter().all(|value| value.is_finite())
    }
}

fn solve(problem: &Textbook, start: &[f64], held: &[usize]) -> Descent<DVector<f64>> {
    let settings = Settings { steps: 500, damping: CAREFUL };
    let start = DVector::from_column_slice(start);
    descend(problem, &start, held, settings, &Progress::unwatched()).unwrap()
}

/// Problem 1 of the collection.
fn rosenbrock(x: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
    (
        DVector::from_vec(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]),
        DMatrix::from_row_slice(2, 2, &[-20.0 * x[0], 10.0, -1.0, 0.0]),
    )
}

/// Problem 13: the Jacobian is singular at the minimum, which lies at the origin.
fn powell_singular(x: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
    let (root5, root10) = (5.0_f64.sqrt(), 10.0_f64.sqrt());
    let (inner, outer) = (x[1] - 2.0 * x[2], x[0] - x[3]);
    let residuals = vec![x[0] + 10.0 * x[1], root5 * (x[2] - x[3]), inner * inner, root10 * outer * outer];
    let jacobian = [
        1.0,
        10.0,
        0.0,
        0.0, //
        0.0,
        0.0,
        root5,
        -root5, //
        0.0,
        2.0 * inner,
        -4.0 * inner,
        0.0, //
        2.0 * root10 * outer,
        0.0,
        0.0,
        -2.0 * root10 * outer,
    ];
    (DVector::from_vec(residuals), DMatrix::from_row_slice(4, 4, &jacobian))
}

#[test]
fn rosenbrocks_valley_is_followed_to_its_minimum() {
    let descent = solve(&Textbook(rosenbrock), &[-1.2, 1.0], &[]);
    assert!(descent.converged, "{} steps", descent.steps);
    assert!((descent.state - DVector::from_vec(vec![1.0, 1.0])).norm() < 1e-6);
}

#[test]
fn powells_singular_function_comes_down_to_nothing() {
    let descent = solve(&Textbook(powell_singular), &[3.0, -1.0, 0.0, 1.0], &[]);
    assert!(descent.converged && descent.normal.squares < 1e-12, "{}", descent.normal.squares);
    assert!(descent.state.norm() < 1e-2, "{}", descent.state);
}

#[test]
fn a_held_parameter_stays_and_the_others_reach_the_best_beside_it() {
    // With x0 held at 0.5 the minimum of Rosenbrock's function is x1 = x0^2.
    let descent = solve(&Textbook(rosenbrock), &[0.5, 3.0], &[0]);
    assert!(descent.converged);
    assert_eq!(descent.state[0], 0.5);
    // What is left, 0.5 of one equation, is taken as scatter: a gain below NO_GAIN of it counts as none.
    assert!(100.0 * (descent.state[1] - 0.25).powi(2) < NO_GAIN * 0.25 / 2.0, "{}", descent.state);
}

#[test]
fn a_descent_that_runs_out_of_steps_says_so() {
    let settings = Settings { steps: 2, damping: CAREFUL };
    let start = DVector::from_vec(vec![-1.2, 1.0]);
    let descent = descend(&Textbook(rosenbrock), &start, &[], settings, &Progress::unwatched()).unwrap();
    assert!(!descent.converged && descent.steps == 2);
}

#[test]
fn a_cancelled_descent_ends() {
    let progress = Progress::unwatched();
    progress.cancel();
    let settings = Settings { steps: 2, damping: CAREFUL };
    let start = DVector::from_vec(vec![-1.2, 1.0]);
    assert!(descend(&Textbook(rosenbrock), &start, &[], settings, &progress).is_err());
}

#[test]
fn a_full_step_solves_a_linear_problem_at_once() {
    // Longley-like: a straight line through four points, y = 2 + 3 x.
    fn line(x: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let jacobian = DMatrix::from_row_slice(4, 2, &[1.0, 0.0, 1.0, 1.0, 1.0, 2.0, 1.0, 3.0]);
        (&jacobian * x - DVector::from_vec(vec![2.0, 5.0, 8.0, 11.0]), jacobian)
    }
    let start = DVector::from_vec(vec![0.0, 0.0]);
    let step = full_step(&Textbook(line).normal_equations(&start), &[]);
    assert!((step - DVector::from_vec(vec![2.0, 3.0])).norm() < 1e-9);
}
