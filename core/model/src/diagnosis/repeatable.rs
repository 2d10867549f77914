//! Do returns to one pose split in two for no recorded reason? Then no model can be right: the hardware has two places.

use nalgebra::DVector;

use crate::fit::Machine;
use crate::floor::{Returns, allow};
use crate::statistics::median;

/// Returns that fall into two camps.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Split {
    /// The joint whose motion lies between the two camps.
    pub(crate) joint: usize,
    /// Distance of the camps, rad (mm for a sliding joint).
    pub(crate) apart: f64,
}

/// Members of one group along one joint's motion: how far each lies from the group's mean (rad), and how well that is
/// known for noise of one sigma.
struct Line {
    places: Vec<f64>,
    spread: f64,
}

/// How much likelier two camps must be than one, and than a mere larger scatter, in natural logarithms.
const THAN_ONE: f64 = 12.0;
const THAN_WIDE: f64 = 3.0;

/// Groups longer than this are judged by their first members: patterns of camps are counted out one by one.
const LONGEST: usize = 10;

/// Looks for two camps along every joint's motion.
pub(crate) fn find_split(machine: &Machine<'_>, returns: &Returns) -> Option<Split> {
    let (_, scatter) = allow(returns);
    let joints = machine.model.chain.len();
    let found = (0..joints).filter_map(|joint| judge(returns, &scatter.deviations, joint));
    found.max_by(|left, right| left.1.total_cmp(&right.1)).map(|(split, _)| split)
}

fn judge(returns: &Returns, deviations: &[DVector<f64>], joint: usize) -> Option<(Split, f64)> {
    let mut lines = Vec::new();
    let (mut across, mut freedom) = (0.0, 0.0);
    let mut along_all = Vec::new();
    for group in 0..returns.groups {
        let members: Vec<usize> = (0..returns.members.len())
            .filter(|member| returns.members.get(*member).is_some_and(|m| m.1 == group))
            .collect();
        let directions: Vec<&DVector<f64>> =
            members.iter().filter_map(|member| returns.motions.get(*member)?.get(joint)).collect();
        let length = directions.first().map_or(0.0, |direction| direction.norm());
        if members.len() < 2 || directions.len() != members.len() || length < 1e-9 {
            continue;
        }
        let mut places = Vec::new();
        for (member, direction) in members.iter().zip(&directions) {
            let Some(deviation) = deviations.get(*member) else { continue };
            let along = deviation.dot(direction) / direction.norm_squared();
            across += (deviation - *direction * along).norm_squared();
            places.push(along);
            along_all.push(along * length);
        }
        freedom += (members.len() - 1) as f64 * (directions[0].len() as f64 - 1.0);
        places.truncate(LONGEST);
        lines.push(Line { spread: 1.0 / length, places });
    }
    if lines.iter().map(|line| line.places.len()).sum::<usize>() < 6 {
        return None;
    }
    let typical = median(&along_all.iter().map(|along: &f64| along.abs()).collect::<Vec<_>>()).max(1e-12);
    let sigmas: Vec<f64> = (0..28).map(|step| typical * 0.02 * 1.25_f64.powi(step)).collect();
    let reach: f64 =
        lines.iter().flat_map(|line| &line.places).fold(0.0, |reach, place| f64::max(reach, place.abs()));
    let across_likelihood = |sigma: f64| -freedom * sigma.ln() - 0.5 * across / (sigma * sigma);
    let steps: Vec<f64> = (1..=48).map(|step| 1.1 * reach * f64::from(step) / 48.0).collect();
    let (mut one, mut wide, mut two) = (f64::NEG_INFINITY, f64::NEG_INFINITY, (f64::NEG_INFINITY, 0.0, 1.0));
    for sigma in sigmas {
        let common = across_likelihood(sigma);
        let normal = |extra: f64| common + lines.iter().map(|line| one_camp(line, sigma, extra)).sum::<f64>();
        one = one.max(normal(0.0));
        for step in &steps {
            wide = wide.max(normal(*step));
            let camps = common + lines.iter().map(|line| two_camps(line, sigma, *step)).sum::<f64>();
            if camps > two.0 {
                two = (camps, *step, sigma);
            }
        }
    }
    let (likelihood, half, sigma) = two;
    let clear = likelihood - one > THAN_ONE && likelihood - wide > THAN_WIDE;
    let joint_apart = Split { joint, apart: 2.0 * half };
    (clear && in_earnest(&lines, half, sigma)).then_some((joint_apart, likelihood - one))
}

fn squares(places: &[f64]) -> f64 {
    let mean = places.iter().sum::<f64>() / places.len().max(1) as f64;
    places.iter().map(|place| (place - mean).powi(2)).sum()
}

/// Log likelihood of a group scattered about one place, its mean unknown.
fn one_camp(line: &Line, sigma: f64, extra: f64) -> f64 {
    let variance = (sigma * line.spread).powi(2) + extra * extra;
    let freedom = line.places.len() as f64 - 1.0;
    -0.5 * (freedom * variance.ln() + squares(&line.places) / variance) + freedom * line.spread.ln()
}

/// Log likelihood of a group whose members each chose one of two places `half` to either side, their middle unknown.
fn two_camps(line: &Line, sigma: f64, half: f64) -> f64 {
    let variance = (sigma * line.spread).powi(2);
    let count = line.places.len();
    let freedom = count as f64 - 1.0;
    let exponents: Vec<f64> =
        (0..1_u32 << count).map(|pattern| -0.5 * squares(&shifted(line, pattern, half)) / variance).collect();
    let highest = exponents.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = exponents.iter().map(|exponent| (exponent - highest).exp()).sum();
    highest + sum.ln() - count as f64 * 2.0_f64.ln() - 0.5 * freedom * variance.ln()
        + freedom * line.spread.ln()
}

fn shifted(line: &Line, pattern: u32, half: f64) -> Vec<f64> {
    let side = |index: usize| if pattern >> index & 1 == 1 { half } else { -half };
    line.places.iter().enumerate().map(|(index, place)| place - side(index)).collect()
}

/// Both camps have a fair share of members, and in most groups that could show it both are met: a few wild returns do not
/// make a camp.
fn in_earnest(lines: &[Line], half: f64, sigma: f64) -> bool {
    let (mut members, mut fewer, mut able, mut split) = (0, 0, 0, 0);
    for line in lines {
        let patterns = 0..1_u32 << line.places.len();
        let best = patterns
            .min_by(|a, b| squares(&shifted(line, *a, half)).total_cmp(&squares(&shifted(line, *b, half))));
        let high = best.unwrap_or(0).count_ones() as usize;
        let low = line.places.len() - high;
        let visible = 2.0 * half > 3.0 * sigma * line.spread;
        if visible && line.places.len() >= 3 {
            able += 1;
            split += usize::from(high > 0 && low > 0);
            members += line.places.len();
            fewer += high.min(low);
        }
    }
    able > 0 && 2 * split > able && 6 * fewer >= members
}
