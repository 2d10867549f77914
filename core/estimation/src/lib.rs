//! Estimation: numbers only. Least squares by Levenberg-Marquardt, a rank-revealing Cholesky factor, Huber's weights,
//! distributions, multiple testing, and what a long computation needs (progress, cancellation, threads). Knows no robot.

mod distributions;
mod huber;
mod information_criterion;
mod levenberg_marquardt;
mod multiple_testing;
mod normal_equations;
mod parallel;
mod progress;
mod random;
mod rank_revealing_cholesky;

pub use distributions::{chi_squared_quantile, chi_squared_tail, f_tail, normal_quantile, normal_tail};
pub use huber::{huber_constant, huber_variance};
pub use information_criterion::{bic, bic_above};
pub use levenberg_marquardt::{
    CAREFUL, CLOSE, Descent, NEAR, Problem, Settings, descend, descend_from, full_step,
};
pub use multiple_testing::{holm, median};
pub use normal_equations::NormalEquations;
pub use parallel::{for_each, over_chunks};
pub use progress::{Cancelled, Progress};
pub use random::Random;
pub use rank_revealing_cholesky::{INDISTINCT, RankRevealingCholesky};
