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

/// The same with the second derivative of the predictions along a step.
struct Bending(Textbook);

impl Problem for Bending {
    type State = DVector<f64>;

    fn normal_equations(&self, state: &DVector<f64>) -> NormalEquations {
        self.0.normal_equations(state)
    }

    fn stepped(&self, state: &DVector<f64>, change: &DVector<f64>) -> DVector<f64> {
        self.0.stepped(state, change)
    }

    fn is_finite(&self, state: &DVector<f64>) -> bool {
        self.0.is_finite(state)
    }

    fn second_derivative_along(&self, state: &DVector<f64>, change: &DVector<f64>) -> Option<DVector<f64>> {
        let model = self.0.0;
        let small = 1e-3;
        let [behind, ahead] = [-small, small].map(|fraction| model(&(state + change * fraction)).0);
        let (here, jacobian) = model(state);
        Some(jacobian.tr_mul(&((ahead + behind - here * 2.0) / (small * small))))
    }
}

fn solve<P: Problem<State = DVector<f64>>>(
    problem: &P,
    start: &[f64],
    held: &[usize],
) -> Descent<DVector<f64>> {
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

/// Problem 16 of the collection: twenty equations that no parameters satisfy, so that the residuals' own curvature counts.
fn brown_and_dennis(x: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
    let mut residuals = DVector::zeros(20);
    let mut jacobian = DMatrix::zeros(20, 4);
    for index in 0..20 {
        let time = (index as f64 + 1.0) / 5.0;
        let (sine, cosine) = time.sin_cos();
        let (first, second) = (x[0] + time * x[1] - time.exp(), x[2] + sine * x[3] - cosine);
        residuals[index] = first * first + second * second;
        let slopes = [2.0 * first, 2.0 * first * time, 2.0 * second, 2.0 * second * sine];
        jacobian.row_mut(index).copy_from(&DMatrix::from_row_slice(1, 4, &slopes));
    }
    (residuals, jacobian)
}

/// Steps from the collection's own start to the minimum it states, 85822.2.
#[test]
fn large_residuals_are_descended_in_a_few_steps() {
    let descent = solve(&Textbook(brown_and_dennis), &[25.0, 5.0, -5.0, -1.0], &[]);
    // A gain below NO_GAIN of the scatter counts as none.
    let excess = descent.normal.squares - 85822.2;
    assert!((-0.1..NO_GAIN * 85822.2 / 20.0).contains(&excess), "{excess} too much");
    // J'J alone ends 30 above it.
    assert!(descent.converged && descent.steps <= 40, "{} steps", descent.steps);
}

/// Rosenbrock's valley a hundred times as narrow, and as long.
fn narrow_valley(x: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
    (
        DVector::from_vec(vec![1000.0 * (x[1] - x[0] * x[0]), 10.0 - x[0]]),
        DMatrix::from_row_slice(2, 2, &[-2000.0 * x[0], 1000.0, -1.0, 0.0]),
    )
}

#[test]
fn a_step_that_bends_with_its_valley_goes_farther() {
    let start = [-10.0, 100.0];
    let straight = solve(&Textbook(narrow_valley), &start, &[]);
    let bent = solve(&Bending(Textbook(narrow_valley)), &start, &[]);
    assert!(!straight.converged && straight.steps == 500, "{} steps", straight.steps);
    assert!(bent.converged && (bent.state[0] - 10.0).abs() < 1e-3, "{}", bent.state);
    assert!(bent.steps < 250, "{} steps", bent.steps);
}

#[test]
fn a_bent_step_leaves_held_parameters_alone() {
    let descent = solve(&Bending(Textbook(rosenbrock)), &[0.5, 3.0], &[0]);
    assert!(descent.converged);
    assert_eq!(descent.state[0], 0.5);
}

#[test]
fn where_a_valley_is_straight_no_second_derivative_is_asked_for() {
    /// Fails where it is asked.
    struct Straight;
    impl Problem for Straight {
        type State = DVector<f64>;
        fn normal_equations(&self, state: &DVector<f64>) -> NormalEquations {
            let mut normal = NormalEquations::zeros(2);
            normal.take(
                &[3.0 - state[0], 5.0 - state[0] - state[1]],
                &DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 0.0, 1.0]),
            );
            normal
        }
        fn stepped(&self, state: &DVector<f64>, change: &DVector<f64>) -> DVector<f64> {
            state + change
        }
        fn is_finite(&self, _state: &DVector<f64>) -> bool {
            true
        }
        fn second_derivative_along(&self, _: &DVector<f64>, _: &DVector<f64>) -> Option<DVector<f64>> {
            panic!("every step gains what it promises")
        }
    }
    let descent = solve(&Straight, &[0.0, 0.0], &[]);
    assert!(descent.converged && (descent.state - DVector::from_vec(vec![3.0, 2.0])).norm() < 1e-6);
}

/// A run at a state of the narrow valley, with this damping, that is asked for a bent step.
fn bent_step(damping: f64) -> (Option<DVector<f64>>, DVector<f64>, bool) {
    let problem = Bending(Textbook(narrow_valley));
    let state = DVector::from_vec(vec![-3.0, 9.0]);
    let normal = problem.normal_equations(&state);
    let mut run = Run {
        problem: &problem,
        held: &[],
        scales: normal.matrix.diagonal(),
        damping: Damping { value: damping, growth: 2.0 },
        curvature: Curvature::unknown(2),
        bends: true,
        idle: 0,
        refused: 0,
        broken: 0,
        state,
        normal,
    };
    let step = run.damped_step().unwrap();
    let bent = run.bent(step.change.clone(), &step.factor);
    (bent, step.change, run.bends)
}

#[test]
fn how_far_a_step_bends_decides_whether_it_is_tried_and_whether_the_next_is_asked() {
    // Along the valley y = x^2 a step h of x bends y by h^2 to second order: with x' = h, 2 x x' + h^2.
    let (bent, straight, bends) = bent_step(1e-7);
    let bent = bent.unwrap();
    let along = straight[0];
    assert!((bent[1] - (-6.0 * bent[0] + along * along)).abs() < 1e-3 * along * along, "{bent} {straight}");
    assert!(bends);
    // Without damping the step leads across all of the valley: 13 of x bend y by 169, beside the 78 of the straight step.
    let (none, straight, bends) = bent_step(1e-14);
    assert!(none.is_none() && bends && (straight[0] - 13.0).abs() < 0.1, "{straight}");
    // A hundredth as far it hardly bends.
    let (short, straight, bends) = bent_step(1e-3);
    assert!(short.is_some() && !bends && straight[0].abs() < 0.1, "{straight}");
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

#[test]
fn a_full_step_promises_its_gradient_times_itself_and_nothing_of_what_is_held() {
    let mut normal = NormalEquations::zeros(2);
    normal.matrix = DMatrix::from_diagonal(&DVector::from_vec(vec![4.0, 25.0]));
    normal.gradient = DVector::from_vec(vec![6.0, 10.0]);
    // 6^2 / 4 + 10^2 / 25.
    assert!((promised(&normal, &[]) - 13.0).abs() < 1e-12);
    assert!((promised(&normal, &[1]) - 9.0).abs() < 1e-12 && promised(&normal, &[0, 1]) == 0.0);
}

#[test]
fn damping_follows_nielsens_rule_between_its_bounds() {
    let after = |gain_ratio: f64| {
        let mut damping = Damping { value: 1.0, growth: 64.0 };
        damping.accept(gain_ratio);
        assert_eq!(damping.growth, 2.0, "a step that was taken begins anew");
        damping.value
    };
    // 1 - (2g - 1)^3, from a tenth to twice.
    for (gain_ratio, factor) in
        [(0.0, 2.0), (0.25, 1.125), (0.5, 1.0), (0.75, 0.875), (1.0, 0.1), (-3.0, 2.0), (5.0, 0.1)]
    {
        assert!((after(gain_ratio) - factor).abs() < 1e-12, "{gain_ratio}: {}", after(gain_ratio));
    }
    let mut small = Damping { value: 1e-14, growth: 2.0 };
    small.accept(1.0);
    assert_eq!(small.value, LEAST_DAMPING);
    let mut refused = Damping { value: 3.0, growth: 2.0 };
    let grown = [(); 3].map(|()| {
        refused.refuse();
        refused.value
    });
    assert_eq!(grown, [6.0, 24.0, 192.0], "by 2, then 4, then 8");
    let mut none = Damping { value: 0.0, growth: 2.0 };
    none.refuse();
    assert_eq!(none.value, LEAST_REFUSED_DAMPING, "from nothing it begins to grow");
    let exhausted = [0.999e12, 1.001e12].map(|value| Damping { value, growth: 2.0 }.is_exhausted());
    assert_eq!(exhausted, [false, true]);
}

/// A problem of one parameter that says at every state the same of its slope; what becomes of its squares is made up.
struct MadeUp {
    gradient: f64,
    /// Squares after so many steps that were taken.
    squares: fn(u32) -> f64,
    /// Whether stepped states are finite.
    finite: bool,
}

impl Problem for MadeUp {
    type State = u32;

    fn normal_equations(&self, state: &u32) -> NormalEquations {
        let mut normal = NormalEquations::zeros(1);
        normal.matrix[(0, 0)] = 1.0;
        normal.gradient[0] = self.gradient;
        normal.squares = (self.squares)(*state);
        normal.equations = 1000;
        normal
    }

    fn stepped(&self, state: &u32, _: &DVector<f64>) -> u32 {
        state + 1
    }

    fn is_finite(&self, _: &u32) -> bool {
        self.finite
    }
}

fn ended(problem: &MadeUp, damping: f64) -> (u32, usize, bool) {
    let settings = Settings { steps: 60, damping };
    let descent = descend(problem, &0, &[], settings, &Progress::default()).unwrap();
    (descent.state, descent.steps, descent.converged)
}

#[test]
fn a_small_promise_that_is_refused_three_times_ends_a_descent() {
    // Squares of 1000, of which a step promises 0.2 and 0.4; three ten-thousandths are 0.3. Every step makes it worse.
    let worse = |gradient: f64| MadeUp { gradient, squares: |taken| 1000.0 + f64::from(taken), finite: true };
    assert_eq!(ended(&worse(0.2_f64.sqrt()), CAREFUL), (0, 2, true));
    // More than that is tried until the damping is exhausted: 1e-3 grows by 2, 4, 8 ... beyond 1e12 in ten refusals.
    assert_eq!(ended(&worse(0.4_f64.sqrt()), CAREFUL), (0, 10, true));
    // What is promised even then is not negligible: it has not converged.
    let steep = MadeUp { gradient: 1e9, squares: |taken| 1000.0 + f64::from(taken), finite: true };
    assert_eq!(ended(&steep, CAREFUL), (0, 10, false));
}

#[test]
fn a_step_to_where_nothing_is_finite_is_not_taken() {
    let better =
        |finite: bool| MadeUp { gradient: 20.0, squares: |taken| 1000.0 - 300.0 * f64::from(taken), finite };
    assert_eq!(ended(&better(false), CAREFUL).0, 0);
    assert!(ended(&better(true), CAREFUL).0 > 0);
    let infinite =
        MadeUp { gradient: 20.0, squares: |taken| if taken > 0 { f64::NAN } else { 1000.0 }, finite: true };
    assert_eq!(ended(&infinite, CAREFUL).0, 0);
}

#[test]
fn ten_steps_in_a_row_that_gain_next_to_nothing_end_a_descent() {
    // Under a damping of 1e6 a step promises 2e-6 and keeps half of it, so that the damping stays; a full step would promise 1. The scatter of one of
    // 1000 equations is 1, so that less than 3e-3 is nothing.
    let idle = MadeUp { gradient: 1.0, squares: |taken| 1000.0 - 1e-6 * f64::from(taken), finite: true };
    assert_eq!(ended(&idle, 1e6), (10, 10, true));
    // Where the full step promises nothing either, it has converged at once.
    let flat = MadeUp { gradient: 0.05, squares: |taken| 1000.0 - 1e-6 * f64::from(taken), finite: true };
    assert_eq!(ended(&flat, CAREFUL), (0, 0, true));
    // A step that gains something in between begins the count anew. It lets the damping fall to a tenth, where a step promises ten times as much, and keeps half of it as well.
    let moving = MadeUp {
        gradient: 1.0,
        squares: |taken| {
            1000.0
                - 1e-6 * f64::from(taken)
                - if taken > 5 { 0.01 + 1e-5 * f64::from(taken - 5) } else { 0.0 }
        },
        finite: true,
    };
    let (state, ..) = ended(&moving, 1e6);
    assert!(state > 12, "{state}");
}

#[test]
fn short_steps_that_break_their_promise_three_times_end_a_descent_whose_gains_are_small() {
    // Under a damping of 10 a step promises 69; it gains 0.2, where three ten-thousandths of the squares are 0.3.
    let broken = MadeUp { gradient: 20.0, squares: |taken| 1000.0 - 0.2 * f64::from(taken), finite: true };
    assert_eq!(ended(&broken, 10.0), (3, 2, true));
    // Gains that matter are taken, whatever was promised.
    let worthwhile =
        MadeUp { gradient: 20.0, squares: |taken| 1000.0 - 0.4 * f64::from(taken), finite: true };
    assert!(ended(&worthwhile, 10.0).0 > 50);
    // A step under little damping is long: that it gains less shows only that the surroundings are curved.
    assert!(ended(&broken, CAREFUL).0 > 3);
}
