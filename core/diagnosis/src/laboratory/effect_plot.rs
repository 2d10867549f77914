//! An effect's own plot: what is left without it against what drives it, with the curve that was fitted. It is a component-plus-residual plot (Larsen &
//! McCleary 1972, Technometrics 14, 781): the residual of the model with the effect in, and the effect's own part put back.
//!
//! How far an effect moves the point depends on the pose (a joint turns a far point more than a near one). So what is left is seen along the motion, and both
//! it and the curve are scaled to the root mean square lever of all rows: then the curve is a function of what drives the effect.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::DMatrix;
use serde::Serialize;

use super::regressor::{PlotAxis, Regressor};
use super::{Laboratory, LaboratoryError, points_in};
use crate::candidates::{best_variants, probes};
use crate::fitted::Fitted;
use crate::score_test::{Probe, Score, score};
use plumb_calibration::effect::{
    self, Contribution, Dof, DrivenBy, Effect, EffectId, Parameter, Sample, Site, Unit, acts_by_epoch,
};
use plumb_estimation::Progress;

/// An effect's own plot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectPlot {
    /// The effect, as `add` takes it.
    pub effect: String,
    /// Whether it is in the model.
    pub added: bool,
    /// What drives it.
    pub across: PlotAxis,
    /// What is left without it, in the unit of the table's readings.
    pub up: PlotAxis,
    /// What drives it, what is left, the row.
    pub points: Vec<(f64, f64, usize)>,
    /// The effect as it was fitted, from left to right.
    pub curve: Vec<(f64, f64)>,
    /// Root mean square of the points about zero, and about the curve, in the unit of `up`.
    pub rms_mm: [f64; 2],
}

/// Rows whose lever is shorter than this share of the root mean square are not drawn: dividing by it would blow up their noise.
const SHORTEST_LEVER: f64 = 0.2;

/// Points of a curve at most.
const CURVE_POINTS: usize = 240;

/// Two degrees of freedom change in proportion if they do so to this share of the larger.
const PROPORTIONAL: f64 = 1e-6;

/// One unit of what an effect moves, in every row.
#[derive(Debug)]
struct UnitMotion {
    dofs: Vec<(Dof, f64)>,
    parameters: [Parameter; 1],
}

impl Effect for UnitMotion {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, _: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        contributions.extend(self.dofs.iter().map(|(dof, rate)| Contribution {
            parameter: 0,
            dof: *dof,
            rate: *rate,
        }));
    }
}

/// An effect with its values: fitted ones, or those that are expected of it.
struct Valued {
    id: EffectId,
    effect: Arc<dyn Effect>,
    values: Vec<f64>,
    /// How the fitted numbers move beside it; none for an effect that is in the model.
    beside: Option<Vec<f64>>,
}

/// One row: what is left without the effect, what the effect does, what a unit of its motion does, each by reading, mm; and the points measured.
struct RowParts {
    row: usize,
    left: Vec<f64>,
    does: Vec<f64>,
    motion: Vec<f64>,
    points: f64,
}

impl RowParts {
    /// How far a unit of the motion moves a point of the row, mm.
    fn lever(&self) -> f64 {
        (dot(&self.motion, &self.motion) / self.points).sqrt()
    }
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}

impl Laboratory {
    /// The plots of some effects, as `add` takes them; one that these rows cannot show has none.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn effect_plots(
        &self,
        effects: &[String],
        progress: &Progress,
    ) -> Result<Vec<EffectPlot>, LaboratoryError> {
        // What a residual map takes away is not explained.
        if let Some(plain) = self.without_map() {
            return plain.effect_plots(effects, progress);
        }
        let known = effects.iter().filter_map(|text| effect::expand(text, self.model()).ok());
        let ids = known.filter_map(|ids| ids.into_iter().next());
        let (by_epoch, other): (Vec<EffectId>, Vec<EffectId>) = ids.partition(|id| acts_by_epoch(&id.name));
        let mut plots = self.plots_of(&other, progress)?;
        if !by_epoch.is_empty() {
            match self.dated_for(by_epoch.iter(), progress)? {
                Some(dated) => plots.extend(dated.plots_of(&by_epoch, progress)?),
                None => plots.extend(self.plots_of(&by_epoch, progress)?),
            }
        }
        Ok(plots)
    }

    fn plots_of(&self, ids: &[EffectId], progress: &Progress) -> Result<Vec<EffectPlot>, LaboratoryError> {
        if ids.is_empty() {
            return Ok(Vec::new());
        }
        let fitted = self.fit_with(&[], None, progress)?;
        let mut requested: Vec<Probe> = probes(self);
        // With every number that is searched for inside: the best of them is drawn.
        requested.retain(|probe| ids.iter().any(|id| probe.id.same_as(id)));
        let scores = score(&fitted.problem, &fitted.fit, &requested);
        let best = best_variants(&requested, scores);
        let valued =
            ids.iter().filter_map(|id| in_model(&fitted, id).or_else(|| expected(&requested, &best, id)));
        Ok(valued.filter_map(|effect| self.plot(&fitted, &effect)).collect())
    }

    fn plot(&self, fitted: &Fitted<'_>, valued: &Valued) -> Option<EffectPlot> {
        let regressor = Regressor::of(&fitted.problem, &fitted.fit.state, &valued.id);
        let motion = regressor.as_ref().and_then(|_| CommonMotion::of(fitted, valued));
        let unit = fitted.problem.observations.unit().symbol();
        let (across, up, points, curve) = match (regressor, motion) {
            (Some(regressor), Some(motion)) => {
                let up = PlotAxis::new(self.motion_name(valued, &motion), unit);
                let (points, curve) = against_driver(fitted, valued, &motion, &regressor.values);
                (regressor.axis, up, points, curve)
            }
            _ => {
                let (points, curve) = against_prediction(fitted, valued);
                let across = PlotAxis::new("predicted by the effect", unit);
                (across, PlotAxis::new("left without it, along what it predicts", unit), points, curve)
            }
        };
        let about_zero = root_mean_square(points.iter().map(|(_, y, _, _)| *y));
        let about_curve = root_mean_square(points.iter().map(|(_, y, fitted, _)| y - fitted));
        (points.len() > 1).then(|| EffectPlot {
            effect: self.model().label(&valued.id),
            added: valued.beside.is_none(),
            across,
            up,
            points: points.iter().map(|(x, y, _, row)| (*x, *y, *row)).collect(),
            curve,
            rms_mm: [about_zero, about_curve],
        })
    }

    /// What the vertical axis shows: along which motion.
    fn motion_name(&self, valued: &Valued, motion: &CommonMotion) -> String {
        match motion.unit.dofs.first() {
            Some((Dof::Joint(joint, plumb_kinematics::DhParameter::Theta), _)) => {
                format!(
                    "left without it, along the motion of {}",
                    self.model().site_name(Site::Joint(*joint))
                )
            }
            _ => format!("left without it, along what {} moves", valued.id.name),
        }
    }
}

/// An effect that is in the model, at its fitted values.
fn in_model(fitted: &Fitted<'_>, id: &EffectId) -> Option<Valued> {
    let index = fitted.problem.parts.iter().position(|part| part.id.same_as(id))?;
    let part = fitted.problem.parts.get(index)?;
    let values = fitted.fit.state.effects.get(index)?.clone();
    Some(Valued { id: part.id.clone(), effect: Arc::clone(&part.effect), values, beside: None })
}

/// An effect that is not in the model, at the values its score expects.
fn expected(requested: &[Probe], best: &[(usize, Score)], id: &EffectId) -> Option<Valued> {
    let (probe, score) = best
        .iter()
        .filter_map(|(index, score)| Some((requested.get(*index)?, score)))
        .find(|(probe, _)| probe.id.same_as(id))?;
    Some(Valued {
        id: probe.id.clone(),
        effect: Arc::clone(&probe.effect),
        values: score.values.clone(),
        beside: Some(score.beside.clone()),
    })
}

/// The one motion all of an effect's parameters drive, and by how much in every row.
struct CommonMotion {
    unit: UnitMotion,
    /// What the effect moves by, in units of the motion, for every row.
    amount: Vec<f64>,
}

impl CommonMotion {
    /// Nothing where the parameters move different things, or something that is itself different from row to row.
    fn of(fitted: &Fitted<'_>, valued: &Valued) -> Option<Self> {
        let (problem, state) = (&fitted.problem, &fitted.fit.state);
        let rows: Vec<Vec<Contribution>> = (0..problem.table.len())
            .map(|row| problem.contributions(state, row, valued.effect.as_ref()))
            .collect();
        // Where it moves most, the proportions of what it moves are known best.
        let sizes = rows.iter().map(|contributions| {
            contributions.iter().map(|contribution| contribution.rate.abs()).sum::<f64>()
        });
        let (strongest, _) = rows.iter().zip(sizes).max_by(|one, other| one.1.total_cmp(&other.1))?;
        let mut dofs: Vec<(Dof, f64)> = Vec::new();
        for contribution in strongest.iter().filter(|contribution| contribution.rate != 0.0) {
            match dofs.iter_mut().find(|(dof, _)| *dof == contribution.dof) {
                Some((_, rate)) => *rate += contribution.rate,
                None => dofs.push((contribution.dof, contribution.rate)),
            }
        }
        let (first, reference) = *dofs.first()?;
        if reference == 0.0 || matches!(first, Dof::Twist { .. }) {
            return None;
        }
        if dofs.len() > 1 && (valued.values.len() > 1 || !in_proportion(&rows, &dofs)) {
            return None;
        }
        // The effect is linear in its values; each drives by its own rate.
        let amount = rows.iter().map(|contributions| {
            let own = contributions.iter().filter(|contribution| contribution.dof == first);
            own.map(|contribution| {
                contribution.rate * valued.values.get(contribution.parameter).copied().unwrap_or(0.0)
            })
            .sum()
        });
        let unit = if dofs.len() > 1 {
            dofs.iter().map(|(dof, rate)| (*dof, rate / reference)).collect()
        } else {
            vec![(first, 1.0)]
        };
        let parameters = [Parameter::new("unit", Unit::RATIO, (-1.0, 1.0))];
        Some(Self { amount: amount.collect(), unit: UnitMotion { dofs: unit, parameters } })
    }
}

/// Whether what one parameter drives keeps its proportions in every row.
fn in_proportion(rows: &[Vec<Contribution>], dofs: &[(Dof, f64)]) -> bool {
    let Some((first, reference)) = dofs.first() else { return false };
    rows.iter().all(|contributions| {
        let here = rate_of(contributions, first) / reference;
        dofs.iter().all(|(dof, of_strongest)| {
            (rate_of(contributions, dof) - here * of_strongest).abs() <= PROPORTIONAL * of_strongest.abs()
        })
    })
}

/// How fast one degree of freedom changes in all.
fn rate_of(contributions: &[Contribution], dof: &Dof) -> f64 {
    contributions
        .iter()
        .filter(|contribution| contribution.dof == *dof)
        .map(|contribution| contribution.rate)
        .sum()
}

/// What the rows in which something was measured say of an effect.
fn row_parts(fitted: &Fitted<'_>, valued: &Valued, unit: Option<&UnitMotion>) -> Vec<RowParts> {
    let (problem, fit) = (&fitted.problem, &fitted.fit);
    let unit_shown = problem.observations.unit();
    let mut probes: Vec<&dyn Effect> = vec![valued.effect.as_ref()];
    probes.extend(unit.map(|unit| unit as &dyn Effect));
    let free_parameters = problem.free_parameters().len();
    let ones = vec![1.0; problem.table.len()];
    let mut all = Vec::new();
    for row in (0..problem.table.len()).filter(|row| !problem.observations.range(*row).is_empty()) {
        // Without the fit's weights: an outlier is drawn where it is.
        let block = problem.block(&fit.state, &[row], &ones, &probes);
        let mut parts = RowParts { row, left: Vec::new(), does: Vec::new(), motion: Vec::new(), points: 1.0 };
        for (index, equation) in problem.observations.of_row(row).iter().enumerate() {
            let Some(factor) = equation.factor_in(unit_shown) else { continue };
            let unit_of = equation.sigma * factor;
            let does = weighed(&block.jacobian, index, free_parameters, &valued.values) * unit_of;
            let residual = block.residuals.get(index).copied().unwrap_or(0.0) * unit_of;
            parts.left.push(match &valued.beside {
                Some(beside) => residual - weighed(&block.jacobian, index, 0, beside) * unit_of,
                // In the model: its own part is put back. Not in it: what is fitted steps aside as it would if it came in.
                None => residual + does,
            });
            parts.does.push(does);
            let after = free_parameters + valued.values.len();
            parts.motion.push(weighed(&block.jacobian, index, after, &[1.0]) * unit_of);
        }
        parts.points = points_in(problem, &[row]).max(1) as f64;
        if parts.left.iter().chain(&parts.does).all(|value| value.is_finite()) {
            all.push(parts);
        }
    }
    all
}

/// What some parameters, from `first` on, do to one reading at these values.
fn weighed(jacobian: &DMatrix<f64>, reading: usize, first: usize, values: &[f64]) -> f64 {
    let each = values.iter().enumerate();
    each.map(|(index, value)| jacobian.get((first + index, reading)).copied().unwrap_or(0.0) * value).sum()
}

/// What drives the effect, what is left, what the effect does there, and the row.
type Drawn = Vec<(f64, f64, f64, usize)>;

/// What is left along a motion against what drives it, at the root mean square lever; and the curve.
fn against_driver(
    fitted: &Fitted<'_>,
    valued: &Valued,
    motion: &CommonMotion,
    drivers: &[f64],
) -> (Drawn, Vec<(f64, f64)>) {
    let rows = row_parts(fitted, valued, Some(&motion.unit));
    let typical = root_mean_square(rows.iter().map(RowParts::lever));
    let seen = rows.iter().filter(|parts| parts.lever() > SHORTEST_LEVER * typical);
    let drawn = seen.filter_map(|parts| {
        let across = drivers.get(parts.row).copied().filter(|driver| driver.is_finite())?;
        let amount = motion.amount.get(parts.row).copied().unwrap_or(0.0);
        // Least squares of one number in one row: how far the motion would have to go.
        let left = dot(&parts.left, &parts.motion) / dot(&parts.motion, &parts.motion);
        Some((across, left * typical, amount * typical, parts.row))
    });
    let drawn: Drawn = drawn.collect();
    let curve = wave(fitted, valued, &drawn, typical).unwrap_or_else(|| through(&drawn));
    (drawn, curve)
}

/// How far the angle of a wave goes (rad) for a unit of its driver as it is shown, degrees of a joint or mm of a slide; nothing of what is no wave.
fn wave_rate(fitted: &Fitted<'_>, id: &EffectId) -> Option<f64> {
    let row = fitted.problem.model.chain.joints.get(id.joint()?)?;
    match effect::kind(&id.name)?.driven_by {
        DrivenBy::Waves => Some(id.order?.to_radians()),
        DrivenBy::ScrewTurn => Some(TAU * id.order? / row.screw_pitch?),
        _ => None,
    }
}

/// A wave of a joint between the poses too: they may be fewer than its periods.
fn wave(fitted: &Fitted<'_>, valued: &Valued, drawn: &Drawn, lever: f64) -> Option<Vec<(f64, f64)>> {
    let rate = wave_rate(fitted, &valued.id)?;
    let sign = fitted.problem.model.chain.joints.get(valued.id.joint()?)?.sign;
    let [sine, cosine] = [0, 1].map(|index| valued.values.get(index).copied().unwrap_or(0.0));
    let (low, high) = drawn
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), point| (low.min(point.0), high.max(point.0)));
    let points = (0..CURVE_POINTS).map(|step| {
        let across = low + (high - low) * step as f64 / (CURVE_POINTS - 1) as f64;
        let (own_sine, own_cosine) = (rate * across).sin_cos();
        (across, lever * sign * (sine * own_sine + cosine * own_cosine))
    });
    (high > low).then(|| points.collect())
}

/// The curve through what the effect does in the rows, from left to right: the mean where several rows share a place.
fn through(drawn: &Drawn) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = drawn.iter().map(|(across, _, does, _)| (*across, *does)).collect();
    points.sort_by(|one, other| one.0.total_cmp(&other.0));
    // Rows nearer than a column of the plot share one point, or the curve would jump between replicates.
    let width = match (points.first(), points.last()) {
        (Some(first), Some(last)) => (last.0 - first.0) / CURVE_POINTS as f64,
        _ => return Vec::new(),
    };
    let mut curve: Vec<(f64, f64, f64)> = Vec::new();
    let mut begin = f64::NEG_INFINITY;
    for (across, does) in points {
        match curve.last_mut() {
            Some((sum, value, count)) if across - begin <= width => {
                (*sum, *value, *count) = (*sum + across, *value + does, *count + 1.0);
            }
            _ => {
                begin = across;
                curve.push((across, does, 1.0));
            }
        }
    }
    curve.into_iter().map(|(across, does, count)| (across / count, does / count)).collect()
}

/// What is left along what the effect predicts against how much that is; the curve is the diagonal.
fn against_prediction(fitted: &Fitted<'_>, valued: &Valued) -> (Drawn, Vec<(f64, f64)>) {
    let points = row_parts(fitted, valued, None).into_iter().filter_map(|parts| {
        let length = dot(&parts.does, &parts.does).sqrt();
        let scale = parts.points.sqrt();
        // Where it does nothing there is no direction to see what is left along.
        (length > 0.0).then(|| {
            (length / scale, dot(&parts.left, &parts.does) / length / scale, length / scale, parts.row)
        })
    });
    let drawn: Drawn = points.collect();
    let most = drawn.iter().map(|point| point.0).fold(0.0, f64::max);
    (drawn, vec![(0.0, 0.0), (most, most)])
}

#[cfg(test)]
mod tests {
    use plumb_calibration::arm_model::Model;

    use super::*;
    use crate::testing::two_links;

    /// An amplitude of 0.2 degrees three times a turn of the elbow, whose lever is always 150 mm; noise 0.02 mm.
    fn wavy() -> Laboratory {
        two_links(80, "", 0.02, 7, |[_, elbow]| [0.0, 0.2_f64.to_radians() * (3.0 * elbow).sin()])
    }

    fn plot_of(laboratory: &Laboratory, effect: &str) -> EffectPlot {
        let plots = laboratory.effect_plots(&[effect.to_owned()], &Progress::unwatched()).unwrap();
        plots.into_iter().next().unwrap()
    }

    #[test]
    fn a_candidates_plot_shows_what_is_left_along_its_motion_against_what_drives_it_with_its_curve() {
        let plot = plot_of(&wavy(), "joint_harmonic(elbow, 3)");
        assert_eq!((plot.across.title().as_str(), plot.added), ("elbow, deg", false));
        assert_eq!(plot.up.title(), "left without it, along the motion of elbow, mm");
        assert_eq!(plot.points.len(), 80);
        // 150 mm times 0.2 degrees is 0.524 mm.
        let highest = plot.curve.iter().map(|point| point.1).fold(0.0, f64::max);
        assert!((highest - 0.524).abs() < 0.02, "{highest}");
        // From the least to the greatest angle that was measured, as far apart everywhere.
        assert_eq!(plot.curve.len(), CURVE_POINTS);
        let angles = || plot.points.iter().map(|point| point.0);
        let (low, high) =
            (angles().fold(f64::INFINITY, f64::min), angles().fold(f64::NEG_INFINITY, f64::max));
        for (step, (across, up)) in plot.curve.iter().enumerate() {
            let expected = low + (high - low) * step as f64 / 239.0;
            assert!((across - expected).abs() < 1e-9, "{across} for {expected}");
            let true_one = 0.524 * (3.0 * across.to_radians()).sin();
            assert!((up - true_one).abs() < 0.02, "at {across}: {up} for {true_one}");
        }
        let [about_zero, about_curve] = plot.rms_mm;
        assert!(about_zero > 0.3 && about_curve < 0.03, "{about_zero} {about_curve}");
        for (across, up, _) in &plot.points {
            let true_one = 0.524 * (3.0 * across.to_radians()).sin();
            assert!((up - true_one).abs() < 0.1, "at {across}: {up} for {true_one}");
        }
    }

    #[test]
    fn an_effect_that_is_in_the_model_has_the_same_plot() {
        let laboratory = wavy();
        let progress = Progress::unwatched();
        let model: Model = laboratory.add("joint_harmonic(elbow, 3)", &progress).unwrap().model;
        let grown = Laboratory::new(model, laboratory.table().clone(), laboratory.options().clone()).unwrap();
        let (before, after) =
            (plot_of(&laboratory, "joint_harmonic(elbow, 3)"), plot_of(&grown, "joint_harmonic(elbow, 3)"));
        assert!(after.added);
        for (one, other) in before.points.iter().zip(&after.points) {
            assert!((one.1 - other.1).abs() < 0.01, "{one:?} {other:?}");
        }
    }

    #[test]
    fn what_was_reset_is_drawn_with_the_moment_that_the_rows_show() {
        let laboratory = crate::testing::by_wire(120, 0.05, 8, |row| if row < 60 { 0.0 } else { 0.5 });
        let plot = plot_of(&laboratory, "reading_reset(distance)");
        assert!(!plot.added && plot.points.len() > 100, "{} points", plot.points.len());
        let [about_zero, about_curve] = plot.rms_mm;
        assert!(about_zero > 0.3 && about_curve < 0.08, "{about_zero} {about_curve}");
    }

    #[test]
    fn what_one_parameter_drives_keeps_its_proportions_or_does_not() {
        let dof = |joint: usize| Dof::Joint(joint, plumb_kinematics::DhParameter::Theta);
        let contribution = |joint: usize, rate: f64| Contribution { parameter: 0, dof: dof(joint), rate };
        let strongest = [(dof(0), 2.0), (dof(1), -1.0)];
        let row =
            |scale: f64, other: f64| vec![contribution(0, 2.0 * scale), contribution(1, -scale + other)];
        assert!(in_proportion(&[row(1.0, 0.0), row(0.3, 0.0), row(0.0, 0.0)], &strongest));
        assert!(!in_proportion(&[row(1.0, 0.0), row(0.3, 1e-3)], &strongest));
        assert_eq!(
            rate_of(&[contribution(0, 2.0), contribution(1, 5.0), contribution(0, 0.5)], &dof(0)),
            2.5
        );
        assert!(!in_proportion(&[row(1.0, 0.0)], &[]));
    }

    #[test]
    fn an_effect_of_several_motions_is_drawn_against_what_it_predicts() {
        let laboratory = two_links(60, "", 0.02, 9, |_| [0.0, 0.0]);
        let plot = plot_of(&laboratory, "base_position");
        assert_eq!(plot.across.title(), "predicted by the effect, mm");
        assert_eq!(plot.curve.len(), 2);
        assert_eq!(plot.curve[0], (0.0, 0.0));
        assert_eq!(plot.curve[1].0, plot.curve[1].1, "the diagonal");
    }

    /// The shoulder's motion moves a point of a folded arm of two links, 200 mm and 195 mm, hardly at all.
    #[test]
    fn rows_in_which_the_motion_hardly_moves_the_point_are_not_drawn() {
        let model =
            crate::testing::TWO_LINKS.replace("a_mm: 150", "a_mm: 195").replace("150, 150", "180, 180");
        let model = Model::parse("model.yaml", &format!("{model}free: []\n")).unwrap();
        let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
        let levers: Vec<f64> = (0..40)
            .map(|row| {
                let (first, second) = (-80.0 + 4.0 * f64::from(row), 4.4 * f64::from(row));
                let [own, both] = [first, first + second].map(f64::to_radians);
                let (x, y) = (200.0 * own.cos() + 195.0 * both.cos(), 200.0 * own.sin() + 195.0 * both.sin());
                text.push_str(&format!("{first},{second},{:.9},{y:.9},0\n", x + 0.01 * f64::from(row % 3)));
                x.hypot(y)
            })
            .collect();
        let table = plumb_calibration::table::Table::parse("table.csv", &text).unwrap();
        let options = crate::laboratory::Options {
            holdout: crate::split::Holdout::None,
            ..crate::laboratory::Options::default()
        };
        let laboratory = Laboratory::new(model, table, options).unwrap();
        let typical = root_mean_square(levers.iter().copied());
        let far = levers.iter().filter(|lever| **lever > 0.2 * typical).count();
        assert!((30..40).contains(&far), "{far}");
        assert_eq!(plot_of(&laboratory, "joint_zero(shoulder)").points.len(), far);
    }

    #[test]
    fn a_curve_goes_through_the_means_of_what_shares_a_place() {
        let drawn = vec![(10.0, 0.0, 5.0, 0), (0.0, 9.0, 1.0, 1), (0.0, -9.0, 3.0, 2), (5.0, 0.0, 4.0, 3)];
        assert_eq!(through(&drawn), [(0.0, 2.0), (5.0, 4.0), (10.0, 5.0)]);
        assert_eq!(through(&Vec::new()), []);
        // A column is the 240th part of the picture: what is nearer shares a point, in the middle of its places.
        let near = vec![(0.0, 0.0, 1.0, 0), (0.9, 0.0, 3.0, 1), (2.0, 0.0, 7.0, 2), (240.0, 0.0, 8.0, 3)];
        assert_eq!(through(&near), [(0.45, 2.0), (2.0, 7.0), (240.0, 8.0)]);
    }

    /// Two points of the hand, and the base 1.5 mm further along x than the model has it.
    #[test]
    fn where_all_that_is_left_is_the_effect_its_points_lie_on_the_diagonal_for_one_point_of_a_row() {
        let model = crate::testing::TWO_LINKS
            .replace("targets: {", "targets: {p2: {xyz_mm: [0, 0, 20], free: false}, ");
        let model = Model::parse("model.yaml", &format!("{model}free: []\n")).unwrap();
        let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm,p2_x_mm,p2_y_mm,p2_z_mm\n".to_owned();
        for row in 0..30 {
            let (first, second) = (-140.0 + 9.0 * f64::from(row), -90.0 + 37.0 * f64::from(row % 6));
            let [own, both] = [first, first + second].map(f64::to_radians);
            let (x, y) = (200.0 * own.cos() + 150.0 * both.cos(), 200.0 * own.sin() + 150.0 * both.sin());
            text.push_str(&format!("{first},{second},{:.9},{y:.9},0,{:.9},{y:.9},20\n", x + 1.5, x + 1.5));
        }
        let table = plumb_calibration::table::Table::parse("table.csv", &text).unwrap();
        let options = crate::laboratory::Options {
            holdout: crate::split::Holdout::None,
            ..crate::laboratory::Options::default()
        };
        let laboratory = Laboratory::new(model, table, options).unwrap();
        let plot = plot_of(&laboratory, "base_position");
        assert_eq!(plot.points.len(), 30);
        for (predicted, left, _) in &plot.points {
            assert!((predicted - 1.5).abs() < 1e-6 && (left - 1.5).abs() < 1e-6, "{predicted} {left}");
        }
        let [about_zero, about_curve] = plot.rms_mm;
        assert!((about_zero - 1.5).abs() < 1e-6 && about_curve < 1e-6, "{about_zero} {about_curve}");
    }

    #[test]
    fn what_the_rows_cannot_show_or_nobody_knows_has_no_plot() {
        let laboratory = wavy();
        let asked =
            ["thermal_growth(elbow)", "joint_nonsense(elbow)", "joint_zero(shoulder"].map(str::to_owned);
        assert_eq!(laboratory.effect_plots(&asked, &Progress::unwatched()).unwrap(), []);
        let cancelled = Progress::default();
        cancelled.cancel();
        let asked = ["joint_zero(elbow)".to_owned()];
        assert!(laboratory.effect_plots(&asked, &cancelled).is_err());
    }

    #[test]
    fn the_angle_of_a_wave_goes_by_degrees_of_a_joint_or_by_turns_of_a_screw() {
        let slides = "arm: axes\nconvention: distal\njoints:\n  - {name: turn, a_mm: 100}\n  - {name: slide, slides: true, screw_pitch_mm: 5}\ntargets: {p1: {}}\nmeasured_from: world\n";
        let model = Model::parse("m.yaml", slides).unwrap();
        let rows: String = (0..6).map(|row| format!("{},{},1,2,3\n", 10 * row, row * row)).collect();
        let table = plumb_calibration::table::Table::parse(
            "t.csv",
            &format!("q1_deg,q2_mm,p1_x_mm,p1_y_mm,p1_z_mm\n{rows}"),
        )
        .unwrap();
        let lab = Laboratory::new(model, table, crate::laboratory::Options::default()).unwrap();
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let rate = |text: &str| wave_rate(&fitted, &effect::parse(text, lab.model()).unwrap());
        assert!((rate("joint_harmonic(turn, 3)").unwrap() - 3.0 * TAU / 360.0).abs() < 1e-12);
        assert!((rate("screw_wave(slide, 2)").unwrap() - 2.0 * TAU / 5.0).abs() < 1e-12);
        assert_eq!(rate("joint_gain(turn)"), None);
    }
}
