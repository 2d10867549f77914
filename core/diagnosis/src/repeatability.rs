//! Do returns to one pose split in two for no recorded reason? Then no model can be right: the hardware has two places.

use std::cell::OnceCell;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use plumb_kinematics::Motion;

use super::mixture_test::{Lines, Member};
use crate::noise_floor::{Replicates, SIDE_OF_APPROACH, Scatter, allow};
use crate::thresholds::{BASE_OVER_JOINT, REPLICATE_OUTLIER};
use plumb_calibration::effect::{EffectId, Site};
use plumb_calibration::fit::ResidualModel;

/// Replicates that fall into two clusters.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Split {
    /// What lies between the two clusters.
    pub(crate) site: Site,
    /// Distance of the clusters, rad or mm.
    pub(crate) apart: f64,
    /// Whether that is an angle.
    pub(crate) turns: bool,
}

impl Split {
    /// The distance as it is shown, with its unit.
    pub(crate) fn shown(&self) -> (f64, &'static str) {
        if self.turns { (self.apart.to_degrees(), "deg") } else { (self.apart, "mm") }
    }
}

/// Looks for two clusters along every joint's motion, and along ways in which base or target may be in two places. Where two
/// joints do so each is seen only when whatever the other does is left out of account. The clearest first; none, one or two.
pub(crate) fn find_splits(problem: &ResidualModel<'_>, returns: &Replicates) -> Vec<Split> {
    let inquiry = Inquiry::of(returns);
    let ways = joint_ways(problem, returns);
    let at_joint = likeliest(ways.iter().filter_map(|way| inquiry.split(way)));
    let elsewhere = likeliest(inquiry.loose_ways().iter().filter_map(|way| inquiry.split(way)));
    let alone = match (at_joint, elsewhere) {
        // A base that is in two places moves every point; some joint often does nearly the same, and joints slip more often.
        (Some(joint), Some(other)) if other.1 - joint.1 > BASE_OVER_JOINT => Some(other),
        (joint, other) => joint.or(other),
    };
    let first =
        alone.or_else(|| likeliest((0..ways.len()).filter_map(|first| inquiry.another(&ways, first))));
    let second = first.as_ref().and_then(|(split, _)| match split.site {
        Site::Joint(joint) => inquiry.another(&ways, joint),
        _ => None,
    });
    [first, second].into_iter().flatten().map(|(split, _)| split).collect()
}

/// The clearest of several finds, each with how much likelier it is than one cluster.
fn likeliest(found: impl Iterator<Item = (Split, f64)>) -> Option<(Split, f64)> {
    found.max_by(|left, right| left.1.total_cmp(&right.1))
}

/// A way along which returns may be in two places.
#[derive(Clone)]
struct Path {
    site: Site,
    turns: bool,
    /// Per member: how its equations move, whitened.
    along: Vec<DVector<f64>>,
    /// Per member: another way, along which anything may have happened besides.
    beside: Option<Vec<DVector<f64>>>,
    /// What was paid for finding its direction, natural logarithms.
    price: f64,
}

impl Path {
    /// The same with another way left out of account.
    fn beside(&self, other: &Self) -> Self {
        Self { beside: Some(other.along.clone()), ..self.clone() }
    }

    /// Per return: 0 if it is an outlier, else 1. What lies far along a joint's motion may be the other cluster, however long the lever: of
    /// that only what lies far across is an outlier. A base or a target moves by the same amount everywhere.
    fn inliers(&self, deviations: &[DVector<f64>]) -> Vec<f64> {
        let sizes = deviations.iter().zip(&self.along).enumerate().map(|(member, (deviation, way))| {
            if !matches!(self.site, Site::Joint(_)) {
                return deviation.norm();
            }
            let other = self.beside.as_ref().and_then(|beside| beside.get(member));
            Member::of(deviation, way, other).across.sqrt()
        });
        without_outliers(&sizes.collect::<Vec<f64>>())
    }
}

fn joint_ways(problem: &ResidualModel<'_>, returns: &Replicates) -> Vec<Path> {
    let joints = problem.model.chain.joints.iter().enumerate();
    let ways = joints.map(|(joint, row)| {
        let along = returns.motions.iter().map(|motions| motions.get(joint).cloned());
        Path {
            site: Site::Joint(joint),
            turns: row.motion == Motion::Turns,
            along: along.map(|along| along.unwrap_or_else(|| DVector::zeros(0))).collect(),
            beside: None,
            // Its direction is that of the joint: nothing was searched for.
            price: 0.0,
        }
    });
    ways.collect()
}

/// Two clusters along a path.
struct Clusters<'o> {
    /// How far apart they are, rad or mm.
    apart: f64,
    /// How much likelier they are than one, natural logarithms.
    likelier: f64,
    /// What one cluster had best be explained by: deviations without it.
    explained: &'o [DVector<f64>],
}

/// Replicates with everything that may explain them without a second place.
struct Inquiry<'r> {
    returns: &'r Replicates,
    /// By chance a split may look a little like an effect of conditions, which blurs it: it is looked for with all of the
    /// allowed effects taken out, with the first few, and with none.
    ways: Vec<Scatter>,
    /// Columns of the effects of conditions that the floor allows.
    requested: Vec<usize>,
    /// What one cluster has to be explained by: conditions, or the two sides of approach of some joint with a gap that differs from
    /// pose to pose. Each with its price in natural logarithms.
    explained: Vec<(Vec<DVector<f64>>, f64)>,
    /// What one number costs, natural logarithms.
    a_number: f64,
    /// As `explained`, by jumps; worked out where it is asked for.
    jumps: OnceCell<Vec<(Vec<DVector<f64>>, f64)>>,
}

impl<'r> Inquiry<'r> {
    fn of(returns: &'r Replicates) -> Self {
        let (chosen, scatter) = allow(returns);
        let mut requested: Vec<usize> = Vec::new();
        let mut ways = vec![returns.scatter(&requested)];
        for index in chosen {
            requested.extend(returns.candidates.get(index).map_or(0..0, |(_, range)| range.clone()));
            ways.push(returns.scatter(&requested));
        }
        let a_number = 0.5 * (returns.members.len().max(1) as f64).ln();
        let allowed = a_number * requested.len() as f64;
        let price = allowed + a_number * returns.groups as f64;
        let mut explained = vec![(scatter.deviations, allowed)];
        let gaps = returns.candidates.iter().filter(|(id, _)| id.name == SIDE_OF_APPROACH);
        explained.extend(gaps.map(|(_, range)| {
            let columns: Vec<usize> = requested.iter().copied().chain(range.clone()).collect();
            (returns.scatter(&columns).deviations, price)
        }));
        Self { returns, ways, requested, explained, a_number, jumps: OnceCell::new() }
    }

    /// Deviations with nothing explained.
    fn raw(&self) -> &[DVector<f64>] {
        self.ways.first().map(|way| way.deviations.as_slice()).unwrap_or_default()
    }

    /// Base or a target may be in two places: in which direction is read off the returns, and paid for.
    fn loose_ways(&self) -> Vec<Path> {
        let raw = self.raw();
        let sizes: Vec<f64> = raw.iter().map(|deviation| deviation.norm()).collect();
        let kept = without_outliers(&sizes);
        let ways = self.returns.loose.iter().filter_map(|(id, columns)| {
            let direction = farthest(columns, raw, &kept)?;
            let along = columns.iter().map(|columns| columns * &direction).collect();
            // A direction of n numbers has n - 1 of its own: its length is the distance of the clusters.
            let price = self.a_number * (direction.len() as f64 - 1.0);
            Some(Path { site: id.site, turns: id.name == "base_tilt", along, beside: None, price })
        });
        ways.collect()
    }

    /// The clearest split along any way but one joint's, with whatever that joint does left out of account.
    fn another(&self, ways: &[Path], first: usize) -> Option<(Split, f64)> {
        let beside = ways.iter().filter(|way| way.site != Site::Joint(first));
        likeliest(beside.filter_map(|way| self.split(&way.beside(ways.get(first)?))))
    }

    /// One jump of any joint, at a moment between two of the returns, explains them with one cluster as well.
    fn jumps(&self) -> &[(Vec<DVector<f64>>, f64)] {
        self.jumps.get_or_init(|| {
            let steps = self.returns.candidates.iter().filter(|(id, _)| is_event(id));
            let steps: Vec<&Range<usize>> = steps.map(|(_, range)| range).collect();
            let price =
                self.a_number * (self.requested.len() as f64 + 1.0) + (steps.len().max(1) as f64).ln();
            let without = steps.into_iter().map(|range| {
                let columns: Vec<usize> = self.requested.iter().copied().chain(range.clone()).collect();
                (self.returns.scatter(&columns).deviations, price)
            });
            without.collect()
        })
    }

    /// Two clusters along a path, and how much likelier they are than one; nothing if that is not clear. What conditions explain is
    /// no split.
    fn split(&self, path: &Path) -> Option<(Split, f64)> {
        let kept = path.inliers(self.raw());
        // A look at the clusters alone is cheap, and rules most paths out.
        self.clusters(path, &kept, &self.explained)?;
        let ones: Vec<(Vec<DVector<f64>>, f64)> =
            self.explained.iter().chain(self.jumps()).cloned().collect();
        let first = self.clusters(path, &kept, &ones)?;
        // Replicates that are outliers once that is explained which can be make no cluster either.
        let inliers = path.inliers(first.explained);
        let nearer: Vec<f64> = kept.iter().zip(inliers).map(|(kept, inlier)| kept * inlier).collect();
        let best = if nearer == kept { first } else { self.clusters(path, &nearer, &ones)? };
        Some((Split { site: path.site, apart: best.apart, turns: path.turns }, best.likelier))
    }

    /// Two clusters, held against the likeliest of `ones`.
    fn clusters<'o>(
        &self,
        path: &Path,
        kept: &[f64],
        ones: &'o [(Vec<DVector<f64>>, f64)],
    ) -> Option<Clusters<'o>> {
        let likelihoods = ones.iter().filter_map(|(one, price)| {
            Some((self.lines(one, kept, path)?.one_camp() - price, one.as_slice()))
        });
        let (one, explained) = likelihoods.max_by(|left, right| left.0.total_cmp(&right.0))?;
        let clusters = self
            .ways
            .iter()
            .filter_map(|way| self.lines(&way.deviations, kept, path)?.judge(one + path.price));
        let (apart, likelier) = clusters.max_by(|left, right| left.1.total_cmp(&right.1))?;
        Some(Clusters { apart, likelier, explained })
    }
}

impl Inquiry<'_> {
    /// Where the members that are kept lie along a path.
    fn lines(&self, deviations: &[DVector<f64>], kept: &[f64], path: &Path) -> Option<Lines> {
        Lines::along(self.returns, deviations, kept, &path.along, path.beside.as_deref())
    }
}

/// Whether an effect is an event: one jump at one moment.
fn is_event(id: &EffectId) -> bool {
    plumb_calibration::effect::kind(&id.name).is_some_and(|kind| kind.is_event)
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

/// Members that are not outliers: nearer their group's mean than four times what three in four are. (Of two clusters, more than
/// one in four members is far from the mean.)
fn without_outliers(sizes: &[f64]) -> Vec<f64> {
    let mut sorted = sizes.to_vec();
    sorted.sort_by(f64::total_cmp);
    let edge = REPLICATE_OUTLIER * sorted.get(sorted.len() * 3 / 4).copied().unwrap_or(f64::INFINITY);
    sizes.iter().map(|size| f64::from(u8::from(*size <= edge))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replicates_differ_most_in_the_direction_that_moves_them_most_for_its_length() {
        // Two numbers that move one reading each alike; the deviations lie along the second.
        let columns = vec![DMatrix::identity(2, 2); 4];
        let deviations =
            [[0.1, 3.0], [0.0, -3.0], [-0.1, 2.0], [0.0, -2.0]].map(|two| DVector::from_row_slice(&two));
        let found = farthest(&columns, &deviations, &[1.0; 4]).unwrap();
        assert!(found[1].abs() > 0.99 && (found.norm() - 1.0).abs() < 1e-12, "{found}");
        // An outlying replicate along the first does not count once it is left out.
        let mut with_outlier = deviations.to_vec();
        with_outlier[3] = DVector::from_row_slice(&[90.0, 0.0]);
        assert!(farthest(&columns, &with_outlier, &[1.0; 4]).unwrap()[0].abs() > 0.99);
        assert!(farthest(&columns, &with_outlier, &[1.0, 1.0, 1.0, 0.0]).unwrap()[1].abs() > 0.99);
        assert!(farthest(&columns, &deviations, &[0.0; 4]).is_none(), "nothing is kept");
    }

    /// Two poses of five replicates, three equations each, that a base which is in two places moves along its x.
    fn rocking() -> Replicates {
        let sides = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0];
        let aside = [0.03, -0.02, 0.01, 0.04, -0.05, 0.02, -0.01, 0.03, -0.04, 0.01];
        let residuals = sides
            .iter()
            .zip(aside)
            .map(|(side, aside)| DVector::from_row_slice(&[3.0 * side, aside, -aside]));
        Replicates {
            members: (0..10).map(|member| (member, member / 5)).collect(),
            residuals: residuals.collect(),
            columns: vec![DMatrix::zeros(3, 0); 10],
            motions: Vec::new(),
            loose: vec![(EffectId::at("base_position", Site::Base), vec![DMatrix::identity(3, 3); 10])],
            candidates: Vec::new(),
            groups: 2,
        }
    }

    #[test]
    fn of_a_joint_only_what_lies_across_is_an_outlier_and_of_a_base_whatever_lies_far() {
        let far = |along: f64, across: f64| DVector::from_row_slice(&[along, across, 0.0]);
        let mut deviations: Vec<DVector<f64>> = (0..8).map(|_| far(1.0, 1.0)).collect();
        deviations.extend([far(50.0, 1.0), far(1.0, 50.0)]);
        let inliers = |site: Site| {
            let along = vec![DVector::from_row_slice(&[2.0, 0.0, 0.0]); 10];
            let path = Path { site, turns: true, along, beside: None, price: 0.0 };
            path.inliers(&deviations)
        };
        let of_joint = inliers(Site::Joint(0));
        assert!(of_joint[..9].iter().all(|kept| *kept == 1.0) && of_joint[9] == 0.0, "{of_joint:?}");
        let of_base = inliers(Site::Base);
        assert!(of_base[..8].iter().all(|kept| *kept == 1.0) && of_base[8..] == [0.0, 0.0], "{of_base:?}");
    }

    #[test]
    fn a_loose_base_moves_in_the_direction_that_is_read_off_the_returns_and_pays_for_it() {
        let returns = rocking();
        let inquiry = Inquiry::of(&returns);
        // Schwarz: half the logarithm of ten replicates a number.
        assert!((inquiry.a_number - 0.5 * 10.0_f64.ln()).abs() < 1e-12);
        let ways = inquiry.loose_ways();
        assert_eq!((ways.len(), ways[0].site, ways[0].turns), (1, Site::Base, false));
        assert!(ways[0].along.iter().all(|way| way[0].abs() > 0.99), "{:?}", ways[0].along);
        // A direction in space has two numbers of its own.
        assert!((ways[0].price - 10.0_f64.ln()).abs() < 1e-12, "{}", ways[0].price);
    }

    #[test]
    fn the_distance_of_a_split_is_shown_in_the_unit_of_its_motion() {
        let split = |turns: bool, apart: f64| Split { site: Site::Joint(0), turns, apart };
        let (angle, unit) = split(true, 0.01).shown();
        assert!((angle - 0.572_958).abs() < 1e-6 && unit == "deg", "{angle} {unit}");
        assert_eq!(split(false, 0.25).shown(), (0.25, "mm"));
    }

    /// As `rocking`, with joints that move the readings so: one direction a joint.
    fn jointed(residuals: Vec<[f64; 3]>, ways: [[f64; 3]; 2]) -> Replicates {
        let motions = ways.map(|way| DVector::from_row_slice(&way));
        Replicates {
            residuals: residuals.iter().map(|own| DVector::from_row_slice(own)).collect(),
            motions: vec![motions.to_vec(); 10],
            ..rocking()
        }
    }

    /// Two clusters three apart from their middle along x, and what lies beside.
    fn clusters() -> Vec<[f64; 3]> {
        rocking().residuals.iter().map(|own| [own[0], own[1], own[2]]).collect()
    }

    #[test]
    fn a_joint_that_is_in_two_places_is_found_by_its_motion_with_the_distance() {
        let lab = crate::testing::two_links(4, "", 0.05, 1, |_| [0.0; 2]);
        let problem = lab.problem(&[]).unwrap();
        let of = |returns: &Replicates| find_splits(&problem, returns);
        // The second joint moves along x by 2 a radian: 6 apart are 3 rad.
        let found = of(&jointed(clusters(), [[0.0, 1.0, 0.0], [2.0, 0.0, 0.0]]));
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].site == Site::Joint(1) && found[0].turns, "{found:?}");
        assert!((found[0].apart - 3.0).abs() < 0.05, "{found:?}");
        // Where no joint moves that way the base does.
        let found = of(&jointed(clusters(), [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]));
        assert!(found.len() == 1 && found[0].site == Site::Base && !found[0].turns, "{found:?}");
        assert!((found[0].apart - 6.0).abs() < 0.1, "{found:?}");
        // One place, and scatter about it.
        let scattered = clusters().iter().map(|own| [own[1], own[2], own[1]]).collect();
        assert_eq!(of(&jointed(scattered, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])), []);
    }

    #[test]
    fn a_base_in_two_places_must_be_clearly_likelier_than_a_joint() {
        let lab = crate::testing::two_links(4, "", 0.05, 1, |_| [0.0; 2]);
        let problem = lab.problem(&[]).unwrap();
        let mut seen = [0; 2];
        // The joint's motion is the farther from that of the base the more it goes aside.
        for aside in [0.0, 0.01, 0.02, 0.03, 0.05, 0.1, 0.2] {
            let returns = jointed(clusters(), [[0.0, 1.0, 0.0], [2.0, aside, 0.0]]);
            let inquiry = Inquiry::of(&returns);
            let joint = inquiry.split(&joint_ways(&problem, &returns)[1]).unwrap().1;
            let base = inquiry.split(&inquiry.loose_ways()[0]).unwrap().1;
            let found = find_splits(&problem, &returns);
            let expected = if base - joint > BASE_OVER_JOINT { Site::Base } else { Site::Joint(1) };
            assert_eq!(found[0].site, expected, "{aside}: {joint} {base}");
            seen[usize::from(expected == Site::Base)] += 1;
        }
        assert!(seen[0] > 0 && seen[1] > 0, "{seen:?}");
    }

    #[test]
    fn two_joints_in_two_places_are_each_seen_with_the_other_left_out_of_account() {
        let lab = crate::testing::two_links(4, "", 0.05, 1, |_| [0.0; 2]);
        let problem = lab.problem(&[]).unwrap();
        // The first joint moves along y by 1 a radian, the second along x by 2; they change sides independently.
        let sides = [1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, -1.0];
        let both = clusters().into_iter().zip(sides).map(|(own, side)| [own[0], 2.0 * side + own[1], own[2]]);
        let returns = jointed(both.collect(), [[0.0, 1.0, 0.0], [2.0, 0.0, 0.0]]);
        let found = find_splits(&problem, &returns);
        let mut joints: Vec<(Site, f64)> = found.iter().map(|one| (one.site, one.apart)).collect();
        joints.sort_by(|one, other| one.1.total_cmp(&other.1));
        assert_eq!(joints.iter().map(|one| one.0).collect::<Vec<_>>(), [Site::Joint(1), Site::Joint(0)]);
        assert!((joints[0].1 - 3.0).abs() < 0.1 && (joints[1].1 - 4.0).abs() < 0.15, "{joints:?}");
    }

    #[test]
    fn what_explains_returns_without_a_second_place_pays_for_its_numbers() {
        let with = |candidates: Vec<(EffectId, Range<usize>)>| {
            let count = candidates.iter().map(|(_, range)| range.end).max().unwrap_or(0);
            Replicates { candidates, columns: vec![DMatrix::zeros(3, count); 10], ..rocking() }
        };
        let number = 0.5 * 10.0_f64.ln();
        let gap = (EffectId::at(SIDE_OF_APPROACH, Site::Joint(0)), 0..2);
        let step = |joint: usize| (EffectId::at("joint_step", Site::Joint(joint)), 2 + joint..3 + joint);
        let returns = with(vec![gap, step(0), step(1), step(2)]);
        let inquiry = Inquiry::of(&returns);
        // Two poses have a gap each; what the floor allows, nothing, is free.
        let prices: Vec<f64> = inquiry.explained.iter().map(|(_, price)| *price).collect();
        assert!(
            prices.len() == 2 && prices[0] == 0.0 && (prices[1] - 2.0 * number).abs() < 1e-12,
            "{prices:?}"
        );
        // One number, and which of three moments it is.
        let jumps = inquiry.jumps();
        assert_eq!(jumps.len(), 3);
        assert!(jumps.iter().all(|(_, price)| (price - number - 3.0_f64.ln()).abs() < 1e-12));
    }

    #[test]
    fn a_return_is_an_outlier_beyond_four_times_the_upper_quartile() {
        let mut sizes = vec![0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0];
        (sizes[8], sizes[9]) = (0.99 * REPLICATE_OUTLIER, 1.01 * REPLICATE_OUTLIER);
        let kept = without_outliers(&sizes);
        assert!(kept[..9].iter().all(|kept| *kept == 1.0) && kept[9] == 0.0, "{kept:?}");
        assert_eq!(without_outliers(&[]), Vec::<f64>::new());
    }
}
