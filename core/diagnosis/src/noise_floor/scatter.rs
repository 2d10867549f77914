//! The scatter among replicates, and which of them are outliers.

use nalgebra::{DMatrix, DVector};

use super::replicates::Replicates;
use crate::thresholds::INLIER_QUANTILE;
use plumb_estimation::RankRevealingCholesky;
use plumb_estimation::{chi_squared_quantile, median};

/// Rounds in which sigma and the outliers are found from each other. They settle in three or four.
const ROUNDS: usize = 10;

/// Of one group only what lies nearly as far out as its farthest is left out at once: an outlier draws the mean of its group along, and with it the
/// deviations of all others, by a half of its own in a group of three and by less in a larger one.
const NEARLY_AS_FAR: f64 = 0.7;

/// What is left among returns.
pub(crate) struct Scatter {
    /// Per member: deviation from its group's mean, in declared sigmas.
    pub(crate) deviations: Vec<DVector<f64>>,
    /// Degrees of freedom.
    pub(crate) freedom: usize,
    /// One sigma, in declared sigmas.
    pub(crate) sigma: f64,
    /// Sum of squares without the outliers.
    pub(crate) squares: f64,
    /// Per member: 0 of an outlier, else 1.
    kept: Vec<f64>,
}

impl Replicates {
    /// Scatter left after a fit of the `wanted` columns; returns far outside the bulk are left out.
    pub(crate) fn scatter(&self, requested: &[usize]) -> Scatter {
        let mut kept = vec![1.0; self.members.len()];
        let (mut deviations, mut rank) = self.fitted(&kept, requested);
        // Sigma and the outliers need each other: the first sigma is one that outliers hardly move.
        let mut sigma = self.typical(&deviations, &kept);
        for _ in 0..ROUNDS {
            let before = kept.clone();
            // One layer at a time: the worst outlier draws its group's mean along and makes sound members look far out.
            while self.leave_out_farthest(&mut kept, &deviations, sigma) {
                (deviations, rank) = self.fitted(&kept, requested);
            }
            if self.take_back(&mut kept, &deviations, sigma) {
                (deviations, rank) = self.fitted(&kept, requested);
            }
            sigma = self.sigma(&deviations, &kept, rank);
            if kept == before {
                break;
            }
        }
        let squares =
            deviations.iter().zip(&kept).map(|(deviation, kept)| kept * deviation.norm_squared()).sum();
        Scatter { freedom: self.freedom(&kept).saturating_sub(rank), deviations, sigma, squares, kept }
    }

    fn sigma(&self, deviations: &[DVector<f64>], kept: &[f64], rank: usize) -> f64 {
        let squares: f64 =
            deviations.iter().zip(kept).map(|(deviation, kept)| kept * deviation.norm_squared()).sum();
        (squares / self.freedom(kept).saturating_sub(rank).max(1) as f64).sqrt()
    }

    /// What each candidate would take away of the squares that `wanted` columns leave, and with how many parameters of
    /// its own.
    pub(crate) fn gains(&self, scatter: &Scatter, requested: &[usize]) -> Vec<(f64, usize)> {
        let all: Vec<usize> = (0..self.columns.first().map_or(0, DMatrix::ncols)).collect();
        // Of the same members as the scatter: were outliers judged anew for each candidate, one could explain them by leaving them out.
        let (deviations, columns) = self.centred(&scatter.kept, &all);
        let all = (deviations.as_slice(), columns.as_slice());
        let (known, rank) = explained(all, &scatter.kept, requested);
        self.candidates
            .iter()
            .map(|(_, range)| {
                let chosen: Vec<usize> = requested.iter().copied().chain(range.clone()).collect();
                let (with, with_rank) = explained(all, &scatter.kept, &chosen);
                // More columns take more away, but for rounding.
                ((with - known).max(0.0), with_rank.saturating_sub(rank))
            })
            .collect()
    }

    /// Deviations after the columns' least-squares fit, and how many columns mattered.
    fn fitted(&self, kept: &[f64], requested: &[usize]) -> (Vec<DVector<f64>>, usize) {
        let (mut deviations, columns) = self.centred(kept, requested);
        if requested.is_empty() {
            return (deviations, 0);
        }
        let all: Vec<usize> = (0..requested.len()).collect();
        let (matrix, gradient) = sums(&deviations, &columns, kept, &all);
        let factor = RankRevealingCholesky::new(&matrix);
        let solution = factor.solve(&gradient);
        for (deviation, column) in deviations.iter_mut().zip(&columns) {
            *deviation -= column * &solution;
        }
        (deviations, factor.rank())
    }

    /// How many members of each group are kept.
    fn sizes(&self, kept: &[f64]) -> Vec<f64> {
        let mut sizes = vec![0.0; self.groups];
        for ((_, group), kept) in self.members.iter().zip(kept) {
            if let Some(size) = sizes.get_mut(*group) {
                *size += kept;
            }
        }
        sizes
    }

    /// How far out each member lies: the norm of its deviation over the norm that a fraction `inside` of sound members stays below where one sigma is 1. A
    /// member that is kept is part of its group's mean, so that its deviation is smaller than its error; that of one left out is larger.
    fn distances(&self, deviations: &[DVector<f64>], kept: &[f64], inside: f64) -> Vec<f64> {
        let sizes = self.sizes(kept);
        let distances = deviations.iter().enumerate().map(|(member, deviation)| {
            let group = self.members.get(member).map_or(0, |(_, group)| *group);
            let size = sizes.get(group).copied().unwrap_or(0.0);
            // Var(x - mean of n with x among them) = 1 - 1/n; without x it is 1 + 1/n.
            let variance = match kept.get(member).is_some_and(|kept| *kept > 0.0) {
                true => 1.0 - 1.0 / size.max(2.0),
                false => 1.0 + 1.0 / size.max(1.0),
            };
            deviation.norm() / (chi_squared_quantile(inside, deviation.len().max(1) as f64) * variance).sqrt()
        });
        distances.collect()
    }

    /// A first sigma that a few outliers do not change: from the median deviation.
    fn typical(&self, deviations: &[DVector<f64>], kept: &[f64]) -> f64 {
        // Distances over their own medians: half of sound members lie inside, so the median is sigma.
        let typical = median(&self.distances(deviations, kept, 0.5));
        if typical.is_finite() { typical } else { 0.0 }
    }

    /// Leaves out of each group the members that lie farthest beyond the inlier quantile, never all of it; whether there were any.
    fn leave_out_farthest(&self, kept: &mut [f64], deviations: &[DVector<f64>], sigma: f64) -> bool {
        let distances = self.distances(deviations, kept, INLIER_QUANTILE);
        let mut farthest: Vec<Option<usize>> = vec![None; self.groups];
        let mut nearest = farthest.clone();
        let of_kept: Vec<usize> = (0..kept.len()).filter(|member| kept[*member] > 0.0).collect();
        for member in &of_kept {
            let group = self.members[*member].1;
            if farthest[group].is_none_or(|other| distances[*member] > distances[other]) {
                farthest[group] = Some(*member);
            }
            if nearest[group].is_none_or(|other| distances[*member] <= distances[other]) {
                nearest[group] = Some(*member);
            }
        }
        let mut out = of_kept;
        out.retain(|member| {
            let group = self.members[*member].1;
            let most = farthest[group].map_or(f64::INFINITY, |farthest| distances[farthest]);
            distances[*member] > sigma
                && distances[*member] >= NEARLY_AS_FAR * most
                // One of a group stays, or the group would have no mean.
                && nearest[group] != Some(*member)
        });
        out.iter().for_each(|member| kept[*member] = 0.0);
        !out.is_empty()
    }

    /// Takes back what was left out and lies within the inlier quantile of the others after all; whether there was any.
    fn take_back(&self, kept: &mut [f64], deviations: &[DVector<f64>], sigma: f64) -> bool {
        let distances = self.distances(deviations, kept, INLIER_QUANTILE);
        let back: Vec<usize> =
            (0..kept.len()).filter(|member| kept[*member] == 0.0 && distances[*member] <= sigma).collect();
        back.iter().for_each(|member| kept[*member] = 1.0);
        !back.is_empty()
    }
}

/// Normal equations of some columns.
fn sums(
    deviations: &[DVector<f64>],
    columns: &[DMatrix<f64>],
    kept: &[f64],
    chosen: &[usize],
) -> (DMatrix<f64>, DVector<f64>) {
    let mut matrix = DMatrix::zeros(chosen.len(), chosen.len());
    let mut gradient = DVector::zeros(chosen.len());
    for ((deviation, column), kept) in deviations.iter().zip(columns).zip(kept) {
        let picked = column.select_columns(chosen);
        matrix += picked.tr_mul(&picked) * *kept;
        gradient += picked.tr_mul(deviation) * *kept;
    }
    (matrix, gradient)
}

/// What some columns take away of the squares of deviations, and with how many parameters.
fn explained(
    (deviations, columns): (&[DVector<f64>], &[DMatrix<f64>]),
    kept: &[f64],
    chosen: &[usize],
) -> (f64, usize) {
    if chosen.is_empty() {
        return (0.0, 0);
    }
    let (matrix, gradient) = sums(deviations, columns, kept, chosen);
    let factor = RankRevealingCholesky::new(&matrix);
    (gradient.dot(&factor.solve(&gradient)), factor.rank())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four members of one group and two of another, with three equations each.
    fn two_groups() -> Replicates {
        let groups = [0, 0, 0, 0, 1, 1];
        Replicates {
            members: groups.into_iter().enumerate().collect(),
            residuals: vec![DVector::zeros(3); 6],
            columns: vec![DMatrix::zeros(3, 0); 6],
            motions: Vec::new(),
            loose: Vec::new(),
            candidates: Vec::new(),
            groups: 2,
        }
    }

    const KEPT: [f64; 6] = [1.0, 1.0, 0.0, 1.0, 1.0, 1.0];

    #[test]
    fn a_member_lies_as_far_out_as_its_deviation_and_its_part_in_the_mean_say() {
        let all = two_groups();
        assert_eq!(all.sizes(&KEPT), [3.0, 2.0]);
        let deviations = vec![DVector::from_vec(vec![2.0, 0.0, 0.0]); 6];
        // Median of chi squared with three degrees of freedom: 2.36597. One of n lies 1 - 1/n from its mean, one left out 1 + 1/n.
        let variances: [f64; 6] = [2.0 / 3.0, 2.0 / 3.0, 4.0 / 3.0, 2.0 / 3.0, 0.5, 0.5];
        let distances = all.distances(&deviations, &KEPT, 0.5);
        for (distance, variance) in distances.iter().zip(variances) {
            let expected = 2.0 / (2.365_974 * variance).sqrt();
            assert!((distance / expected - 1.0).abs() < 1e-5, "{distance} for {expected}");
        }
        assert!(
            (all.typical(&deviations, &KEPT) / distances[0] - 1.0).abs() < 1e-12,
            "four of six lie there"
        );
    }

    #[test]
    fn only_what_lies_nearly_as_far_as_the_farthest_is_left_out_at_once_and_one_of_a_group_stays() {
        let all = two_groups();
        let with = |lengths: [f64; 6], sigma: f64| {
            let mut kept = vec![1.0; 6];
            let deviations = lengths.map(|length| DVector::from_vec(vec![length, 0.0, 0.0]));
            let any = all.leave_out_farthest(&mut kept, &deviations, sigma);
            assert_eq!(any, kept.contains(&0.0));
            kept
        };
        assert_eq!(with([100.0, 71.0, 69.0, 1.0, 1.0, 1.0], 1.0), [0.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
        assert_eq!(with([69.0, 71.0, 100.0, 1.0, 1.0, 1.0], 1.0), [1.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        assert_eq!(
            with([100.0, 71.0, 69.0, 1.0, 1.0, 1.0], 1e3),
            [1.0; 6],
            "nothing is beyond such a scatter"
        );
        let pair = with([1.0, 1.0, 1.0, 1.0, 100.0, 100.0], 1.0);
        assert_eq!(pair.iter().sum::<f64>(), 5.0, "of two that lie alike one stays: {pair:?}");
    }

    #[test]
    fn what_was_left_out_is_taken_back_where_it_lies_within_the_others_after_all() {
        let all = two_groups();
        let with = |length: f64, sigma: f64| {
            let mut kept = KEPT.to_vec();
            let mut deviations = vec![DVector::zeros(3); 6];
            deviations[2][1] = length;
            (all.take_back(&mut kept, &deviations, sigma), kept[2])
        };
        // It lies 1 + 1/3 from the mean of the three others.
        let edge = (chi_squared_quantile(INLIER_QUANTILE, 3.0) * 4.0 / 3.0).sqrt();
        assert_eq!((with(0.999 * edge, 1.0), with(1.001 * edge, 1.0)), ((true, 1.0), (false, 0.0)));
        assert_eq!(with(1.999 * edge, 2.0), (true, 1.0));
    }

    #[test]
    fn columns_explain_what_of_the_kept_members_lies_along_them() {
        let along = |value: f64| DVector::from_vec(vec![value, 1.0, 0.0]);
        let deviations = [along(3.0), along(-1.0), along(50.0)];
        // The second column is twice the first, the third moves the second coordinate.
        let column = DMatrix::from_row_slice(3, 3, &[1.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0]);
        let columns = [column.clone(), -&column, column];
        let kept = [1.0, 1.0, 0.0];
        let (matrix, gradient) = sums(&deviations, &columns, &kept, &[0, 2]);
        assert_eq!(matrix, DMatrix::from_row_slice(2, 2, &[2.0, 0.0, 0.0, 8.0]));
        assert_eq!(gradient.as_slice(), [4.0, 0.0]);
        let explains = |chosen: &[usize]| explained((&deviations, &columns), &kept, chosen);
        // (3 + 1) squared over 2.
        let (squares, rank) = explains(&[0]);
        assert!((squares - 8.0).abs() < 1e-9 && rank == 1, "{squares}");
        let (squares, rank) = explains(&[0, 1, 2]);
        assert!((squares - 8.0).abs() < 1e-6 && rank == 2, "{squares} {rank}");
        assert_eq!(explains(&[]), (0.0, 0));
    }
}
