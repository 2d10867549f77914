//! Poses one after the other, each where the effects in question differ most given those before.

use nalgebra::{DMatrix, DVector};

use super::design::{Design, Designer, PoseRequest, Sensing};
use super::pictures::falls_on_its_surfaces;
use super::rivals::Rival;
use super::view::View;
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::project::{self, Surface};
use crate::thresholds::{DESIGN_ROUNDS, PLENTY, POSES_TRIED, SETTLES};
use plumb_calibration::effect::{self, Kind};
use plumb_calibration::fit::ResidualModel;
use plumb_calibration::measurement::Observations;
use plumb_estimation::{Progress, Random, for_each};

/// First width of the changes to the best pose, as a fraction of each joint's range; halved each round.
const FIRST_WIDTH: f64 = 0.15;

/// Predictions and derivatives of all rivals at some poses.
pub(super) struct Forecast {
    /// Per rival and design: readings, derivatives (readings by free parameters), both in units of sigma.
    pub(super) rivals: Vec<Vec<(DVector<f64>, DMatrix<f64>)>>,
    reach_allowed: Vec<bool>,
}

/// The best pose so far.
struct Best {
    worth: f64,
    design: Design,
    /// Its derivatives, for each rival.
    rows: Vec<DMatrix<f64>>,
    /// By how much it puts each pair apart, squared standard errors.
    pairs: Vec<f64>,
}

/// Poses, and how far they put each pair of rivals apart: second before first, `(1, 0)`, `(2, 0)`, `(2, 1)` and so on.
pub(super) struct Choice {
    pub(super) designs: Vec<Design>,
    /// Standard errors.
    pub(super) apart: Vec<f64>,
}

impl Choice {
    /// Least separation of the pairs that are distinguished; of none is, the greatest.
    pub(super) fn separation(&self) -> f64 {
        let distinguished = self.apart.iter().copied().filter(|apart| *apart >= SETTLES);
        let least = distinguished.fold(f64::INFINITY, f64::min);
        if least.is_finite() { least } else { self.apart.iter().copied().fold(0.0, f64::max) }
    }

    /// Least separation of all pairs.
    pub(super) fn least(&self) -> f64 {
        let asked = self.apart.iter().copied().filter(|apart| apart.is_finite());
        asked.reduce(f64::min).unwrap_or(0.0)
    }

    /// Pairs that stay alike.
    pub(super) fn alike<'l>(&self, labels: &'l [String]) -> Vec<(&'l str, &'l str)> {
        let pairs = labels.iter().enumerate();
        let pairs = pairs.flat_map(|(first, one)| labels.iter().take(first).map(move |other| (other, one)));
        let alike = pairs.zip(&self.apart).filter(|(_, apart)| **apart < SETTLES);
        alike.map(|((one, other), _)| (one.as_str(), other.as_str())).collect()
    }
}

/// Chooses poses.
pub(super) struct Chooser<'a> {
    pub(super) designer: Designer<'a>,
    pub(super) rivals: Vec<Rival>,
    noise: f64,
    pub(super) sensing: Sensing,
    /// Where the arm's own sensor triggered, if it is all that measures.
    surface: Option<Surface>,
    /// What a camera on the hand can see of a board, if it is what measures.
    view: Option<View>,
    /// Whether each rival is to be distinguished from the first alone: the others are what the rows do not show, and need no distinguishing.
    from_first: bool,
}

impl<'a> Chooser<'a> {
    pub(super) fn new(lab: &'a Laboratory, rivals: Vec<Rival>, noise: f64) -> Result<Self, LaboratoryError> {
        let mut effects = lab.fitted_effects()?;
        let surface = rivals.first().and_then(|rival| {
            effects.extend(rival.effects.iter().cloned());
            Surface::of(lab, &rival.state, &effects)
        });
        let mut asked = rivals.iter().flat_map(|rival| &rival.effects);
        let designer = Designer {
            lab,
            surface: surface.as_ref().map(|surface| surface.name.clone()),
            waits: lab.table().time.is_some()
                && asked.any(|effect| effect::kind(&effect.id.name).is_some_and(Kind::changes_gradually)),
            both_directions: false,
        };
        let view = View::of(lab);
        Ok(Self { designer, rivals, noise, sensing: Sensing::AsBefore, surface, view, from_first: false })
    }

    /// Asks for poses that distinguish each rival from the first; from one another they need not.
    pub(super) fn separate_from_first(&mut self) {
        self.from_first = true;
        self.designer.both_directions = true;
    }

    /// The rivals as written.
    pub(super) fn labels(&self) -> Vec<String> {
        self.rivals.iter().map(|rival| rival.label.clone()).collect()
    }

    /// Brings poses onto the surface the sensor is to trigger over; those that cannot be are left out.
    fn projected(&self, designs: Vec<Design>) -> Result<Vec<Design>, LaboratoryError> {
        let (Some(surface), Some(rival)) = (&self.surface, self.rivals.first()) else { return Ok(designs) };
        let lab = self.designer.lab;
        let mut effects = lab.fitted_effects()?;
        effects.extend(rival.effects.iter().cloned());
        let mut table = self.designer.table(&designs, self.sensing);
        let ranges: Vec<(f64, f64)> = (0..table.joints).map(|joint| self.designer.range(joint)).collect();
        let reached = project::onto_surface(lab, surface, (&rival.state, &effects), &mut table, &ranges)?;
        let rows = designs.into_iter().enumerate().zip(reached).filter(|(_, reached)| *reached);
        Ok(rows.map(|((row, design), _)| Design { q: table.q_of(row).to_vec(), ..design }).collect())
    }

    /// Poses one after the other, each where the rivals differ most given those before: pairs that are apart already count little.
    pub(super) fn choose(
        &mut self,
        request: PoseRequest<'_>,
        progress: &Progress,
    ) -> Result<Choice, LaboratoryError> {
        // The same poses for the same question: what is asked twice must not be answered differently.
        let mut rng = Random::seeded(11);
        let mut known = Known::before(&self.rivals);
        let mut designs: Vec<Design> = Vec::new();
        for index in 0..request.count {
            progress.report(0.7 + 0.3 * index as f64 / request.count as f64, "choosing poses")?;
            let Some(best) = self.best(request, &known, &mut rng)? else { break };
            // What a pose will show is known before it is measured: in a linear model the covariance does not depend on the reading.
            known.learn(&best, self.noise);
            designs.push(best.design);
        }
        Ok(Choice { designs, apart: known.apart.into_iter().map(root).collect() })
    }

    /// The best of many poses drawn anywhere, improved by small changes.
    fn best(
        &self,
        request: PoseRequest<'_>,
        known: &Known,
        rng: &mut Random,
    ) -> Result<Option<Best>, LaboratoryError> {
        let drawn = (0..POSES_TRIED).map(|_| self.designer.anywhere(request, rng)).collect();
        let mut designs = self.projected(drawn)?;
        let mut best: Option<Best> = None;
        for round in 0..=DESIGN_ROUNDS {
            let forecast = self.forecast(&designs, request)?;
            let allowed: Vec<usize> =
                (0..designs.len()).filter(|index| forecast.reach_allowed[*index]).collect();
            let worths = for_each(&allowed, |index| self.worth(&forecast, *index, known));
            for (index, (worth, pairs)) in allowed.into_iter().zip(worths) {
                if best.as_ref().is_none_or(|best| worth > best.worth) {
                    let rows = forecast.rivals.iter().map(|all| all[index].1.clone()).collect();
                    best = Some(Best { worth, design: designs[index].clone(), rows, pairs });
                }
            }
            let Some(Best { design: centre, .. }) = &best else { break };
            // Half as wide each round: random search with shrinking steps needs no derivative by joints, limits and keep-out planes.
            let width = FIRST_WIDTH / f64::from(1 << round);
            let near = (0..POSES_TRIED / 4).map(|_| self.designer.near(centre, width, rng)).collect();
            designs = self.projected(near)?;
        }
        Ok(best)
    }

    /// What a pose is worth beside those before, and by how much it puts each pair of rivals apart (squared standard errors); for
    /// a single model, how little is known there.
    fn worth(&self, forecast: &Forecast, index: usize, known: &Known) -> (f64, Vec<f64>) {
        // How uncertain each rival's own prediction is: J C J', by the law of propagation (JCGM 100:2008, section 5).
        let at = forecast.rivals.iter().zip(&known.covariances);
        let spreads: Vec<DMatrix<f64>> =
            at.map(|(all, covariance)| &all[index].1 * covariance * all[index].1.transpose()).collect();
        if let [alone] = spreads.as_slice() {
            return (alone.trace(), Vec::new());
        }
        let mut pairs = Vec::with_capacity(known.apart.len());
        for first in 0..spreads.len() {
            for second in 0..first {
                if self.from_first && second > 0 {
                    pairs.push(f64::NAN);
                    continue;
                }
                let difference = &forecast.rivals[first][index].0 - &forecast.rivals[second][index].0;
                pairs.push(separation(&difference, &spreads[first] + &spreads[second], self.noise));
            }
        }
        (worth_of_pairs(&known.apart, &pairs), pairs)
    }

    /// What every rival predicts at these poses.
    pub(super) fn forecast(
        &self,
        designs: &[Design],
        request: PoseRequest<'_>,
    ) -> Result<Forecast, LaboratoryError> {
        let lab = self.designer.lab;
        let mut model = lab.model().clone();
        if self.sensing == Sensing::SecondPoint {
            // A second point off the flange's axis: what a single point cannot see, two do.
            let side = SECOND_POINT * model.chain.reach().max(100.0);
            if let Some(target) = model.targets.first_mut() {
                target.xyz.x += side;
                target.xyz.y += side;
            }
        }
        let table = self.designer.table(designs, self.sensing);
        let observations = Observations::new(&model, &table)?;
        let ones = vec![1.0; designs.len()];
        let start = lab.fitted_effects()?;
        let mut rivals = Vec::new();
        let mut reach_allowed = vec![true; designs.len()];
        for rival in &self.rivals {
            let mut effects = start.clone();
            effects.extend(rival.effects.iter().cloned());
            let problem = ResidualModel::new(&model, &table, &observations, &effects)?;
            let mut state = rival.state.clone();
            if self.sensing == Sensing::SecondPoint
                && let (Some(moved), Some(target)) = (state.targets.first_mut(), model.targets.first())
            {
                *moved += target.xyz - lab.model().targets.first().map_or(target.xyz, |target| target.xyz);
            }
            let mut all = Vec::new();
            for (row, allowed) in reach_allowed.iter_mut().enumerate() {
                let block = problem.block(&state, &[row], &ones, &[]);
                *allowed &= (!table.is_of_stripes() && table.profiles.is_empty())
                    || falls_on_its_surfaces(&observations, row, &block.residuals);
                all.push((-DVector::from_vec(block.residuals), block.jacobian.transpose()));
                *allowed &= problem.stays_clear(&state, row, request.keep_out)
                    && self.view.is_none_or(|view| view.sees(&problem, &state, row));
            }
            rivals.push(all);
        }
        Ok(Forecast { rivals, reach_allowed })
    }
}

/// How far off the axis a second point is taken to be, as a fraction of the arm's reach.
const SECOND_POINT: f64 = 0.2;

/// What is known after the poses chosen so far.
struct Known {
    /// Of each rival's parameters.
    covariances: Vec<DMatrix<f64>>,
    /// How far each pair of rivals is apart, squared standard errors.
    apart: Vec<f64>,
}

impl Known {
    fn before(rivals: &[Rival]) -> Self {
        let pairs = rivals.len() * rivals.len().saturating_sub(1) / 2;
        Self {
            covariances: rivals.iter().map(|rival| rival.covariance.clone()).collect(),
            apart: vec![0.0; pairs],
        }
    }

    fn learn(&mut self, best: &Best, noise: f64) {
        self.apart.iter_mut().zip(&best.pairs).for_each(|(apart, more)| *apart += more);
        for (covariance, row) in self.covariances.iter_mut().zip(&best.rows) {
            learn(covariance, row, noise);
        }
    }
}

/// The root of squared standard errors. Pairs that nobody asks about stay no number.
fn root(squared: f64) -> f64 {
    if squared.is_nan() { squared } else { squared.max(0.0).sqrt() }
}

/// Squared standard errors between two predictions that differ so, where what is not known of both scatters as `spread`, and each
/// reading by `noise`.
fn separation(difference: &DVector<f64>, spread: DMatrix<f64>, noise: f64) -> f64 {
    let readings = DMatrix::identity(difference.len(), difference.len()) * (2.0 * noise * noise);
    let factor = (spread + readings).cholesky();
    factor.map_or(0.0, |factor| difference.dot(&factor.solve(difference)))
}

/// How much of a pair's question is answered, 0 to 1, at a squared separation.
fn answered(squared: f64) -> f64 {
    squared / (squared + PLENTY * PLENTY)
}

/// What a pose is worth that adds so much to the separation of each pair.
fn worth_of_pairs(apart: &[f64], more: &[f64]) -> f64 {
    let asked = apart.iter().zip(more).filter(|(_, more)| more.is_finite());
    asked.map(|(apart, more)| answered(apart + more) - answered(*apart)).sum()
}

/// What is known once readings with these derivatives have been taken: the Kalman update of a covariance.
fn learn(covariance: &mut DMatrix<f64>, jacobian: &DMatrix<f64>, noise: f64) {
    // C - C J' (J C J' + R)^-1 J C (Kalman 1960): no reading is needed to know how much one will say.
    let across = &*covariance * jacobian.transpose();
    let variance =
        jacobian * &across + DMatrix::identity(jacobian.nrows(), jacobian.nrows()) * (noise * noise);
    if let Some(factor) = variance.cholesky() {
        *covariance -= &across * factor.solve(&across.transpose());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_predictions_are_apart_by_their_difference_over_its_standard_error() {
        // Difference (3, 4), no parameter uncertainty, noise 1 each: variance 2 a reading, so 25 / 2.
        let difference = DVector::from_vec(vec![3.0, 4.0]);
        assert!((separation(&difference, DMatrix::zeros(2, 2), 1.0) - 12.5).abs() < 1e-12);
        let spread = DMatrix::from_diagonal_element(2, 2, 2.0);
        assert!(
            (separation(&difference, spread, 1.0) - 6.25).abs() < 1e-12,
            "what is not known counts as noise"
        );
    }

    #[test]
    fn a_pair_that_is_apart_is_worth_less_than_one_that_is_not() {
        let plenty = PLENTY * PLENTY;
        assert!((answered(plenty) - 0.5).abs() < 1e-12);
        assert!(
            worth_of_pairs(&[0.0, 4.0 * plenty], &[plenty, 0.0])
                > worth_of_pairs(&[0.0, 4.0 * plenty], &[0.0, plenty])
        );
        assert_eq!(
            worth_of_pairs(&[0.0, 1.0], &[plenty, f64::NAN]),
            0.5,
            "a pair nobody asks about counts nothing"
        );
    }

    #[test]
    fn a_reading_takes_away_what_it_shows() {
        // Prior variance 4 of a number read once with noise 2: posterior 2 (the harmonic sum of 4 and 4).
        let mut covariance = DMatrix::from_row_slice(2, 2, &[4.0, 0.0, 0.0, 9.0]);
        learn(&mut covariance, &DMatrix::from_row_slice(1, 2, &[1.0, 0.0]), 2.0);
        assert!((covariance - DMatrix::from_row_slice(2, 2, &[2.0, 0.0, 0.0, 9.0])).norm() < 1e-12);
    }

    fn choice(apart: &[f64]) -> Choice {
        Choice { designs: Vec::new(), apart: apart.to_vec() }
    }

    #[test]
    fn the_separation_is_the_least_of_pairs_distinguished_else_the_greatest() {
        assert_eq!(choice(&[1.1 * SETTLES, 9.0, 0.9 * SETTLES]).separation(), 1.1 * SETTLES);
        assert_eq!(choice(&[0.2, 0.9 * SETTLES]).separation(), 0.9 * SETTLES);
        assert_eq!(choice(&[4.0, f64::NAN, 2.0]).least(), 2.0);
        assert!(root(f64::NAN).is_nan());
    }

    #[test]
    fn pairs_that_stay_alike_are_listed_in_the_order_of_the_pairs() {
        let labels = ["a", "b", "c"].map(str::to_owned);
        // Pairs: b before a, c before a, c before b.
        assert_eq!(choice(&[5.0, 0.9 * SETTLES, 1.1 * SETTLES]).alike(&labels), [("a", "c")]);
    }

    #[test]
    fn what_a_rival_predicts_is_where_the_point_is_and_a_second_point_sits_off_the_axis() {
        let lab = crate::testing::two_links(8, "", 0.05, 73, |_| [0.0; 2]);
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let unit = crate::noise_floor::typical_sigma(&fitted.problem);
        let rival = Rival::of("as it is".to_owned(), Vec::new(), &fitted);
        let mut chooser = Chooser::new(&lab, vec![rival], 1.0).unwrap();
        let design = |q: [f64; 2]| Design { q: q.to_vec(), approach: vec![0, 0], payload: 0.0, wait: 0.0 };
        let designs = [design([0.5, -1.0]), design([-0.3, 0.2])];
        let request = || PoseRequest { count: 0, keep_out: &[], payloads: &[] };
        for (sensing, side) in [(Sensing::AsBefore, 0.0), (Sensing::SecondPoint, SECOND_POINT * 350.0)] {
            chooser.sensing = sensing;
            let forecast = chooser.forecast(&designs, request()).unwrap();
            assert_eq!((forecast.rivals.len(), forecast.reach_allowed.as_slice()), (1, &[true, true][..]));
            for (index, design) in designs.iter().enumerate() {
                let (first, both) = (design.q[0], design.q[0] + design.q[1]);
                let x = 200.0 * first.cos() + (150.0 + side) * both.cos() - side * both.sin();
                let y = 200.0 * first.sin() + (150.0 + side) * both.sin() + side * both.cos();
                let found = &forecast.rivals[0][index].0 * unit;
                let expected = DVector::from_vec(vec![x, y, 0.0]);
                assert!((&found - &expected).norm() < 1e-6, "{found} {expected}");
            }
        }
    }

    #[test]
    fn a_pose_waits_where_time_is_logged_and_a_rival_changes_gradually() {
        let plain = crate::testing::two_links(8, "", 0.05, 73, |_| [0.0; 2]);
        let timed =
            crate::testing::with_table(&plain, |table| table.time = Some((0..8).map(f64::from).collect()));
        let waits = |lab: &Laboratory, text: &str| {
            let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
            let id = effect::parse(text, lab.model()).unwrap();
            let values = vec![0.0; effect::build(&id, lab.model()).unwrap().parameters().len()];
            let effects = vec![plumb_calibration::arm_model::AddedEffect { id, values }];
            let rival = Rival::of(text.to_owned(), effects, &fitted);
            Chooser::new(lab, vec![rival], 1.0).unwrap().designer.waits
        };
        assert!(waits(&timed, "drift"));
        assert!(!waits(&plain, "drift"), "nobody logs the time");
        assert!(!waits(&timed, "joint_gain(elbow)"), "it is the same at any time");
    }

    #[test]
    fn a_pose_is_worth_what_is_unknown_there_of_one_model_and_how_far_it_puts_several_apart() {
        let lab = crate::testing::two_links(8, "", 0.05, 73, |_| [0.0; 2]);
        let mut chooser = Chooser::new(&lab, Vec::new(), 1.0).unwrap();
        let at = |value: f64| vec![(DVector::from_element(1, value), DMatrix::from_element(1, 1, 2.0))];
        let forecast = |values: &[f64]| Forecast {
            rivals: values.iter().map(|value| at(*value)).collect(),
            reach_allowed: vec![true],
        };
        let known = |rivals: usize| Known {
            covariances: vec![DMatrix::from_element(1, 1, 0.25); rivals],
            apart: vec![0.0; rivals * rivals.saturating_sub(1) / 2],
        };
        // 2 times a variance of a quarter times 2.
        assert_eq!(chooser.worth(&forecast(&[5.0]), 0, &known(1)), (1.0, Vec::new()));
        // A variance of 1 each, and of noise 1 each: 4. Second before first, third before first and second.
        let (worth, pairs) = chooser.worth(&forecast(&[0.0, 2.0, 6.0]), 0, &known(3));
        assert_eq!(pairs, [1.0, 9.0, 4.0]);
        assert!((worth - pairs.iter().map(|one| answered(*one)).sum::<f64>()).abs() < 1e-12);
        chooser.separate_from_first();
        let (_, pairs) = chooser.worth(&forecast(&[0.0, 2.0, 6.0]), 0, &known(3));
        assert!(pairs[..2] == [1.0, 9.0] && pairs[2].is_nan());
    }
}
