//! Where an error sits, found from its direction alone. Whatever turns about one joint moves the point along that joint's
//! motion, however its amount varies from pose to pose: what lies across that motion must be noise. So a place is tried
//! by taking the component along its motion out of every row, refitting what is free to the rest, and holding what is
//! left against the floor. Nothing about the mechanism is assumed.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Vector3};

use crate::fitted::Fitted;
use crate::laboratory::Laboratory;
use crate::lack_of_fit::probability_of_noise;
use crate::noise_floor::Floor;
use crate::thresholds::{
    DIRECTION_FREEDOM, DIRECTION_LEVEL, DIRECTION_ROWS, INLIER_QUANTILE, LACK_OF_FIT_LEVEL, OUTLIER_COST,
    SITE_LIKELIHOOD,
};
use plumb_calibration::effect::{Contribution, Dof, Effect, LooksAt, Parameter, Sample, Site, Unit};
use plumb_estimation::{NormalEquations, RankRevealingCholesky, for_each};
use plumb_estimation::{chi_squared_quantile, f_tail, median};

/// What is left when everything along one place's motion is taken out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DirectionTest {
    /// The place.
    pub(crate) site: Site,
    /// Sum of squares across the motion (declared sigmas squared) and its degrees of freedom.
    pub(crate) across: (f64, f64),
    /// The same, and over all directions, on rows that are not outliers in any direction, every instrument's scatter brought to
    /// one: an outlier that happens to lie along the motion says nothing of it, and a level quieter than was declared would make
    /// a tracker's rows look as if something were left in them.
    inliers: ((f64, f64), (f64, f64)),
    /// Variance of one reading at least, declared sigmas squared: of readings that err alike.
    least_variance: f64,
    /// Probability of so much across if the rest is noise.
    pub(crate) p: f64,
}

impl DirectionTest {
    /// Whether everything that is not noise may sit here.
    pub(crate) fn passes(&self) -> bool {
        self.p >= LACK_OF_FIT_LEVEL
    }

    /// Probability of what is left along the motion if it is no more than what is left across: the lack of fit where a
    /// mechanism at this place must show it.
    pub(crate) fn along(&self) -> f64 {
        let (across, whole) = self.inliers;
        let (squares, freedom) = (whole.0 - across.0, whole.1 - across.1);
        // Where nothing is left across, or too little, there is no measure of what is left along.
        if freedom < 1.0 || across.1 < DIRECTION_FREEDOM || across.0 <= 0.0 {
            return 1.0;
        }
        let variance = (across.0 / across.1).max(self.least_variance);
        f_tail(squares.max(0.0) / freedom / variance, freedom, across.1)
    }
}

/// Rows handled at once by one thread.
const CHUNK: usize = 128;

/// A place that may move by any amount in any row.
#[derive(Debug)]
struct Loose {
    site: Site,
    parameters: Vec<Parameter>,
}

impl Loose {
    fn at(site: Site) -> Self {
        // A base tilts about the two horizontal axes; its turn about the vertical is that of a first joint that is upright.
        let numbers = 0..if site == Site::Base { 2 } else { 1 };
        let parameters = numbers.map(|number| Parameter::new(&number.to_string(), Unit::RATIO, (-1.0, 1.0)));
        Self { site, parameters: parameters.collect() }
    }
}

impl Effect for Loose {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        match self.site {
            Site::Joint(joint) => contributions.push(sample.contribute_to_joint(joint, 0, 1.0)),
            _ => {
                let (first, second) = plumb_calibration::arm_model::square_to(&sample.weights.down);
                contributions.extend([first, second].into_iter().enumerate().map(|(parameter, rotation)| {
                    let (shift, about) = (Vector3::zeros(), Vector3::zeros());
                    Contribution {
                        parameter,
                        dof: Dof::Twist { after: 0, shift, rotation, about },
                        rate: 1.0,
                    }
                }));
            }
        }
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Gravity
    }
}

/// Some rows, whitened: residuals, and the free parameters' columns (parameters by equations).
struct Rows {
    residuals: DVector<f64>,
    columns: DMatrix<f64>,
    /// First equation of each row, and one past the last.
    first: Vec<usize>,
}

/// Rows with some directions taken out, and how many equations are left of each.
struct Projected {
    rows: Rows,
    equations: Vec<f64>,
}

impl Rows {
    fn range(&self, row: usize) -> Range<usize> {
        let [start, end] = [row, row + 1].map(|index| self.first.get(index).copied().unwrap_or(0));
        start..end
    }

    fn len(&self) -> usize {
        self.first.len().saturating_sub(1)
    }

    /// Every equation divided by its own scatter.
    fn over(&self, scatter: &DVector<f64>) -> Self {
        Self {
            residuals: self.residuals.component_div(scatter),
            columns: over(&self.columns, scatter),
            first: self.first.clone(),
        }
    }

    /// Takes the motions in `range` of the `directions` (motions by equations) out of every row.
    fn without(&self, directions: &DMatrix<f64>, range: Range<usize>) -> Projected {
        let mut rows = Self {
            residuals: self.residuals.clone(),
            columns: self.columns.clone(),
            first: self.first.clone(),
        };
        let mut equations = Vec::with_capacity(self.len());
        for row in 0..self.len() {
            let own = self.range(row);
            let mut left = own.len() as f64;
            let mut taken: Vec<DVector<f64>> = Vec::new();
            for index in range.clone() {
                let full = directions.view((index, own.start), (1, own.len())).transpose();
                // Gram and Schmidt within the row: what two motions of one place have in common is taken out once.
                let mut direction = full.column(0).into_owned();
                for earlier in &taken {
                    direction -= earlier * earlier.dot(&full);
                }
                let Some(direction) = direction.try_normalize(1e-6 * full.norm().max(1e-9)) else { continue };
                let mut residuals = rows.residuals.rows_mut(own.start, own.len());
                let amount = direction.dot(&residuals);
                residuals.axpy(-amount, &direction, 1.0);
                let mut columns = rows.columns.columns_mut(own.start, own.len());
                let amounts = &columns * &direction;
                columns.ger(-1.0, &amounts, &direction, 1.0);
                left -= 1.0;
                taken.push(direction);
            }
            equations.push(left);
        }
        Projected { rows, equations }
    }
}

/// Normal equations of those rows of a projection that are kept.
struct Kept {
    normal: NormalEquations,
    equations: f64,
    kept: Vec<bool>,
}

impl Kept {
    fn none(projected: &Projected) -> Self {
        let normal = NormalEquations::zeros(projected.rows.columns.nrows());
        Self { normal, equations: 0.0, kept: vec![false; projected.rows.len()] }
    }

    /// Keeps these rows; only those that come or go are counted anew.
    fn keep(&mut self, projected: &Projected, kept: &[bool]) {
        // From turn to turn only a few rows change sides; the sums of thousands of others remain.
        for (is_kept, sign) in [(true, 1.0), (false, -1.0)] {
            let changed: Vec<usize> = (0..projected.rows.len())
                .filter(|row| kept.get(*row) == Some(&is_kept) && self.kept.get(*row) == Some(&!is_kept))
                .collect();
            if changed.is_empty() {
                continue;
            }
            let indices: Vec<usize> = changed.iter().flat_map(|row| projected.rows.range(*row)).collect();
            let residuals: Vec<f64> =
                indices.iter().filter_map(|index| projected.rows.residuals.get(*index)).copied().collect();
            let mut own = NormalEquations::zeros(self.normal.gradient.len());
            own.take(&residuals, &projected.rows.columns.select_columns(&indices));
            match is_kept {
                true => self.normal.add(&own),
                false => self.normal.subtract(&own),
            }
            let equations = changed.iter().filter_map(|row| projected.equations.get(*row));
            self.equations += sign * equations.sum::<f64>();
        }
        self.kept = kept.to_vec();
    }

    /// Sum of squares left by the best linear fit of the free parameters, its degrees of freedom, and that fit.
    fn left(&self, full: &DVector<f64>) -> (f64, f64, DVector<f64>) {
        let (mut matrix, mut gradient) = (self.normal.matrix.clone(), self.normal.gradient.clone());
        // A column that the projection took away whole leaves rounding behind.
        for index in 0..full.len() {
            if matrix[(index, index)] < 1e-10 * full[index] {
                matrix.row_mut(index).fill(0.0);
                matrix.column_mut(index).fill(0.0);
                gradient[index] = 0.0;
            }
        }
        let factor = RankRevealingCholesky::new(&matrix);
        let step = factor.solve(&gradient);
        let squares = (self.normal.squares - gradient.dot(&step)).max(0.0);
        (squares, self.equations - factor.rank() as f64, step)
    }
}

/// [`Kept::left`] of some rows of a projection.
fn left_of(projected: &Projected, kept: &[bool], full: &DVector<f64>) -> (f64, f64) {
    let mut some = Kept::none(projected);
    some.keep(projected, kept);
    let (squares, freedom, _) = some.left(full);
    (squares, freedom)
}

/// A matrix (anything by equations) with every equation's column divided by its scatter.
fn over(columns: &DMatrix<f64>, scatter: &DVector<f64>) -> DMatrix<f64> {
    let mut divided = columns.clone();
    for (mut column, scatter) in divided.column_iter_mut().zip(scatter) {
        column /= *scatter;
    }
    divided
}

/// Per equation: the scatter of its instrument about the best fit, in declared sigmas; nothing if there is but one instrument.
fn scatter(
    all: &Projected,
    kept: &[bool],
    full: &DVector<f64>,
    instruments: &[&str],
) -> Option<DVector<f64>> {
    let first = instruments.first()?;
    if instruments.iter().all(|instrument| instrument == first) {
        return None;
    }
    let mut some = Kept::none(all);
    some.keep(all, kept);
    let (squares, freedom, step) = some.left(full);
    let off = &all.rows.residuals - all.rows.columns.tr_mul(&step);
    // The fit takes degrees of freedom from all instruments together: each bears its part of them.
    let freed = (some.equations / freedom.max(1.0)).sqrt();
    // An instrument read more finely than it was rounded may show no scatter at all, and nothing is divided by zero.
    let least = 1e-3 * (squares / some.equations).sqrt().max(1e-9);
    let mut known: Vec<(&str, f64)> = Vec::new();
    for instrument in instruments {
        if !known.iter().any(|(known, _)| known == instrument) {
            let rows = (0..all.rows.len()).filter(|row| kept.get(*row) == Some(&true));
            let indices = rows.flat_map(|row| all.rows.range(row));
            let own = indices.filter(|index| instruments.get(*index) == Some(instrument));
            let (own, count) =
                own.fold((0.0, 0.0), |(sum, count), index| (sum + off[index] * off[index], count + 1.0));
            // Too few say nothing of their instrument: they are taken to be as good as the rest.
            let variance = if count < DIRECTION_FREEDOM { squares / some.equations } else { own / count };
            known.push((*instrument, variance.sqrt().max(least) * freed));
        }
    }
    let scatter = instruments.iter().map(|instrument| {
        known.iter().find(|(known, _)| known == instrument).map_or(1.0, |(_, scatter)| *scatter)
    });
    Some(DVector::from_iterator(instruments.len(), scatter))
}

/// A place's own view of which rows are outliers: those kept, how far each row is off by its fit, and its scatter.
struct View {
    kept: Vec<bool>,
    distances: Vec<f64>,
    scale: f64,
}

/// A quantile's root by the number of equations.
fn corners(fraction: f64, rows: &Rows) -> Vec<f64> {
    let most = (0..rows.len()).map(|row| rows.range(row).len()).max().unwrap_or(0);
    (0..=most).map(|equations| chi_squared_quantile(fraction, equations as f64).sqrt()).collect()
}

/// The corner of a row of so many equations.
fn corner(corners: &[f64], equations: f64) -> f64 {
    corners.get(equations as usize).copied().unwrap_or(1.0)
}

/// Turns of leaving rows out and fitting the others anew; rows that hop in and out for ever are few and change little.
const TURNS: usize = 9;

/// Leaves rows out that lie far outside the others' scatter, until the same rows stay.
fn view(projected: &Projected, full: &DVector<f64>) -> View {
    let rows = &projected.rows;
    let mut view = View { kept: vec![true; rows.len()], distances: Vec::new(), scale: 1.0 };
    let (typical, farthest) = (corners(0.5, rows), corners(INLIER_QUANTILE, rows));
    let mut some = Kept::none(projected);
    for _ in 0..TURNS {
        some.keep(projected, &view.kept);
        let (_, freedom, step) = some.left(full);
        let off = &rows.residuals - rows.columns.tr_mul(&step);
        view.distances = (0..rows.len())
            .map(|row| off.rows(rows.range(row).start, rows.range(row).len()).norm())
            .collect();
        let measured =
            projected.equations.iter().zip(&view.distances).filter(|(equations, _)| **equations > 0.0);
        // The median of norms over their own medians: half the rows may be outliers and it still gives the scatter of the others.
        let relative: Vec<f64> =
            measured.map(|(equations, off)| off / corner(&typical, *equations)).collect();
        view.scale = median(&relative) * (some.equations / freedom.max(1.0)).sqrt();
        // A row of which the projection left nothing says nothing against anything, and stays.
        let rows = projected.equations.iter().zip(&view.distances);
        let near = rows
            .map(|(equations, off)| *equations <= 0.0 || *off <= view.scale * corner(&farthest, *equations));
        let fresh: Vec<bool> = near.collect();
        if fresh == view.kept {
            break;
        }
        view.kept = fresh;
    }
    view
}

/// What all rows are off for a common scatter, less what noise alone would make it. An outlier costs the same however far
/// it lies and whatever is left of it: a place that calls rows outliers which another explains pays for them.
fn surplus(projected: &Projected, view: &View, scale: f64) -> f64 {
    let farthest = corners(INLIER_QUANTILE, &projected.rows);
    let rows = projected.equations.iter().zip(&view.distances).filter(|(equations, _)| **equations > 0.0);
    let costs = rows.map(|(equations, off)| {
        let squares = (off / scale).powi(2);
        let edge = farthest.get(*equations as usize).copied().unwrap_or(0.0).powi(2);
        // Chi squared of as many equations has their number as its mean.
        if squares > edge { OUTLIER_COST } else { squares - equations }
    });
    costs.sum()
}

/// Everything the test of one table needs: the free parameters' columns, and each site's motion.
struct Setup {
    rows: Rows,
    /// Motions of all sites, by equations.
    directions: DMatrix<f64>,
    /// Each site's motions among them.
    ranges: Vec<(Site, Range<usize>)>,
    /// Squared length of each free parameter's column.
    full: DVector<f64>,
    /// The instrument of each equation.
    instruments: Vec<&'static str>,
}

/// The sites that are asked: every joint, and the base.
fn sites(joints: usize) -> Vec<Loose> {
    (0..joints).map(Site::Joint).chain([Site::Base]).map(Loose::at).collect()
}

/// Where each site's motions are among those of all.
fn motion_ranges(sites: &[Loose]) -> Vec<(Site, Range<usize>)> {
    let mut ranges: Vec<(Site, Range<usize>)> = Vec::new();
    for site in sites {
        let start = ranges.last().map_or(0, |(_, last)| last.end);
        ranges.push((site.site, start..start + site.parameters.len()));
    }
    ranges
}

impl Setup {
    /// Derivatives of some of the fitted rows, spread evenly, by what is fitted and by each site's motion.
    fn of(lab: &Laboratory, fitted: &Fitted<'_>) -> Self {
        let (problem, state) = (&fitted.problem, &fitted.fit.state);
        let measured = lab.measured_rows();
        // Evenly in the order of measuring, so that drifts and all regions of a lattice are kept.
        let stride = measured.len().div_ceil(DIRECTION_ROWS).max(1);
        let chosen: Vec<usize> = measured.into_iter().step_by(stride).collect();
        let sites = sites(lab.model().chain.len());
        let probes: Vec<&dyn Effect> = sites.iter().map(|site| site as &dyn Effect).collect();
        let ones = vec![1.0; lab.table().len()];
        let chunks: Vec<&[usize]> = chosen.chunks(CHUNK).collect();
        let blocks = for_each(&chunks, |chunk| problem.block(state, chunk, &ones, &probes));
        let ranges = motion_ranges(&sites);
        let own = problem.free_parameters().len();
        let width = own + ranges.last().map_or(0, |(_, last)| last.end);
        let mut all = DMatrix::zeros(width, blocks.iter().map(|block| block.residuals.len()).sum());
        let mut residuals = Vec::with_capacity(all.ncols());
        for block in blocks {
            // In the order of the rows, whatever order the threads end in: sums must not depend on the machine.
            all.columns_mut(residuals.len(), block.residuals.len()).copy_from(&block.jacobian);
            residuals.extend(block.residuals);
        }
        let mut first = vec![0];
        for row in &chosen {
            first.push(first.last().copied().unwrap_or(0) + problem.observations.range(*row).len());
        }
        let columns = all.rows(0, own).into_owned();
        let equations = chosen.iter().flat_map(|row| problem.observations.of_row(*row));
        Self {
            full: DVector::from_iterator(own, columns.row_iter().map(|column| column.norm_squared())),
            rows: Rows { residuals: DVector::from_vec(residuals), columns, first },
            directions: all.rows(own, width - own).into_owned(),
            ranges,
            instruments: equations.map(|equation| equation.measurand.kind.instrument()).collect(),
        }
    }

    /// Each site's own view of the rows; sites about which the table says too little are left out.
    fn views(&self) -> Vec<SiteView> {
        let views = for_each(&self.ranges, |(site, range)| {
            let projected = self.rows.without(&self.directions, range.clone());
            let view = view(&projected, &self.full);
            let enough = left_of(&projected, &view.kept, &self.full).1 >= DIRECTION_FREEDOM;
            enough.then(|| SiteView { site: *site, range: range.clone(), projected, view })
        });
        views.into_iter().flatten().collect()
    }

    /// Rows and directions with every instrument's scatter brought to one; nothing if there is but one instrument.
    fn levelled(&self, all: &Projected, inliers: &[bool]) -> Option<(Rows, DMatrix<f64>)> {
        let scatter = scatter(all, inliers, &self.full, &self.instruments)?;
        Some((self.rows.over(&scatter), over(&self.directions, &scatter)))
    }

    /// What is left of the inliers without the motions in `range`: of the levelled rows where there are several instruments, else of `plain`, from which these
    /// motions were taken already.
    fn left_of_inliers(
        &self,
        levelled: Option<&(Rows, DMatrix<f64>)>,
        range: Range<usize>,
        plain: &Projected,
        inliers: &[bool],
    ) -> (f64, f64) {
        match levelled {
            Some((rows, directions)) => left_of(&rows.without(directions, range), inliers, &self.full),
            None => left_of(plain, inliers, &self.full),
        }
    }
}

/// A site, the rows without its motion, and its view of which of them are outliers.
struct SiteView {
    site: Site,
    range: Range<usize>,
    projected: Projected,
    view: View,
}

/// The rows that the likeliest site keeps: all sites are tested on the same rows.
fn rows_of_likeliest(views: &[SiteView]) -> Option<&[bool]> {
    let scale = views.iter().map(|site| site.view.scale).fold(f64::INFINITY, f64::min).max(1e-300);
    let costs = views.iter().map(|site| (surplus(&site.projected, &site.view, scale), site));
    let likeliest = costs.min_by(|left, right| left.0.total_cmp(&right.0));
    likeliest.map(|(_, site)| site.view.kept.as_slice())
}

impl Laboratory {
    /// Tries every joint, and the base, as the one site where everything sits that is not noise. The likeliest first;
    /// sites about which the table says nothing are left out.
    pub(crate) fn direction_tests(&self, fitted: &Fitted<'_>, floor: &Floor) -> Vec<DirectionTest> {
        let setup = Setup::of(self, fitted);
        let full = &setup.full;
        // Every site calls other rows outliers. Sites are compared on the rows of the likeliest, or each would be judged on rows that suit it.
        let views = setup.views();
        let Some(kept) = rows_of_likeliest(&views) else { return Vec::new() };
        let undirected = setup.rows.without(&setup.directions, 0..0);
        let near = view(&undirected, full).kept;
        // Along a motion, which is asked next, a row counts only if it is near in every direction.
        let inliers: Vec<bool> = kept.iter().zip(near).map(|(kept, near)| *kept && near).collect();
        let levelled = setup.levelled(&undirected, &inliers);
        let whole = setup.left_of_inliers(levelled.as_ref(), 0..0, &undirected, &inliers);
        let mut found: Vec<DirectionTest> = for_each(&views, |site| {
            let (squares, freedom) = left_of(&site.projected, kept, full);
            let across =
                setup.left_of_inliers(levelled.as_ref(), site.range.clone(), &site.projected, &inliers);
            DirectionTest {
                site: site.site,
                across: (squares, freedom.max(1.0)),
                inliers: (across, whole),
                least_variance: fitted.problem.least_variance(),
                p: probability_of_noise(squares, freedom, floor).unwrap_or(1.0),
            }
        });
        found.sort_by(|left, right| {
            (left.across.0 / left.across.1).total_cmp(&(right.across.0 / right.across.1))
        });
        found
    }
}

/// How unlikely a site is beside noise of this variance: twice the logarithm of a likelihood, up to a constant.
fn unlikeliness(test: &DirectionTest, variance: f64) -> f64 {
    test.across.0 / variance - test.across.1
}

/// Of some sites those that pass and are not much less likely than the likeliest, in the order given.
fn likely_sites(tests: &[&DirectionTest], variance: f64) -> Vec<Site> {
    let passing: Vec<&&DirectionTest> = tests.iter().filter(|test| test.passes()).collect();
    let least = passing.iter().map(|test| unlikeliness(test, variance)).fold(f64::INFINITY, f64::min);
    let near = passing.iter().filter(|test| unlikeliness(test, variance) - least < SITE_LIKELIHOOD);
    near.map(|test| test.site).collect()
}

/// The sites where everything may sit that is not noise, the likeliest first. A joint goes before the base, whose two
/// rotations take more away. Without a floor the likeliest site is the measure of the others.
pub(crate) fn possible_sites(tests: &[DirectionTest], floor: &Floor) -> Vec<Site> {
    let variance = match (floor.scale, tests.first()) {
        (Some(scale), _) => scale * scale,
        // Relative to the best: then only how much worse the others are is asked.
        (None, Some(best)) => best.across.0 / best.across.1,
        (None, None) => return Vec::new(),
    };
    let (base, joints): (Vec<_>, Vec<_>) = tests.iter().partition(|test| test.site == Site::Base);
    let joints = likely_sites(&joints, variance);
    if joints.is_empty() { likely_sites(&base, variance) } else { joints }
}

/// Sites along whose motion more is left than across it.
pub(crate) fn uneven_sites(tests: &[DirectionTest]) -> Vec<Site> {
    tests.iter().filter(|test| test.along() < DIRECTION_LEVEL).map(|test| test.site).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise_floor::FloorSource;

    const FLOOR: Floor = Floor {
        sigma_mm: Some(1.0),
        source: FloorSource::Declared,
        dof: 0,
        scale: Some(1.0),
        allowed_for: Vec::new(),
    };

    /// A site across whose motion so much is left, on 100 degrees of freedom.
    fn site(site: Site, squares: f64) -> DirectionTest {
        let p = probability_of_noise(squares, 100.0, &FLOOR).unwrap();
        DirectionTest {
            site,
            across: (squares, 100.0),
            inliers: ((squares, 100.0), (squares, 101.0)),
            least_variance: 0.0,
            p,
        }
    }

    #[test]
    fn a_site_is_possible_where_only_noise_is_left_across_its_motion() {
        // Upper 0.2 % point of chi squared with 100 degrees of freedom: 145.6 (R: qchisq(0.998, 100)).
        let tests = [site(Site::Joint(1), 100.0), site(Site::Joint(2), 150.0), site(Site::Base, 90.0)];
        assert!(tests[0].passes() && !tests[1].passes());
        assert!(site(Site::Base, 145.0).passes() && !site(Site::Base, 146.5).passes());
        assert_eq!(possible_sites(&tests, &FLOOR), [Site::Joint(1)], "a joint goes before the base");
        assert_eq!(possible_sites(&tests[1..], &FLOOR), [Site::Base], "the base where no joint passes");
        assert_eq!(possible_sites(&tests[1..2], &FLOOR), []);
    }

    #[test]
    fn a_site_with_more_degrees_of_freedom_may_leave_more() {
        // A normal likelihood: squares over the variance, less a degree of freedom each.
        let test = DirectionTest { across: (40.0, 15.0), ..site(Site::Joint(0), 100.0) };
        assert!((unlikeliness(&test, 2.0) - 5.0).abs() < 1e-12);
    }

    #[test]
    fn a_much_less_likely_site_is_ruled_out_by_a_likelier_one() {
        let near = [site(Site::Joint(0), 100.0), site(Site::Joint(3), 100.0 + 0.9 * SITE_LIKELIHOOD)];
        assert_eq!(possible_sites(&near, &FLOOR), [Site::Joint(0), Site::Joint(3)]);
        let far = [site(Site::Joint(0), 100.0), site(Site::Joint(3), 100.0 + 1.1 * SITE_LIKELIHOOD)];
        assert_eq!(possible_sites(&far, &FLOOR), [Site::Joint(0)]);
    }

    #[test]
    fn what_is_left_along_a_motion_is_held_against_what_is_left_across_it() {
        let test = |along: f64| DirectionTest {
            site: Site::Joint(0),
            across: (20.0, 20.0),
            inliers: ((20.0, 20.0), (20.0 + 3.0 * along, 23.0)),
            least_variance: 0.0,
            p: 1.0,
        };
        // Upper 5 % point of F with 3 and 20 degrees of freedom: 3.0984.
        assert!((test(3.098_391).along() - 0.05).abs() < 1e-6, "{}", test(3.098_391).along());
        // Upper 0.3 % point of F with 3 and 20 degrees of freedom: 6.499 (bracketed).
        let less = DirectionTest { site: Site::Joint(1), ..test(6.2) };
        assert_eq!(uneven_sites(&[less, test(6.8)]), [Site::Joint(0)]);
        // One degree of freedom is enough: upper 5 % point of F with 1 and 100 degrees of freedom: 3.9361.
        let one = |freedom: f64| {
            let whole = (103.936_1, 100.0 + freedom);
            DirectionTest { inliers: ((100.0, 100.0), whole), ..test(1.0) }.along()
        };
        assert!((one(1.0) - 0.05).abs() < 1e-5, "{}", one(1.0));
        assert_eq!(one(0.9), 1.0);
        let enough = DirectionTest { inliers: ((8.0, DIRECTION_FREEDOM), (80.0, 11.0)), ..test(1.0) };
        assert!(enough.along() < 0.001, "{}", enough.along());
        let few = DirectionTest { inliers: ((7.0, 7.0), (70.0, 10.0)), ..test(1.0) };
        assert_eq!(few.along(), 1.0, "too few degrees of freedom say nothing");
        let alike = DirectionTest { least_variance: 4.0, ..test(3.098_391) };
        assert!(alike.along() > 0.5, "readings that err alike are held against what they are uncertain by");
    }

    /// One row of three equations a site, whose motion is x; the residual is given.
    fn rows(residuals: &[[f64; 3]]) -> Rows {
        let flat: Vec<f64> = residuals.iter().flatten().copied().collect();
        let first = (0..=residuals.len()).map(|row| 3 * row).collect();
        Rows { columns: DMatrix::zeros(0, flat.len()), residuals: DVector::from_vec(flat), first }
    }

    #[test]
    fn the_columns_of_equations_are_counted_in_their_own_scatter() {
        let columns = DMatrix::from_row_slice(2, 3, &[2.0, 3.0, 4.0, -1.0, 6.0, 0.5]);
        let divided = over(&columns, &DVector::from_vec(vec![2.0, 3.0, 0.5]));
        assert_eq!(divided, DMatrix::from_row_slice(2, 3, &[1.0, 1.0, 8.0, -0.5, 2.0, 1.0]));
    }

    #[test]
    fn projection_takes_out_what_lies_along_the_motion_and_one_equation_a_row() {
        let rows = rows(&[[5.0, 1.0, 2.0], [-7.0, 2.0, 0.5]]);
        let x = DMatrix::from_row_slice(1, 6, &[2.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
        let projected = rows.without(&x, 0..1);
        assert_eq!(projected.equations, [2.0, 2.0]);
        assert_eq!(projected.rows.residuals.as_slice(), [0.0, 1.0, 2.0, 0.0, 2.0, 0.5]);
        let (squares, freedom) = left_of(&projected, &[true, true], &DVector::zeros(0));
        assert!((squares - 9.25).abs() < 1e-12 && freedom == 4.0);
        // Of a second direction that differs from the first by less than a millionth of its length nothing is left.
        let second = |aside: f64| {
            let both = DMatrix::from_row_slice(
                2,
                6,
                &[1e3, 0.0, 0.0, 1e3, 0.0, 0.0, 1e3, aside, 0.0, 1e3, aside, 0.0],
            );
            rows.without(&both, 0..2).equations
        };
        assert_eq!((second(0.9e-3), second(1.1e-3)), (vec![2.0; 2], vec![1.0; 2]));
        let (squares, freedom) = left_of(&projected, &[true, false], &DVector::zeros(0));
        assert!(
            (squares - 5.0).abs() < 1e-12 && freedom == 2.0,
            "a row that is left out takes its equations along"
        );
    }

    #[test]
    fn each_instrument_is_brought_to_its_own_scatter_and_one_alone_is_left_as_it_is() {
        // Twelve rows: x read to one sigma, y and z by a level three times as noisy; nothing is fitted.
        let residuals: Vec<[f64; 3]> =
            (0..12).map(|row| [1.0, 3.0, -3.0].map(|part| if row % 2 == 0 { part } else { -part })).collect();
        let all = rows(&residuals).without(&DMatrix::zeros(0, 36), 0..0);
        let instruments: Vec<&str> =
            (0..36).map(|equation| if equation % 3 == 0 { "tracker" } else { "level" }).collect();
        let kept = vec![true; 12];
        let found = scatter(&all, &kept, &DVector::zeros(0), &instruments).unwrap();
        assert!(
            (found[0] - 1.0).abs() < 1e-12
                && (found[1] - 3.0).abs() < 1e-12
                && (found[35] - 3.0).abs() < 1e-12
        );
        // Of 36 equations a fit takes twelve, all the tracker's, and each instrument bears a third of that.
        let columns =
            DMatrix::from_fn(12, 36, |parameter, equation| f64::from(u8::from(equation == 3 * parameter)));
        let fitted = rows(&residuals).without(&columns, 0..0);
        let fitted = Projected { rows: Rows { columns, ..fitted.rows }, ..fitted };
        let found = scatter(&fitted, &kept, &DVector::from_element(12, 1.0), &instruments).unwrap();
        assert!((found[1] - 3.0 * 1.5_f64.sqrt()).abs() < 1e-9, "{}", found[1]);
        assert!(scatter(&all, &kept, &DVector::zeros(0), &["tracker"; 36]).is_none());
        // Seven readings say nothing of their instrument: the scatter of all is taken.
        let few: Vec<bool> = (0..12).map(|row| row < 7).collect();
        let common = scatter(&all, &few, &DVector::zeros(0), &instruments).unwrap();
        assert!((common[0] - (19.0_f64 / 3.0).sqrt()).abs() < 1e-12, "{}", common[0]);
    }

    #[test]
    fn a_row_far_outside_the_others_scatter_is_left_out() {
        let mut residuals: Vec<[f64; 3]> =
            (0..40).map(|row| [0.0, 1.0, -1.0].map(|part| part * (1.0 + 0.01 * f64::from(row)))).collect();
        residuals[7] = [0.0, 30.0, 0.0];
        let projected = rows(&residuals).without(&DMatrix::zeros(0, 120), 0..0);
        let view = view(&projected, &DVector::zeros(0));
        assert!(view.kept.iter().enumerate().all(|(row, kept)| *kept == (row != 7)));
    }

    #[test]
    fn sites_come_by_what_is_left_across_their_motion_for_each_degree_of_freedom() {
        let wave = |q: [f64; 2]| [0.0, 0.002 * (7.0 * q[1]).sin()];
        let lab = crate::testing::two_links(60, "joint_zero(*)", 0.05, 4, wave);
        let fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
        let tests = lab.direction_tests(&fitted, &FLOOR);
        assert!(tests.len() > 1 && tests[0].site == Site::Joint(1), "{tests:?}");
        let ratios: Vec<f64> = tests.iter().map(|test| test.across.0 / test.across.1).collect();
        assert!(ratios.windows(2).all(|pair| pair[0] <= pair[1]), "{ratios:?}");
    }

    #[test]
    fn a_base_tilts_about_two_axes_and_a_joint_turns_about_its_own() {
        assert_eq!(Loose::at(Site::Base).parameters().len(), 2);
        assert_eq!(Loose::at(Site::Joint(1)).parameters().len(), 1);
    }

    #[test]
    fn rows_that_come_and_go_leave_the_same_as_if_they_were_gathered_anew() {
        let projected =
            rows(&[[5.0, 1.0, 2.0], [-7.0, 2.0, 0.5], [1.0, 1.0, 1.0]]).without(&DMatrix::zeros(0, 9), 0..0);
        let mut some = Kept::none(&projected);
        for kept in [[true, true, true], [true, false, true], [false, true, true], [false, true, false]] {
            some.keep(&projected, &kept);
            let (squares, freedom, _) = some.left(&DVector::zeros(0));
            let anew = left_of(&projected, &kept, &DVector::zeros(0));
            assert!(
                (squares - anew.0).abs() < 1e-12 && freedom == anew.1,
                "{kept:?}: {squares} {freedom} {anew:?}"
            );
        }
        assert_eq!(left_of(&projected, &[true, false, true], &DVector::zeros(0)), (33.0, 6.0));
    }

    #[test]
    fn a_column_that_is_but_rounding_takes_no_degree_of_freedom() {
        let freedom = |fraction: f64| {
            let mut normal = NormalEquations::zeros(1);
            normal.matrix[(0, 0)] = fraction * 4.0;
            Kept { normal, equations: 9.0, kept: Vec::new() }.left(&DVector::from_element(1, 4.0)).1
        };
        assert_eq!((freedom(0.9e-10), freedom(1e-10), freedom(1.1e-10)), (9.0, 8.0, 8.0));
    }

    #[test]
    fn what_rows_are_off_is_counted_to_the_corner_and_beyond_it_costs_the_same() {
        let projected = rows(&[[0.0; 3]; 2]).without(&DMatrix::zeros(0, 6), 0..0);
        let edge = chi_squared_quantile(INLIER_QUANTILE, 3.0).sqrt();
        let cost = |off: f64, scale: f64| {
            // The other row is off by just its degrees of freedom.
            let distances = vec![off * scale, 3.0_f64.sqrt() * scale];
            surplus(&projected, &View { kept: vec![true; 2], distances, scale: 9.0 }, scale)
        };
        assert!((cost(2.0, 1.0) - 1.0).abs() < 1e-12 && (cost(2.0, 0.5) - 1.0).abs() < 1e-12);
        assert!((cost(0.999 * edge, 1.0) - ((0.999 * edge).powi(2) - 3.0)).abs() < 1e-9);
        assert!((cost(1.001 * edge, 1.0) - OUTLIER_COST).abs() < 1e-9);
        assert!((cost(90.0, 1.0) - OUTLIER_COST).abs() < 1e-9);
    }

    #[test]
    fn a_row_of_which_the_projection_leaves_nothing_says_nothing_and_stays() {
        // Nine rows of three readings, and a row of one, which its own motion takes.
        let single = |taken: bool| {
            let mut residuals: Vec<f64> = (0..9).flat_map(|_| [0.0, 1.0, -1.0]).collect();
            residuals.push(50.0);
            let first = (0..=9).map(|row| 3 * row).chain([28]).collect();
            let rows =
                Rows { columns: DMatrix::zeros(0, 28), residuals: DVector::from_vec(residuals), first };
            let mut motion = DMatrix::zeros(1, 28);
            motion[(0, 27)] = if taken { 2.0 } else { 0.0 };
            rows.without(&motion, 0..1)
        };
        let (taken, seen) = (single(true), single(false));
        assert_eq!((taken.equations[9], seen.equations[9]), (0.0, 1.0));
        let nothing = view(&taken, &DVector::zeros(0));
        assert!(nothing.kept.iter().all(|kept| *kept) && nothing.scale.is_finite());
        // The median of a row of three: its length over the root of the median of chi squared.
        let expected = 2.0_f64.sqrt() / chi_squared_quantile(0.5, 3.0).sqrt();
        assert!((nothing.scale - expected).abs() < 1e-9, "{}", nothing.scale);
        assert!(!view(&seen, &DVector::zeros(0)).kept[9], "where it is seen it is an outlier");
        // Outlier or not, what is not seen costs nothing; nine rows are off by just their degrees of freedom.
        let distances = vec![3.0_f64.sqrt(); 10];
        let cost = surplus(&taken, &View { kept: vec![true; 10], distances, scale: 1.0 }, 1.0);
        assert!(cost.abs() < 1e-12, "{cost}");
    }

    #[test]
    fn a_site_at_the_limit_of_likelihood_is_ruled_out_and_eight_readings_identify_an_instrument() {
        let tests = [site(Site::Joint(0), 100.0), site(Site::Joint(3), 100.0 + SITE_LIKELIHOOD)];
        assert_eq!(possible_sites(&tests, &FLOOR), [Site::Joint(0)]);
        let residuals: Vec<[f64; 3]> = (0..8).map(|_| [1.0, 3.0, 3.0]).collect();
        let all = rows(&residuals).without(&DMatrix::zeros(0, 24), 0..0);
        let instruments: Vec<&str> =
            (0..24).map(|equation| if equation % 3 == 0 { "tracker" } else { "level" }).collect();
        let found = scatter(&all, &[true; 8], &DVector::zeros(0), &instruments).unwrap();
        assert!((found[0] - 1.0).abs() < 1e-12 && (found[1] - 3.0).abs() < 1e-12, "{found}");
    }

    #[test]
    fn an_instrument_that_shows_no_scatter_is_taken_to_have_a_thousandth_of_that_of_all() {
        let all = rows(&[[0.0, 3.0, 3.0]; 9]).without(&DMatrix::zeros(0, 27), 0..0);
        let instruments = ["tracker", "level", "level"].repeat(9);
        let found = scatter(&all, &[true; 9], &DVector::zeros(0), &instruments).unwrap();
        assert!((found[0] - 1e-3 * 6.0_f64.sqrt()).abs() < 1e-12 && (found[1] - 3.0).abs() < 1e-12);
    }
}
