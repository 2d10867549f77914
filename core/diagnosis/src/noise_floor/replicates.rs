//! What returns to one pose say.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::sample::sampled;
use plumb_calibration::arm_model::Model;
use plumb_calibration::effect::{self, CandidateContext, DatasetSummary, Effect, EffectId, Site};
use plumb_calibration::fit::{Fit, ResidualModel, RowBlock};

/// Stands for a gap between the two sides from which a joint arrives that may differ from pose to pose.
pub(crate) const SIDE_OF_APPROACH: &str = "side_of_approach";

/// What returns to one pose say: deviations from their own mean, and the columns of effects that depend on conditions.
pub(crate) struct Replicates {
    /// Row of the table and group of each member.
    pub(crate) members: Vec<(usize, usize)>,
    /// Whitened residuals of each member's equations.
    pub(crate) residuals: Vec<DVector<f64>>,
    /// Whitened columns of each member, parameters of all candidates side by side.
    pub(crate) columns: Vec<DMatrix<f64>>,
    /// Per member and joint: how its equations move with the joint, whitened.
    pub(crate) motions: Vec<Vec<DVector<f64>>>,
    /// Ways in which the base or a target may be in two places, with what each moves per member: one column a number.
    pub(crate) loose: Vec<(EffectId, Vec<DMatrix<f64>>)>,
    /// Candidates with the range of their columns.
    pub(crate) candidates: Vec<(EffectId, Range<usize>)>,
    /// Number of groups.
    pub(crate) groups: usize,
}

/// Effects whose derivatives are wanted of every replicate.
struct Asked {
    /// Effects that depend on conditions: the library's, then the model file's own.
    conditions: Vec<(EffectId, Box<dyn Effect>)>,
    /// Zero of every joint: how the readings move with it.
    zeros: Vec<Box<dyn Effect>>,
    /// What may be in two places besides a joint: base and targets.
    loose: Vec<(EffectId, Box<dyn Effect>)>,
}

/// Effects that can be built for a model.
fn built(ids: impl IntoIterator<Item = EffectId>, model: &Model) -> Vec<(EffectId, Box<dyn Effect>)> {
    let pairs = ids.into_iter().map(|id| (effect::build(&id, model), id));
    pairs.filter_map(|(effect, id)| effect.ok().map(|effect| (id, effect))).collect()
}

/// Moments between which a jump may be dated: those of the replicates themselves.
pub(super) fn clocks(problem: &ResidualModel<'_>, groups: &[Vec<usize>]) -> Vec<f64> {
    let mut clocks: Vec<f64> = groups.iter().flatten().filter_map(|row| problem.clock(*row)).collect();
    clocks.sort_by(f64::total_cmp);
    clocks.dedup();
    clocks
}

impl Asked {
    fn of(model: &Model, context: &CandidateContext<'_>) -> Self {
        let library = effect::kinds().iter().filter(|kind| kind.depends_on_conditions);
        let own = model.definitions.iter().filter(|definition| definition.depends_on_conditions());
        let conditions = library
            .flat_map(|kind| (kind.candidates)(context))
            .chain(own.map(|definition| EffectId::at(&definition.name, definition.site)));
        let joints = (0..model.chain.len()).map(|joint| EffectId::at("joint_zero", Site::Joint(joint)));
        let base = ["base_position", "base_tilt"].map(|name| EffectId::at(name, Site::Base));
        let targets = 0..model.targets.len();
        let targets = targets.map(|target| EffectId::at("tool_offset", Site::Target(target)));
        Self {
            conditions: built(conditions, model),
            zeros: built(joints, model).into_iter().map(|(_, effect)| effect).collect(),
            loose: built(base.into_iter().chain(targets), model),
        }
    }

    /// All of them, in the order of their derivatives.
    fn probes(&self) -> Vec<&dyn Effect> {
        let conditions = self.conditions.iter().map(|(_, effect)| effect.as_ref());
        let zeros = self.zeros.iter().map(Box::as_ref);
        conditions.chain(zeros).chain(self.loose.iter().map(|(_, effect)| effect.as_ref())).collect()
    }

    /// The candidates for the noise floor with the range of their columns. A gap between the two approach directions may differ
    /// from pose to pose (worn teeth, friction): it has a column a group.
    fn candidates(&self, gaps: &[usize], groups: usize) -> Vec<(EffectId, Range<usize>)> {
        let conditions = self.conditions.iter().map(|(id, effect)| (id.clone(), effect.parameters().len()));
        let gaps = gaps.iter().map(|joint| (EffectId::at(SIDE_OF_APPROACH, Site::Joint(*joint)), groups));
        let mut first = 0;
        let numbered = conditions.chain(gaps).map(|(id, count)| {
            first += count;
            (id, first - count..first)
        });
        numbered.collect()
    }
}

/// The rows of a group that read the same as its first: only equations every replicate has can be compared.
fn comparable(problem: &ResidualModel<'_>, rows: &[usize]) -> Vec<usize> {
    let Some(first) = rows.first().map(|row| problem.observations.of_row(*row)) else { return Vec::new() };
    let first: Vec<_> = first.iter().map(|equation| equation.measurand).collect();
    let alike = rows.iter().filter(|row| {
        let own = problem.observations.of_row(**row).iter().map(|equation| equation.measurand);
        !first.is_empty() && own.eq(first.iter().copied())
    });
    alike.copied().collect()
}

impl Replicates {
    /// Whether a candidate is a gap between the two approach directions of a joint.
    pub(crate) fn is_gap(&self, candidate: usize) -> bool {
        self.candidates.get(candidate).is_some_and(|(id, _)| id.name == SIDE_OF_APPROACH)
    }

    /// Gathers them; nothing if no pose was returned to.
    pub(crate) fn gather(
        problem: &ResidualModel<'_>,
        fit: &Fit,
        context: &CandidateContext<'_>,
    ) -> Option<Self> {
        let groups = sampled(problem.table.returns(), problem.model.chain.len());
        if groups.is_empty() {
            return None;
        }
        // A jump between two replicates can be dated by replicates alone; the other rows say nothing here.
        let summary = DatasetSummary { clocks: clocks(problem, &groups), ..context.summary.clone() };
        let asked = Asked::of(problem.model, &CandidateContext { model: context.model, summary: &summary });
        let joints = 0..asked.zeros.len();
        let gaps: Vec<usize> = joints.filter(|joint| context.summary.has_both_sides(*joint)).collect();
        let mut all = Self {
            members: Vec::new(),
            residuals: Vec::new(),
            columns: Vec::new(),
            motions: Vec::new(),
            loose: asked.loose.iter().map(|(id, _)| (id.clone(), Vec::new())).collect(),
            candidates: asked.candidates(&gaps, groups.len()),
            groups: groups.len(),
        };
        let probes = asked.probes();
        // Not the fit's robust weights: rows that the model misses may return well, and it is the returning that is measured.
        let ones = vec![1.0; problem.table.len()];
        for (group, rows) in groups.iter().enumerate() {
            for row in comparable(problem, rows) {
                let block = problem.block(&fit.state, &[row], &ones, &probes);
                let sides: Vec<(usize, f64)> = gaps
                    .iter()
                    .map(|joint| (*joint, f64::from(problem.table.approach_of(row, *joint))))
                    .collect();
                all.add((row, group), &asked, problem.free_parameters().len(), block, &sides);
            }
        }
        Some(all)
    }

    /// Adds one row: `block` holds the derivatives by the fitted parameters (`free_parameters` of them), then by everything asked; `sides`
    /// says from which side each joint with a gap arrived.
    fn add(
        &mut self,
        (row, group): (usize, usize),
        asked: &Asked,
        free_parameters: usize,
        block: RowBlock,
        sides: &[(usize, f64)],
    ) {
        let known: usize = asked.conditions.iter().map(|(_, effect)| effect.parameters().len()).sum();
        let motions: Vec<DVector<f64>> = (0..asked.zeros.len())
            .map(|joint| block.jacobian.row(free_parameters + known + joint).transpose())
            .collect();
        let count = self.candidates.last().map_or(0, |(_, range)| range.end);
        let mut columns = DMatrix::zeros(block.jacobian.ncols(), count);
        columns.columns_mut(0, known).copy_from(&block.jacobian.rows(free_parameters, known).transpose());
        for (index, (joint, side)) in sides.iter().enumerate() {
            columns.column_mut(known + index * self.groups + group).copy_from(&(&motions[*joint] * *side));
        }
        let mut first = free_parameters + known + motions.len();
        for ((_, members), (_, effect)) in self.loose.iter_mut().zip(&asked.loose) {
            let count = effect.parameters().len();
            members.push(block.jacobian.rows(first, count).transpose());
            first += count;
        }
        self.members.push((row, group));
        self.residuals.push(DVector::from_vec(block.residuals));
        self.columns.push(columns);
        self.motions.push(motions);
    }

    /// Deviations of residuals and of the given columns from their group's weighted mean.
    pub(super) fn centred(
        &self,
        weights: &[f64],
        requested: &[usize],
    ) -> (Vec<DVector<f64>>, Vec<DMatrix<f64>>) {
        let mut residuals = self.residuals.clone();
        let mut columns: Vec<DMatrix<f64>> =
            self.columns.iter().map(|columns| columns.select_columns(requested)).collect();
        for group in 0..self.groups {
            let own: Vec<usize> =
                (0..self.members.len()).filter(|member| self.members[*member].1 == group).collect();
            let total: f64 = own.iter().map(|member| weights[*member]).sum();
            let Some(first) = own.first() else { continue };
            if total <= 0.0 {
                continue;
            }
            let mut mean = DVector::zeros(residuals[*first].len());
            let mut mean_columns = DMatrix::zeros(columns[*first].nrows(), columns[*first].ncols());
            for member in &own {
                mean += &residuals[*member] * (weights[*member] / total);
                mean_columns += &columns[*member] * (weights[*member] / total);
            }
            for member in &own {
                residuals[*member] -= &mean;
                columns[*member] -= &mean_columns;
            }
        }
        (residuals, columns)
    }

    /// Degrees of freedom within groups, before any allowance; `kept` says which members count.
    pub(super) fn freedom(&self, kept: &[f64]) -> usize {
        let mut seen = vec![false; self.groups];
        let mut freedom = 0;
        for (((_, group), residuals), _) in
            self.members.iter().zip(&self.residuals).zip(kept).filter(|(_, kept)| **kept > 0.0)
        {
            if let Some(seen) = seen.get_mut(*group) {
                // The first of a group pays for the group's mean.
                freedom += if *seen { residuals.len() } else { 0 };
                *seen = true;
            }
        }
        freedom
    }
}
