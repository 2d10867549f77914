//! How likely it is that returns are in one position, or in two, along some motion.

use nalgebra::DVector;

use crate::noise_floor::Replicates;
use crate::thresholds::{
    LONGEST_GROUP, SMALLER_CLUSTER, SPLIT_FRACTION, SPLIT_GROUPS, SPLIT_VISIBLE, TWO_OVER_ONE, TWO_OVER_WIDE,
};
use plumb_estimation::median;

/// Members of one group along one joint's motion: how far each lies from the group's mean (rad), and how well that is
/// known for noise of one sigma.
struct Line {
    positions: Vec<f64>,
    spread: f64,
}

/// One return, along its way.
pub(super) struct Member {
    /// How far along it lies, rad or mm.
    along: f64,
    /// Sum of squares across, and how many directions that is.
    pub(super) across: f64,
    freedom: f64,
    /// How far the readings move a unit of the way, sigmas.
    length: f64,
}

impl Member {
    /// `other` may have moved too, by any amount: what lies along it says nothing.
    pub(super) fn of(deviation: &DVector<f64>, way: &DVector<f64>, other: Option<&DVector<f64>>) -> Self {
        let aside = other.and_then(|other| other.clone().try_normalize(1e-9));
        let [deviation, way] = [deviation, way].map(|of| match &aside {
            Some(aside) => of - aside * aside.dot(of),
            None => of.clone(),
        });
        let along = deviation.dot(&way) / way.norm_squared().max(1e-300);
        let freedom = way.len() as f64 - 1.0 - f64::from(u8::from(aside.is_some()));
        let across = (deviation - &way * along).norm_squared();
        Self { along, across, freedom, length: way.norm() }
    }
}

/// All groups' members along one joint's motion, and what lies across it.
pub(super) struct Lines {
    lines: Vec<Line>,
    across: f64,
    freedom: f64,
    typical: f64,
}

impl Lines {
    /// Of members that are kept, along their way through `path`; whatever turns `beside` it is left out of account.
    pub(super) fn along(
        returns: &Replicates,
        deviations: &[DVector<f64>],
        kept: &[f64],
        path: &[DVector<f64>],
        beside: Option<&[DVector<f64>]>,
    ) -> Option<Self> {
        let mut all = Self { lines: Vec::new(), across: 0.0, freedom: 0.0, typical: 0.0 };
        let mut sizes = Vec::new();
        for group in 0..returns.groups {
            let own = (0..returns.members.len()).filter(|member| {
                returns.members.get(*member).is_some_and(|(_, of)| *of == group)
                    && kept.get(*member).is_some_and(|kept| *kept > 0.0)
            });
            let members = own.take(LONGEST_GROUP).filter_map(|member| {
                let other = beside.and_then(|beside| beside.get(member));
                Some(Member::of(deviations.get(member)?, path.get(member)?, other))
            });
            let members: Vec<Member> = members.collect();
            let Some(first) = members.first().filter(|first| first.length > 1e-9 && members.len() > 1) else {
                continue;
            };
            all.across += members.iter().map(|member| member.across).sum::<f64>();
            all.freedom += first.freedom * (members.len() as f64 - 1.0);
            sizes.extend(members.iter().map(|member| (member.along * member.length).abs()));
            let positions = members.iter().map(|member| member.along).collect();
            all.lines.push(Line { spread: 1.0 / first.length, positions });
        }
        all.typical = median(&sizes).max(1e-12);
        // Two clusters have three numbers more than one (where, how far apart, how tight): with fewer returns anything fits.
        (all.lines.iter().map(|line| line.positions.len()).sum::<usize>() >= 6).then_some(all)
    }

    fn sigmas(&self) -> impl Iterator<Item = f64> {
        let typical = self.typical;
        // A grid from a fiftieth of the typical deviation to eight times it: the likelihood of two clusters has several peaks, and a climb would stop at one.
        (0..28).map(move |step| typical * 0.02 * 1.25_f64.powi(step))
    }

    fn across(&self, sigma: f64) -> f64 {
        -self.freedom * sigma.ln() - 0.5 * self.across / (sigma * sigma)
    }

    fn normal(&self, sigma: f64, extra: f64) -> f64 {
        self.across(sigma) + self.lines.iter().map(|line| one_camp(line, sigma, extra)).sum::<f64>()
    }

    /// Greatest log likelihood of one cluster.
    pub(super) fn one_camp(&self) -> f64 {
        self.sigmas().map(|sigma| self.normal(sigma, 0.0)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// How far apart two clusters are, and how much likelier than one cluster, if that is clear.
    pub(super) fn judge(&self, one: f64) -> Option<(f64, f64)> {
        let reach: f64 = self
            .lines
            .iter()
            .flat_map(|line| &line.positions)
            .fold(0.0, |reach, position| f64::max(reach, position.abs()));
        let steps: Vec<f64> = (1..=48).map(|step| 1.1 * reach * f64::from(step) / 48.0).collect();
        let (mut wide, mut two) = (f64::NEG_INFINITY, (f64::NEG_INFINITY, 0.0, 1.0));
        for sigma in self.sigmas() {
            let common = self.across(sigma);
            for step in &steps {
                wide = wide.max(self.normal(sigma, *step));
                let clusters =
                    common + self.lines.iter().map(|line| two_clusters(line, sigma, *step)).sum::<f64>();
                if clusters > two.0 {
                    two = (clusters, *step, sigma);
                }
            }
        }
        let (likelihood, half, sigma) = two;
        // Against one cluster for the find itself, against a wider one so that mere scatter of two sizes is no split.
        let clear = likelihood - one > TWO_OVER_ONE && likelihood - wide > TWO_OVER_WIDE;
        (clear && in_earnest(&self.lines, half, sigma)).then_some((2.0 * half, likelihood - one))
    }
}

fn squares(positions: &[f64]) -> f64 {
    let mean = positions.iter().sum::<f64>() / positions.len().max(1) as f64;
    positions.iter().map(|position| (position - mean).powi(2)).sum()
}

/// Log likelihood of a group scattered about one position, its mean unknown.
fn one_camp(line: &Line, sigma: f64, extra: f64) -> f64 {
    // A wider cluster scatters along the motion besides, by the same number of rad or mm everywhere; noise is the same in mm.
    let variance = (sigma * line.spread).powi(2) + extra * extra;
    let freedom = line.positions.len() as f64 - 1.0;
    -0.5 * (freedom * variance.ln() + squares(&line.positions) / variance) + freedom * line.spread.ln()
}

/// Log likelihood of a group whose members each chose one of two positions `half` to either side, their middle unknown.
fn two_clusters(line: &Line, sigma: f64, half: f64) -> f64 {
    let variance = (sigma * line.spread).powi(2);
    let count = line.positions.len();
    let freedom = count as f64 - 1.0;
    let exponents: Vec<f64> =
        (0..1_u32 << count).map(|pattern| -0.5 * squares(&shifted(line, pattern, half)) / variance).collect();
    // ln of a sum of exponentials, the largest taken out: the others alone would underflow.
    let highest = exponents.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = exponents.iter().map(|exponent| (exponent - highest).exp()).sum();
    highest + sum.ln() - count as f64 * 2.0_f64.ln() - 0.5 * freedom * variance.ln()
        + freedom * line.spread.ln()
}

fn shifted(line: &Line, pattern: u32, half: f64) -> Vec<f64> {
    let positions = line.positions.iter().enumerate();
    let moved = positions
        .map(|(index, position)| if pattern >> index & 1 == 1 { position - half } else { position + half });
    moved.collect()
}

/// Both clusters have a fair share of members, and of the groups that could show it as many hold both as chance would have: a few
/// outlying returns do not make a cluster.
fn in_earnest(lines: &[Line], half: f64, sigma: f64) -> bool {
    let (mut members, mut fewer, mut expected, mut split) = (0.0, 0.0, 0.0, 0.0);
    for line in lines {
        let patterns = 0..1_u32 << line.positions.len();
        let best = patterns
            .min_by(|a, b| squares(&shifted(line, *a, half)).total_cmp(&squares(&shifted(line, *b, half))));
        let high = best.unwrap_or(0).count_ones() as usize;
        let low = line.positions.len() - high;
        let visible = 2.0 * half > SPLIT_VISIBLE * sigma * line.spread;
        if visible && line.positions.len() >= 2 {
            // A fair coin falls on the same side in all of n throws with probability 2 / 2^n; such a group says nothing.
            let all_alike = 2.0 * 0.5_f64.powi(line.positions.len() as i32);
            expected += 1.0 - all_alike;
            split += f64::from(u8::from(high > 0 && low > 0));
            members += line.positions.len() as f64 * (1.0 - all_alike);
            fewer += high.min(low) as f64;
        }
    }
    expected >= SPLIT_GROUPS && split > SPLIT_FRACTION * expected && SMALLER_CLUSTER * fewer >= members
}

#[cfg(test)]
mod tests;
