//! What these rows cannot show: effects that could still move the tip by more than the noise, somewhere in the working volume, while staying too small
//! to be found in the rows. A verdict that nothing is left holds only as far as this list is empty.
//!
//! With `A` the derivatives of the rows by the fitted parameters and `B` those by an effect's, the fit answers an effect of size `s` with `-C s`, where
//! `C = (A'A)^-1 A'B`, and the rows show what is left of it by the information `F = B'B - C'A'B`. At places of the working volume the tip is then off by
//! `(Bw - Aw C) s`. The greatest mean square of that is sought among the sizes that would be found less than four times in five and that a real machine
//! could have: an eigenvalue problem.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::fitted::Fitted;
use super::outcome::NotShown;
use super::products::{Plan, Products};
use super::score_test::information;
use super::thresholds::{BOUNDED_BY_ROWS, DETECTABLE_ERRORS};
use super::verdict::effect_site;
use super::working_volume::Volume;
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::noise_floor::Floor;
use plumb_calibration::arm_model::{AddedEffect, Model};
use plumb_calibration::effect::{self, CandidateContext, Effect, EffectId, Family};
use plumb_calibration::fit::ResidualModel;
use plumb_calibration::measurement::ReadingUnit;

/// An effect that the rows cannot show, at the greatest size it could have.
pub(super) struct Faint {
    pub(super) id: EffectId,
    /// Values of its parameters, internal units.
    pub(super) values: Vec<f64>,
    /// How the fitted parameters would answer, one number each.
    pub(super) beside: DVector<f64>,
    /// RMS over the working volume by which the tip would be off, mm.
    pub(super) error_mm: f64,
    /// Hardly anything of it is seen in the rows, whatever its size.
    pub(super) any_size: bool,
    effect: Arc<dyn Effect>,
}

/// Mass that stands in for the weight of an arm whose masses nobody gave, kg: its place in the poses counts, not its size.
const STAND_IN_KG: f64 = 1.0;

/// The model with a mass at its flange where it has none at all: a real arm has weight.
pub(super) fn with_weight(model: &Model) -> Model {
    let mut weighty = model.clone();
    if weighty.masses.is_empty() && !weighty.chain.is_empty() {
        let after = weighty.chain.len() - 1;
        weighty.masses.push(plumb_kinematics::Mass {
            after,
            mass: STAND_IN_KG,
            centre: nalgebra::Vector3::zeros(),
        });
    }
    weighty
}

/// What a problem has fitted, with the values it found.
pub(super) fn fitted_effects(fitted: &Fitted<'_>) -> Vec<AddedEffect> {
    let parts = fitted.problem.parts.iter().zip(&fitted.fit.state.effects);
    parts.map(|(part, values)| AddedEffect { id: part.id.clone(), values: values.clone() }).collect()
}

impl Laboratory {
    /// Effects that could move the tip by more than the noise and that the rows could not show, those that could move it most first. Empty where the
    /// noise is not known.
    pub(super) fn faint(&self, fitted: &Fitted<'_>, floor: &Floor) -> Result<Vec<Faint>, LaboratoryError> {
        let (Some(scale), Some(sigma)) = (floor.scale, floor.sigma_mm) else { return Ok(Vec::new()) };
        if self.observations().unit() == ReadingUnit::Deg || self.model().targets.is_empty() {
            return Ok(Vec::new());
        }
        let model = with_weight(self.model());
        let taken = fitted_effects(fitted);
        let problem = ResidualModel::new(&model, self.table(), self.observations(), &taken)?;
        let asked = self.asked(&model, &taken);
        let effects: Vec<&dyn Effect> = asked.iter().map(|(_, effect)| effect.as_ref()).collect();
        let plan = Plan::of(&effects, model.chain.len());
        let products = Products::of(&problem, &fitted.fit, &plan);
        let shadows = fitted.fit.factor.whiten(&products.with_parameters.transpose());
        let volume = Volume::of(self, &model, &fitted.fit.state)?;
        let there = volume.derivatives(&model, &taken, &fitted.fit.state, &effects)?;
        // In units in which a size is found four times in five where s' F s is 1.
        let noise = DETECTABLE_ERRORS * DETECTABLE_ERRORS * scale * scale;
        let mut found: Vec<Faint> = Vec::new();
        let mut first = problem.free_parameters().len();
        for (index, (id, effect)) in asked.iter().enumerate() {
            let count = effect.parameters().len();
            let columns = first..first + count;
            first = columns.end;
            let (Some(range), Some(own)) = (plan.ranges.get(index), products.own.get(index)) else {
                continue;
            };
            let shadow = shadows.columns(range.start, count);
            let shown = information(own, &(own - shadow.tr_mul(&shadow))) / noise;
            let answers: Vec<DVector<f64>> =
                shadow.column_iter().map(|column| fitted.fit.factor.back(column.into_owned())).collect();
            let answer = DMatrix::from_columns(&answers);
            let off = there.off(columns, &answer, moves_the_tip(id));
            let Some((error_mm, values, fraction)) = greatest(&shown, &off, effect.as_ref()) else {
                continue;
            };
            // Sigma is that of one axis; the tip is off in space.
            if error_mm <= sigma * 3.0_f64.sqrt() {
                continue;
            }
            let beside = -&answer * DVector::from_column_slice(&values);
            let any_size = fraction < BOUNDED_BY_ROWS;
            let one =
                Faint { id: id.clone(), values, beside, error_mm, any_size, effect: Arc::clone(effect) };
            // Of waves and couplings of one joint the one that could do most represents all.
            match found.iter_mut().find(|other| other.id.name == id.name && other.id.site == id.site) {
                Some(known) if known.error_mm < error_mm => *known = one,
                Some(_) => {}
                None => found.push(one),
            }
        }
        found.sort_by(|left, right| right.error_mm.total_cmp(&left.error_mm));
        Ok(found)
    }

    /// Every effect of the library that this arm can have and that is not fitted, whether or not the table could show it.
    fn asked(&self, model: &Model, taken: &[AddedEffect]) -> Vec<(EffectId, Arc<dyn Effect>)> {
        let mut summary = self.summary().clone();
        if self.table().approach.is_some() {
            // A side that was never arrived from hides play: it is asked about as if it had been.
            summary.both_sides = vec![true; model.chain.len()];
        }
        let context = CandidateContext { model, summary: &summary };
        // What time and temperature will do is no property of the rows.
        let mut all: Vec<(EffectId, Arc<dyn Effect>)> = Vec::new();
        for id in effect::kinds()
            .iter()
            .filter(|kind| kind.family != Family::Instrument && !kind.depends_on_time)
            .flat_map(|kind| (kind.candidates)(&context))
        {
            let known = taken.iter().any(|taken| taken.id.same_as(&id))
                || all.last().is_some_and(|(last, _)| last.same_as(&id));
            if let (false, Ok(built)) = (known, effect::build(&id, model)) {
                all.push((id, Arc::from(built)));
            }
        }
        all
    }

    /// The same in the contract's words.
    pub(super) fn not_shown(
        &self,
        fitted: &Fitted<'_>,
        floor: &Floor,
    ) -> Result<Vec<NotShown>, LaboratoryError> {
        let weightless = self.model().masses.is_empty();
        Ok(self
            .faint(fitted, floor)?
            .iter()
            .map(|one| {
                let nothing = DMatrix::zeros(one.values.len(), one.values.len());
                let size = one.effect.size(&one.values, &nothing);
                // Without the masses a compliance has no unit.
                let no_unit = weightless && one.effect.looks_at() == effect::LooksAt::Gravity;
                let sized = !(one.any_size || no_unit);
                NotShown {
                    effect: effect_site(&fitted.problem, &one.id),
                    label: self.model().label(&one.id),
                    up_to_mm: (!one.any_size).then_some(one.error_mm),
                    size: sized.then_some(size.value.abs()),
                    unit: size.unit.to_owned(),
                    to_see: effect::kind(&one.id.name).map_or("", |kind| kind.how_to_see).to_owned(),
                }
            })
            .collect())
    }
}

/// Effects of the arm's own sensor change what is read, not where the tip is.
fn moves_the_tip(id: &EffectId) -> bool {
    effect::kind(&id.name).is_none_or(|kind| kind.family != Family::Sensor)
}

/// The greatest RMS by which the tip is off (mm) among sizes the rows would miss and a real machine could have; the values that do it; and which share of
/// what the rows would miss they have: small where the plausible range is what bounds them.
fn greatest(shown: &DMatrix<f64>, off: &DMatrix<f64>, effect: &dyn Effect) -> Option<(f64, Vec<f64>, f64)> {
    let mut bound = shown.clone();
    for (index, parameter) in effect.parameters().iter().enumerate() {
        let widest = parameter.range.0.abs().max(parameter.range.1.abs());
        if !(widest.is_finite() && widest > 0.0) {
            return None;
        }
        // An ellipsoid within the box of plausible sizes, added to that of sizes the rows would miss: the sum is an eigenvalue problem, the box itself is not.
        bound[(index, index)] += widest.powi(-2);
    }
    let lower = bound.cholesky()?.l();
    let half = lower.solve_lower_triangular(off)?;
    let whitened = lower.solve_lower_triangular(&half.transpose())?;
    // Rounding leaves it not quite symmetric.
    let eigen = (0.5 * (&whitened + whitened.transpose())).symmetric_eigen();
    let at = eigen.eigenvalues.imax();
    let square = eigen.eigenvalues.get(at).copied().filter(|square| *square > 0.0)?;
    let values = lower.transpose().solve_upper_triangular(&eigen.eigenvectors.column(at).into_owned())?;
    let fraction = (values.transpose() * shown * &values)[(0, 0)];
    Some((square.sqrt(), values.as_slice().to_vec(), fraction))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{two_links, two_links_with};
    use plumb_calibration::effect::Site;

    #[test]
    fn the_greatest_error_of_one_number_is_where_its_range_and_the_rows_bound_it_together() {
        let lab = two_links(8, "", 0.1, 1, |_| [0.0; 2]);
        let gain = effect::build(&EffectId::at("joint_gain", Site::Joint(1)), lab.model()).unwrap();
        let (low, high) = gain.parameters()[0].range;
        let widest = low.abs().max(high.abs());
        let one = |value: f64| DMatrix::from_element(1, 1, value);
        // As much by the rows as by the range: the size is 1 / sqrt(2) of the range, and half of it is the rows'.
        let (error, values, fraction) = greatest(&one(widest.powi(-2)), &one(9.0), gain.as_ref()).unwrap();
        assert!((error - 3.0 * widest / 2.0_f64.sqrt()).abs() < 1e-12 && (fraction - 0.5).abs() < 1e-12);
        assert!((values[0].abs() - widest / 2.0_f64.sqrt()).abs() < 1e-12);
        assert!(greatest(&one(1.0), &one(0.0), gain.as_ref()).is_none(), "it does not move the tip");
        let endless = Endless([plumb_calibration::effect::Parameter::new(
            "a",
            plumb_calibration::effect::Unit::RATIO,
            (f64::NEG_INFINITY, f64::INFINITY),
        )]);
        assert!(greatest(&one(1.0), &one(9.0), &endless).is_none(), "no machine bounds it");
    }

    /// Of any size.
    #[derive(Debug)]
    struct Endless([plumb_calibration::effect::Parameter; 1]);

    impl Effect for Endless {
        fn parameters(&self) -> &[plumb_calibration::effect::Parameter] {
            &self.0
        }

        fn contribute(
            &self,
            _: &plumb_calibration::effect::Sample<'_>,
            _: &mut Vec<plumb_calibration::effect::Contribution>,
        ) {
        }
    }

    #[test]
    fn effects_of_the_arm_move_the_tip_and_those_of_its_sensor_do_not() {
        assert!(moves_the_tip(&EffectId::at("joint_gain", Site::Joint(1))));
        assert!(moves_the_tip(&EffectId::at("an_own_definition", Site::Joint(1))));
        let sensors = effect::kinds().iter().filter(|kind| kind.family == Family::Sensor);
        let of_sensor: Vec<bool> =
            sensors.map(|kind| moves_the_tip(&EffectId::at(kind.name, Site::Base))).collect();
        assert!(!of_sensor.is_empty() && !of_sensor.contains(&true), "{of_sensor:?}");
    }

    #[test]
    fn without_a_floor_nothing_is_said_and_a_weightless_arm_is_given_a_mass_to_ask_with() {
        let lab = two_links(20, "joint_zero(*)", 0.05, 2, |_| [0.0; 2]);
        let fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
        let unknown = Floor::of(&fitted.problem, &fitted.fit, &lab.context());
        assert!(unknown.scale.is_none() && lab.faint(&fitted, &unknown).unwrap().is_empty());
        assert_eq!(with_weight(lab.model()).masses.len(), 1);
        assert_eq!(with_weight(&with_weight(lab.model())).masses.len(), 1);
    }

    #[test]
    fn what_a_narrow_table_hides_comes_first_by_how_far_it_moves_the_tip() {
        let lab = two_links_with("free: [joint_zero(*)]\nnoise: {p1_mm: 0.05}", 12, 0.05, 3, |_| [0.0; 2]);
        let fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
        let floor = Floor::of(&fitted.problem, &fitted.fit, &lab.context());
        let hidden = lab.not_shown(&fitted, &floor).unwrap();
        assert!(!hidden.is_empty(), "of twelve poses something stays hidden");
        let sizes: Vec<f64> = hidden.iter().filter_map(|one| one.up_to_mm).collect();
        assert!(sizes.iter().all(|size| *size > 0.05 * 3.0_f64.sqrt()), "{sizes:?}");
        // How far off the tip may be is said of what the plausible range does not bound alone.
        let faint = lab.faint(&fitted, &floor).unwrap();
        assert_eq!(faint.len(), hidden.len());
        for (one, shown) in faint.iter().zip(&hidden) {
            assert_eq!(shown.up_to_mm, (!one.any_size).then_some(one.error_mm), "{}", shown.label);
        }
        assert!(faint.iter().any(|one| !one.any_size));
        assert!(
            hidden.iter().all(|one| !one.effect.effect.starts_with("joint_zero") && !one.to_see.is_empty())
        );
        let families =
            hidden.iter().filter_map(|one| effect::kind(&one.effect.effect)).map(|kind| kind.family);
        assert!(families.clone().any(|family| family == Family::Joint), "{hidden:?}");
        assert!(
            !families.into_iter().any(|family| family == Family::Instrument),
            "an instrument moves no tip"
        );
        let mut kinds: Vec<(String, String)> =
            hidden.iter().map(|one| (one.effect.effect.clone(), one.effect.site.clone())).collect();
        let count = kinds.len();
        kinds.sort();
        kinds.dedup();
        assert_eq!(kinds.len(), count, "of one kind at one place the worst stands for all");
    }

    #[test]
    fn an_effect_of_one_number_hides_below_what_its_standard_error_and_its_range_allow() {
        let lab = two_links_with("free: [joint_zero(*)]\nnoise: {p1_mm: 0.05}", 12, 0.05, 3, |_| [0.0; 2]);
        let watch = plumb_estimation::Progress::unwatched();
        let fitted = lab.fit_with(&[], None, &watch).unwrap();
        let floor = Floor { scale: Some(1.3), ..Floor::of(&fitted.problem, &fitted.fit, &lab.context()) };
        let faint = lab.faint(&fitted, &floor).unwrap();
        assert!(faint.windows(2).all(|pair| pair[0].error_mm >= pair[1].error_mm));
        let mut asked = 0;
        for one in faint.iter().filter(|one| one.values.len() == 1 && moves_the_tip(&one.id)) {
            let with =
                lab.fit_with(&[AddedEffect { id: one.id.clone(), values: vec![0.0] }], None, &watch).unwrap();
            let index = with.fit.covariance.nrows() - 1;
            // Where a number cannot be distinguished from those that are fitted its range alone bounds it.
            if with.fit.factor.dependent.contains(&index) {
                continue;
            }
            let error = 1.3 * (with.fit.covariance[(index, index)] / with.fit.variance).sqrt();
            let (low, high) = one.effect.parameters()[0].range;
            let (by_rows, by_range) = (DETECTABLE_ERRORS * error, low.abs().max(high.abs()));
            let expected = (by_rows.powi(-2) + by_range.powi(-2)).powf(-0.5);
            assert!(
                (one.values[0].abs() / expected - 1.0).abs() < 0.02,
                "{:?} {:?} {expected}",
                one.id,
                one.values
            );
            assert_eq!(one.any_size, (expected / by_rows).powi(2) < BOUNDED_BY_ROWS, "{:?}", one.id);
            asked += 1;
        }
        assert!(asked > 2, "{asked}");
    }
}
