//! Model against measurement: how large the error is, where it sits, how far the floor lies below.

use serde::Serialize;

use super::found_surfaces::{FoundSurface, found_surfaces};
use super::placements::{Placement, orientation_errors, placements};
use super::point_errors::{ErrorSummary, Errors, noise_of_a_point, point_squares};
use super::rows::{RowResidual, Series, arm_in_the_middle, row_residuals, series, unit_of_joint};
use super::standard_errors::StandardErrors;
use super::{Laboratory, LaboratoryError, MapNote};
use crate::claim::Claim;
use crate::cross_validation::blocked_errors;
use crate::explainable::{Explainable, explainable};
use crate::noise_floor::Floor;
use crate::note::Note;
use crate::thresholds::OUTLIER_WEIGHT;
use plumb_calibration::effect::{self, LooksAt};
use plumb_calibration::fit::{Convergence, Fit, FreeParameter, Gauge, Part, ResidualModel};
use plumb_calibration::measurement::{ReadingNoise, ReadingUnit};
use plumb_estimation::Progress;

/// Root mean squares of the error of one measured point, in the unit of the table's readings: of its 3-D residual, or of the scalar one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rms {
    /// Over the rows that were fitted.
    pub fit: f64,
    /// Blocked cross-validation: regions of pose space left out in turn.
    pub cv: Option<f64>,
    /// Over the held-out rows; nothing if none were held out.
    pub check: Option<f64>,
}

impl Rms {
    /// The root mean squares alone.
    fn of(errors: &Errors) -> Self {
        let [cv, check] = [errors.cv, errors.check].map(|summary| summary.map(|summary| summary.rms));
        Self { fit: errors.fit.rms, cv, check }
    }
}

/// How far measured orientations, and other angles beside lengths, are off, degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OrientationErrors {
    /// Over the rows that were fitted.
    pub fit: ErrorSummary,
    /// Over the held-out rows; nothing if none were held out.
    pub check: Option<ErrorSummary>,
}

/// A fitted effect in shown units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectValue {
    /// Its name.
    pub effect: String,
    /// Where it acts.
    #[serde(rename = "where")]
    pub site: String,
    /// As a person writes it.
    pub label: String,
    /// Its size.
    pub size: f64,
    /// Unit of the size.
    pub unit: String,
    /// One standard error of the size.
    pub se: f64,
    /// Whether a real machine could have it.
    pub plausible: bool,
    /// Whether the data cannot determine it (part of a gauge freedom).
    pub held: bool,
    /// Why the data cannot determine it, where that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_because: Option<WhyHeld>,
    /// Whether the user added it (else it is one of `free`).
    pub added: bool,
    /// Whether its mechanism is identified.
    pub claim: Claim,
    /// Of a correction: the mechanisms it may represent.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub may_be: Vec<String>,
}

/// Why the data cannot determine an effect.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub enum WhyHeld {
    /// No masses are declared, so that gravity moves nothing.
    NoMasses,
    /// It changes nothing that was measured.
    ChangesNothing,
    /// These do the same.
    SameAs(Vec<String>),
}

/// A joint as plots and tables name it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct JointAxis {
    /// Its name.
    pub name: String,
    /// The unit of its coordinate: `deg` or `mm`.
    pub unit: &'static str,
}

/// What is left along the motion of one joint.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointError {
    /// The joint.
    pub joint: String,
    /// Root mean square of the residual along its motion over the fitted rows, in the unit of the table's readings.
    pub rms_mm: f64,
}

/// A model against a table.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// The arm.
    pub arm: String,
    /// The table.
    pub data: String,
    /// Rows fitted.
    pub fit_rows: usize,
    /// Rows held out.
    pub check_rows: usize,
    /// The unit of the table's readings, and so of every error here whose name ends in `_mm`: mm, or degrees of angles alone.
    pub unit: ReadingUnit,
    /// The noise floor.
    pub floor: Floor,
    /// The same for one measured point (the length of its error in space): what `rms_mm` is compared with; nothing if unknown.
    pub floor_of_a_point_mm: Option<f64>,
    /// The noise of every kind of reading: declared, or estimated from the fit.
    pub noise: Vec<ReadingNoise>,
    /// RMS of the residual of one measured point.
    pub rms_mm: Rms,
    /// The same with mean, 95 % and maximum beside it.
    pub error_mm: Errors,
    /// How far measured orientations are off, degrees: over the rows that were fitted, and the locked ones; nothing where none was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orientation_error_deg: Option<OrientationErrors>,
    /// Where bodies, cameras and the board were found; empty of a table without orientations.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub placed: Vec<Placement>,
    /// Planes, balls, edges and points that were fitted.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub surfaces: Vec<FoundSurface>,
    /// How much of it could be explained at all; nothing where that was not asked, or the poses are too few.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub explainable: Option<Explainable>,
    /// What the model's residual map does; nothing where it has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_map: Option<MapNote>,
    /// Largest residual of a fitted point, in `unit`.
    pub largest_mm: f64,
    /// Independent parameters that were fitted.
    pub parameters: usize,
    /// What is left along the motion of each joint that moved.
    pub along_joints: Vec<JointError>,
    /// The joints, in order.
    #[serde(skip)]
    pub joints: Vec<JointAxis>,
    /// All fitted effects.
    pub effects: Vec<EffectValue>,
    /// Freedoms the data cannot see.
    #[serde(serialize_with = "what_is_held")]
    pub gauges: Vec<Gauge>,
    /// Lines of the file whose rows lie far outside the others' scatter.
    pub outliers: Vec<u32>,
    /// Whether the fit arrived.
    #[serde(skip)]
    pub convergence: Convergence,
    /// What is left in every row.
    #[serde(skip)]
    pub rows: Vec<RowResidual>,
    /// What is left, against everything it may be drawn against.
    #[serde(skip)]
    pub series: Vec<Series>,
    /// Points along the arm in the pose nearest the middle of all, mm, frame of the measurements: what a drawing shows.
    #[serde(skip)]
    pub arm_points_mm: Vec<[f64; 3]>,
    /// What the reader and the fit noticed.
    #[serde(skip)]
    pub warnings: Vec<Note>,
}

/// The joints as plots and tables name them.
fn joint_axes(problem: &ResidualModel<'_>) -> Vec<JointAxis> {
    let joints = problem.model.chain.joints.iter().enumerate();
    joints
        .map(|(index, joint)| JointAxis { name: joint.name.clone(), unit: unit_of_joint(problem, index) })
        .collect()
}

/// The root mean square of the fitted rows' residuals along the motion of each joint that moved.
fn along_joints(joints: &[JointAxis], series: &[Series], rows: &[RowResidual]) -> Vec<JointError> {
    let errors = joints.iter().filter_map(|joint| {
        let of_joint = |series: &&Series| series.against == joint.name && series.unit == joint.unit;
        // Where only sizes are drawn nothing is known along any motion.
        let own = series.iter().find(of_joint).filter(|series| !series.of_size)?;
        let fitted = own.points.iter().filter(|point| rows.get(point.2).is_some_and(|row| !row.held_out));
        let squares: Vec<f64> = fitted.map(|point| point.1 * point.1).collect();
        let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
        Some(JointError { joint: joint.name.clone(), rms_mm: mean.sqrt() })
    });
    errors.collect()
}

fn what_is_held<S: serde::Serializer>(gauges: &[Gauge], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(gauges.iter().map(|gauge| &gauge.held))
}

/// Errors of the measured points of some rows, in the unit of the table's readings; nothing if none of them was measured.
fn errors_in(problem: &ResidualModel<'_>, residuals: &[f64], rows: &[usize]) -> Option<ErrorSummary> {
    ErrorSummary::of(rows.iter().flat_map(|row| point_squares(problem, residuals, *row)))
}

impl Laboratory {
    /// Fits the model and compares it with the table.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn compare(&self, progress: &Progress) -> Result<Comparison, LaboratoryError> {
        progress.report(0.0, "fitting")?;
        let problem = self.problem(&[])?;
        let fit = self.fit(&problem, progress)?;
        self.comparison(&problem, &fit, progress)
    }

    /// The same, and how much of what is left could be explained at all.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn compare_in_full(&self, progress: &Progress) -> Result<Comparison, LaboratoryError> {
        progress.report(0.0, "fitting")?;
        let problem = self.problem(&[])?;
        let fit = self.fit(&problem, progress)?;
        let comparison = self.comparison(&problem, &fit, progress)?;
        // What a residual map takes away is not explained.
        let explainable = match self.without_map() {
            Some(plain) => plain.explainable(progress)?,
            None => explainable(&problem, &fit, progress)?,
        };
        Ok(Comparison { explainable, ..comparison })
    }

    /// How much of what the model leaves could be explained at all; nothing where the poses are too few to ask.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn explainable(&self, progress: &Progress) -> Result<Option<Explainable>, LaboratoryError> {
        let problem = self.problem(&[])?;
        let fit = self.fit(&problem, progress)?;
        Ok(explainable(&problem, &fit, progress)?)
    }

    /// What a fit of everything free leaves of the fitted rows, RMS in the unit of the table's readings; nothing else is asked.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn left_by_fit(&self, progress: &Progress) -> Result<f64, LaboratoryError> {
        let problem = self.problem(&[])?;
        let fit = self.fit(&problem, progress)?;
        Ok(ErrorSummary::or_zero(errors_in(&problem, &fit.residuals, &fit.rows)).rms)
    }

    pub(crate) fn comparison(
        &self,
        problem: &ResidualModel<'_>,
        fit: &Fit,
        progress: &Progress,
    ) -> Result<Comparison, LaboratoryError> {
        progress.report(0.5, "noise floor")?;
        let floor = Floor::of(problem, fit, &self.context());
        progress.report(0.7, "cross-validation")?;
        let error_mm = self.errors(problem, fit, progress)?;
        let rms_mm = Rms::of(&error_mm);
        let rows = row_residuals(problem, fit, &self.split.check);
        let series = series(problem, fit, &rows);
        let joints = joint_axes(problem);
        // A point has up to three readings, and its error is the root of their squares' sum.
        let noise_ratio = noise_of_a_point(problem, &fit.rows);
        let errors = StandardErrors::of(problem, fit, &floor);
        Ok(Comparison {
            orientation_error_deg: self.orientation_errors(problem, fit),
            placed: placements(&errors),
            surfaces: found_surfaces(&errors),
            arm: self.model.arm.clone(),
            data: self.table.source.clone(),
            unit: problem.observations.unit(),
            floor_of_a_point_mm: floor.sigma_mm.map(|sigma| sigma * noise_ratio),
            noise: self.noise(),
            along_joints: along_joints(&joints, &series, &rows),
            joints,
            fit_rows: fit.rows.len(),
            check_rows: self.split.check_rows().len(),
            residual_map: self.map_note(),
            largest_mm: error_mm.fit.max,
            parameters: fit.rank(),
            effects: self.effect_values(&errors),
            gauges: fit.gauges.clone(),
            outliers: rows
                .iter()
                .filter(|row| !row.held_out && row.weight < OUTLIER_WEIGHT)
                .map(|row| row.line)
                .collect(),
            convergence: fit.convergence,
            series,
            arm_points_mm: arm_in_the_middle(problem, fit, &rows),
            rows,
            warnings: self.noticed(fit),
            floor,
            rms_mm,
            error_mm,
            explainable: None,
        })
    }

    /// What the reader and the fit noticed.
    fn noticed(&self, fit: &Fit) -> Vec<Note> {
        let outside = self.rows_outside();
        let mut noticed = self.table.warnings.clone();
        noticed.extend(effect::waves_not_shown(&self.context()));
        noticed.extend(fit.doubts.iter().map(ToString::to_string));
        let mut warnings: Vec<Note> = noticed.into_iter().map(Note::Noticed).collect();
        if outside > 0 {
            warnings.push(Note::OutsideRegion { outside, rows: self.table.len() });
        }
        if !fit.convergence.arrived {
            let Convergence { reached, promised, .. } = fit.convergence;
            warnings.push(Note::NotArrived { reached, promised });
        }
        warnings
    }

    pub(crate) fn rms(
        &self,
        problem: &ResidualModel<'_>,
        fit: &Fit,
        progress: &Progress,
    ) -> Result<Rms, LaboratoryError> {
        Ok(Rms::of(&self.errors(problem, fit, progress)?))
    }

    /// Errors of measured points where the model was fitted, where regions were left out, and on the held-out rows.
    fn errors(
        &self,
        problem: &ResidualModel<'_>,
        fit: &Fit,
        progress: &Progress,
    ) -> Result<Errors, LaboratoryError> {
        // A residual map says nothing of regions that were left out: there the model is alone.
        let cv = match self.without_map() {
            Some(plain) => {
                let alone = plain.fit_with(&[], None, progress)?;
                blocked_errors(&alone.problem, &alone.fit)
            }
            None => blocked_errors(problem, fit),
        };
        let held = self.split.check_rows();
        let residuals = problem.residuals_apart(&fit.state, &held, &fit.rows);
        Ok(Errors {
            fit: ErrorSummary::or_zero(errors_in(problem, &fit.residuals, &fit.rows)),
            cv,
            check: errors_in(problem, &residuals, &held),
        })
    }

    fn orientation_errors(&self, problem: &ResidualModel<'_>, fit: &Fit) -> Option<OrientationErrors> {
        let held = self.split.check_rows();
        let residuals = problem.residuals_apart(&fit.state, &held, &fit.rows);
        Some(OrientationErrors {
            fit: orientation_errors(problem, &fit.residuals, &fit.rows)?,
            check: orientation_errors(problem, &residuals, &held),
        })
    }

    /// The effects of a fit with their sizes.
    pub(crate) fn effect_values(&self, errors: &StandardErrors<'_>) -> Vec<EffectValue> {
        let StandardErrors { problem, fit, .. } = errors;
        // The problem's parts are what is always fitted, then what was added, in the order of the model file.
        let free = problem.parts.len().saturating_sub(self.model.effects.len());
        let mut all = Vec::with_capacity(problem.parts.len());
        for (index, part) in problem.parts.iter().enumerate() {
            let own = problem.free_parameters().iter().enumerate();
            let own = own.filter(|(_, free_parameter)| matches!(free_parameter, FreeParameter::Effect(effect, _) if *effect == index));
            let free_parameters: Vec<usize> = own.map(|(free_parameter, _)| free_parameter).collect();
            let covariance = errors.covariance_of(&free_parameters);
            let values = fit.state.effects.get(index).map_or(&[][..], Vec::as_slice);
            let size = part.effect.size(values, &covariance);
            let size = size.unless_undetermined(part.effect.parameters());
            let correction = self.model.correction(&part.id).filter(|_| index >= free);
            // Of an effect some of whose numbers are free there is a size to report.
            let held =
                free_parameters.iter().all(|free_parameter| fit.factor.dependent.contains(free_parameter));
            all.push(EffectValue {
                effect: part.id.name.clone(),
                site: self.model.site_name(part.id.site),
                label: self.model.label(&part.id),
                size: size.value,
                unit: size.unit.to_owned(),
                se: size.error,
                plausible: part.effect.plausible(values),
                held,
                held_because: held.then(|| self.why_held(problem, fit, part, &free_parameters)).flatten(),
                added: index >= free,
                claim: correction.map_or(Claim::Mechanism, |_| Claim::Correction),
                may_be: correction.map_or_else(Vec::new, |correction| correction.may_be.clone()),
            });
        }
        all
    }
}

impl Laboratory {
    /// Why the data cannot determine an effect whose numbers were all left where they were.
    fn why_held(
        &self,
        problem: &ResidualModel<'_>,
        fit: &Fit,
        part: &Part,
        free_parameters: &[usize],
    ) -> Option<WhyHeld> {
        let needs_masses = match effect::kind(&part.id.name) {
            Some(kind) => kind.driven_by.is_weight(),
            // One that the model file defines may use moments.
            None => part.effect.looks_at() == LooksAt::Gravity,
        };
        if needs_masses && !self.context().has_weight() {
            return Some(WhyHeld::NoMasses);
        }
        let first = problem.free_parameters().get(*free_parameters.first()?)?;
        let name = problem.parameter_name(*first);
        let gauge = fit.gauges.iter().find(|gauge| gauge.held == name)?;
        Some(match gauge.same_as.is_empty() {
            true => WhyHeld::ChangesNothing,
            false => WhyHeld::SameAs(gauge.same_as.clone()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links;

    #[test]
    fn what_is_left_along_a_joint_is_that_of_its_own_motion() {
        // The elbow swings 10 mrad about where it should be, on a lever of 150 mm: 1.06 mm RMS.
        let lab = two_links(80, "", 0.02, 9, |q| [0.0, 0.01 * (3.0 * q[1]).sin()]);
        let comparison = lab.compare(&Progress::unwatched()).unwrap();
        let along: Vec<(&str, f64)> =
            comparison.along_joints.iter().map(|one| (one.joint.as_str(), one.rms_mm)).collect();
        let [("shoulder", shoulder), ("elbow", elbow)] = along[..] else { panic!("{along:?}") };
        assert!((0.9..1.2).contains(&elbow), "{elbow}");
        assert!(shoulder < 0.95 * elbow, "the forearm stands askew to the shoulder's motion: {along:?}");
    }

    #[test]
    fn how_much_could_be_explained_is_asked_in_a_full_comparison_alone() {
        let lab = two_links(150, "joint_zero(*)", 0.05, 3, |q| [0.0, 0.004 * (2.0 * q[1] + 0.4).sin()]);
        let progress = Progress::unwatched();
        assert_eq!(lab.compare(&progress).unwrap().explainable, None);
        let explainable = lab.compare_in_full(&progress).unwrap().explainable.unwrap();
        assert_eq!(explainable.kinds(), ["pose"], "{explainable:?}");
    }

    #[test]
    fn rows_outside_the_region_that_a_correction_was_measured_in_are_warned_of() {
        let mut lab = two_links(30, "", 0.05, 61, |_| [0.0; 2]);
        let warned = |lab: &Laboratory| {
            let warnings = lab.compare(&Progress::unwatched()).unwrap().warnings;
            warnings.iter().any(|warning| matches!(warning, Note::OutsideRegion { outside: 1.., rows: 30 }))
        };
        let mut region = lab.measured_region().unwrap();
        lab.model.measured_region = Some(region.clone());
        assert!(!warned(&lab));
        region.joints[1].high = 0.5;
        lab.model.measured_region = Some(region);
        assert!(warned(&lab));
    }
}
