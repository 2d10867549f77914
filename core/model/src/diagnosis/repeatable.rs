//! Do returns to one pose split in two for no recorded reason? Then no model can be right: the hardware has two places.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use plumb_kinematics::Motion;

use crate::effect::Spot;
use crate::fit::Machine;
use crate::floor::{Returns, SIDE_OF_APPROACH, Scatter, allow};
use crate::statistics::median;

/// Returns that fall into two camps.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Split {
    /// What lies between the two camps.
    pub(crate) spot: Spot,
    /// Distance of the camps, rad or mm.
    pub(crate) apart: f64,
    /// Whether that is an angle.
    pub(crate) turns: bool,
}

impl Split {
    /// What it is, in words.
    pub(crate) fn told(&self, place: &str) -> String {
        let (apart, unit) = if self.turns { (self.apart.to_degrees(), "deg") } else { (self.apart, "mm") };
        let figure = super::wording::figure(apart);
        format!(
            "returns to one pose fall into two camps about {figure} {unit} apart at {place}, for no reason the table records"
        )
    }
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

/// How much likelier base or tool must be than a joint, in natural logarithms: joints slip, feet and flanges seldom do.
const THAN_JOINT: f64 = 6.0;

/// Groups longer than this are judged by their first members: patterns of camps are counted out one by one.
const LONGEST: usize = 10;

/// Looks for two camps along every joint's motion. What conditions explain is no split: two camps must be likelier than
/// one with all those effects of conditions allowed for that the floor allows.
pub(crate) fn find_split(machine: &Machine<'_>, returns: &Returns) -> Option<Split> {
    let (chosen, scatter) = allow(returns);
    let joints = machine.model.chain.len();
    // By chance a split may look a little like an effect of conditions, which blurs it: it is looked for with all of the
    // allowed effects taken out, with the first few, and with none.
    let mut wanted: Vec<usize> = Vec::new();
    let mut ways = vec![returns.scatter(&wanted)];
    let kept = ways.first().map(|raw| without_wild(&raw.deviations)).unwrap_or_default();
    for index in chosen {
        wanted.extend(returns.candidates.get(index).map_or(0..0, |(_, range)| range.clone()));
        ways.push(returns.scatter(&wanted));
    }
    // Or the camps are the two sides of approach of some joint, with a gap that differs from pose to pose: one number a
    // group, each of which must earn its keep.
    let sides: Vec<Scatter> = returns
        .candidates
        .iter()
        .filter(|(id, _)| id.name == SIDE_OF_APPROACH)
        .map(|(_, range)| returns.scatter(&wanted.iter().copied().chain(range.clone()).collect::<Vec<_>>()))
        .collect();
    let a_number = 0.5 * (returns.members.len().max(1) as f64).ln();
    let price = a_number * returns.groups as f64;
    let allowed = a_number * wanted.len() as f64;
    let joint_motions = (0..joints).map(|joint| {
        let turns = machine.model.chain.joints.get(joint).is_some_and(|joint| joint.motion == Motion::Turns);
        let of =
            |motions: &Vec<DVector<f64>>| motions.get(joint).cloned().unwrap_or_else(|| DVector::zeros(0));
        let along = returns.motions.iter().map(of).collect();
        Path { spot: Spot::Joint(joint), turns, along, price: 0.0 }
    });
    // Or the base or a target stands in two places: in which direction is read off the returns, and paid for.
    let raw = ways.first().map(|way| way.deviations.as_slice()).unwrap_or_default();
    let shifts = returns.loose.iter().filter_map(|(id, columns)| {
        let direction = farthest(columns, raw, &kept)?;
        let along = columns.iter().map(|columns| columns * &direction).collect();
        let price = a_number * (direction.len() as f64 - 1.0);
        Some(Path { spot: id.spot, turns: id.name == "base_tilt", along, price })
    });
    let paths: Vec<Path> = joint_motions.chain(shifts).collect();
    let found = paths.iter().filter_map(|path| {
        // What one camp has to be explained by: conditions, a gap between the sides of approach, or one jump at a moment between
        // two of the returns. Each with its price.
        let mut ones: Vec<(Vec<DVector<f64>>, f64)> = vec![(scatter.deviations.clone(), allowed)];
        ones.extend(sides.iter().map(|side| (side.deviations.clone(), allowed + price)));
        let jumps: Vec<&Range<usize>> = returns
            .candidates
            .iter()
            .filter(|(id, _)| id.name == "joint_step" && id.spot == path.spot)
            .map(|(_, range)| range)
            .collect();
        let jump_price = a_number + (jumps.len().max(1) as f64).ln();
        ones.extend(jumps.iter().map(|range| {
            let columns: Vec<usize> = wanted.iter().copied().chain((*range).clone()).collect();
            (returns.scatter(&columns).deviations, allowed + jump_price)
        }));
        let judged = |kept: &[f64]| {
            let along = |deviations: &[DVector<f64>]| Lines::along(returns, deviations, kept, &path.along);
            let likelihoods =
                ones.iter().filter_map(|(one, price)| Some((along(one)?.one_camp() - price, one)));
            let (one, explained) = likelihoods.max_by(|left, right| left.0.total_cmp(&right.0))?;
            let camps = ways.iter().filter_map(|way| along(&way.deviations)?.judge(one + path.price));
            Some((camps.max_by(|left, right| left.1.total_cmp(&right.1))?, explained))
        };
        let (first, explained) = judged(&kept)?;
        // Returns that are wild once that is explained which can be make no camp either.
        let tamer: Vec<f64> =
            kept.iter().zip(without_wild(explained)).map(|(kept, tame)| kept * tame).collect();
        let best = if tamer == kept { first } else { judged(&tamer)?.0 };
        Some((Split { spot: path.spot, apart: best.0, turns: path.turns }, best.1))
    });
    let (at_joints, elsewhere): (Vec<_>, Vec<_>) =
        found.partition(|(split, _): &(Split, f64)| matches!(split.spot, Spot::Joint(_)));
    let likeliest =
        |found: Vec<(Split, f64)>| found.into_iter().max_by(|left, right| left.1.total_cmp(&right.1));
    match (likeliest(at_joints), likeliest(elsewhere)) {
        (Some(joint), Some(other)) if other.1 - joint.1 > THAN_JOINT => Some(other.0),
        (joint, other) => joint.or(other).map(|(split, _)| split),
    }
}

/// A motion along which returns may stand in two places.
struct Path {
    spot: Spot,
    turns: bool,
    /// Per member: how its equations move, whitened.
    along: Vec<DVector<f64>>,
    /// What was paid for finding its direction, natural logarithms.
    price: f64,
}

/// The direction, unit length, in which some numbers must differ to do most of what returns differ by.
fn farthest(columns: &[DMatrix<f64>], deviations: &[DVector<f64>], kept: &[f64]) -> Option<DVector<f64>> {
    let count = columns.first()?.ncols();
    let (mut all, mut differing) = (DMatrix::zeros(count, count), DMatrix::zeros(count, count));
    for ((columns, deviation), kept) in columns.iter().zip(deviations).zip(kept) {
        if *kept > 0.0 && columns.nrows() == deviation.len() {
            all += columns.tr_mul(columns);
            let seen = columns.tr_mul(deviation);
            differing.ger(1.0, &seen, &seen, 1.0);
        }
    }
    let lower = all.cholesky()?.l();
    let half = lower.solve_lower_triangular(&differing)?;
    let white = lower.solve_lower_triangular(&half.transpose())?;
    let eigen = (&white + white.transpose()).symmetric_eigen();
    let most = eigen.eigenvalues.imax();
    let direction =
        lower.transpose().solve_upper_triangular(&eigen.eigenvectors.column(most).into_owned())?;
    direction.try_normalize(1e-300)
}

/// Members that are not wild: nearer their group's mean than four times what three in four are. (Of two camps, more than
/// one in four members is far from the mean.)
fn without_wild(deviations: &[DVector<f64>]) -> Vec<f64> {
    let mut sizes: Vec<f64> = deviations.iter().map(|deviation| deviation.norm()).collect();
    sizes.sort_by(f64::total_cmp);
    let edge = 4.0 * sizes.get(sizes.len() * 3 / 4).copied().unwrap_or(f64::INFINITY);
    deviations.iter().map(|deviation| f64::from(u8::from(deviation.norm() <= edge))).collect()
}

/// All groups' members along one joint's motion, and what lies across it.
struct Lines {
    lines: Vec<Line>,
    across: f64,
    freedom: f64,
    typical: f64,
}

impl Lines {
    fn along(
        returns: &Returns,
        deviations: &[DVector<f64>],
        kept: &[f64],
        path: &[DVector<f64>],
    ) -> Option<Self> {
        let mut all = Self { lines: Vec::new(), across: 0.0, freedom: 0.0, typical: 0.0 };
        let mut sizes = Vec::new();
        for group in 0..returns.groups {
            let own = |member: &usize| {
                returns.members.get(*member).is_some_and(|m| m.1 == group)
                    && kept.get(*member).is_some_and(|kept| *kept > 0.0)
            };
            let members: Vec<usize> = (0..returns.members.len()).filter(own).take(LONGEST).collect();
            let motion = |member: &usize| path.get(*member);
            let Some(length) =
                members.first().and_then(motion).map(|motion| motion.norm()).filter(|length| *length > 1e-9)
            else {
                continue;
            };
            if members.len() < 2 {
                continue;
            }
            let mut places = Vec::new();
            for member in &members {
                let (Some(deviation), Some(direction)) = (deviations.get(*member), motion(member)) else {
                    continue;
                };
                let along = deviation.dot(direction) / direction.norm_squared();
                all.across += (deviation - direction * along).norm_squared();
                all.freedom += direction.len() as f64 - 1.0;
                places.push(along);
                sizes.push((along * length).abs());
            }
            all.freedom -=
                members.first().and_then(motion).map_or(0.0, |direction| direction.len() as f64 - 1.0);
            all.lines.push(Line { spread: 1.0 / length, places });
        }
        all.typical = median(&sizes).max(1e-12);
        (all.lines.iter().map(|line| line.places.len()).sum::<usize>() >= 6).then_some(all)
    }

    fn sigmas(&self) -> impl Iterator<Item = f64> {
        let typical = self.typical;
        (0..28).map(move |step| typical * 0.02 * 1.25_f64.powi(step))
    }

    fn across(&self, sigma: f64) -> f64 {
        -self.freedom * sigma.ln() - 0.5 * self.across / (sigma * sigma)
    }

    fn normal(&self, sigma: f64, extra: f64) -> f64 {
        self.across(sigma) + self.lines.iter().map(|line| one_camp(line, sigma, extra)).sum::<f64>()
    }

    /// Greatest log likelihood of one camp.
    fn one_camp(&self) -> f64 {
        self.sigmas().map(|sigma| self.normal(sigma, 0.0)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// How far apart two camps are, and how much likelier than one camp, if that is clear.
    fn judge(&self, one: f64) -> Option<(f64, f64)> {
        let reach: f64 = self
            .lines
            .iter()
            .flat_map(|line| &line.places)
            .fold(0.0, |reach, place| f64::max(reach, place.abs()));
        let steps: Vec<f64> = (1..=48).map(|step| 1.1 * reach * f64::from(step) / 48.0).collect();
        let (mut wide, mut two) = (f64::NEG_INFINITY, (f64::NEG_INFINITY, 0.0, 1.0));
        for sigma in self.sigmas() {
            let common = self.across(sigma);
            for step in &steps {
                wide = wide.max(self.normal(sigma, *step));
                let camps = common + self.lines.iter().map(|line| two_camps(line, sigma, *step)).sum::<f64>();
                if camps > two.0 {
                    two = (camps, *step, sigma);
                }
            }
        }
        let (likelihood, half, sigma) = two;
        let clear = likelihood - one > THAN_ONE && likelihood - wide > THAN_WIDE;
        (clear && in_earnest(&self.lines, half, sigma)).then_some((2.0 * half, likelihood - one))
    }
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

/// Both camps have a fair share of members, and of the groups that could show it as many hold both as chance would have: a few
/// wild returns do not make a camp.
fn in_earnest(lines: &[Line], half: f64, sigma: f64) -> bool {
    let (mut members, mut fewer, mut expected, mut split) = (0.0, 0.0, 0.0, 0.0);
    for line in lines {
        let patterns = 0..1_u32 << line.places.len();
        let best = patterns
            .min_by(|a, b| squares(&shifted(line, *a, half)).total_cmp(&squares(&shifted(line, *b, half))));
        let high = best.unwrap_or(0).count_ones() as usize;
        let low = line.places.len() - high;
        let visible = 2.0 * half > 3.0 * sigma * line.spread;
        if visible && line.places.len() >= 2 {
            let all_alike = 2.0 * 0.5_f64.powi(line.places.len() as i32);
            expected += 1.0 - all_alike;
            split += f64::from(u8::from(high > 0 && low > 0));
            members += line.places.len() as f64 * (1.0 - all_alike);
            fewer += high.min(low) as f64;
        }
    }
    expected >= LEAST_SPLIT && split > 0.55 * expected && 6.0 * fewer >= members
}

/// Groups that must be expected to hold both camps before anything is said.
const LEAST_SPLIT: f64 = 0.9;
