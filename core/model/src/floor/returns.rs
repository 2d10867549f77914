//! What returns to one pose say.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::sample::sampled;
use crate::effect::{self, Effect, EffectId, Spot, Survey};
use crate::fit::{Fit, Machine};

/// Stands for a gap between the two sides from which a joint arrives that may differ from pose to pose.
pub(crate) const SIDE_OF_APPROACH: &str = "side_of_approach";

/// What returns to one pose say: deviations from their own mean, and the columns of effects that depend on conditions.
pub(crate) struct Returns {
    /// Row of the table and group of each member.
    pub(crate) members: Vec<(usize, usize)>,
    /// Whitened residuals of each member's equations.
    pub(crate) residuals: Vec<DVector<f64>>,
    /// Whitened columns of each member, parameters of all candidates side by side.
    pub(crate) columns: Vec<DMatrix<f64>>,
    /// Per member and joint: how its equations move with the joint, whitened.
    pub(crate) motions: Vec<Vec<DVector<f64>>>,
    /// Ways in which the base or a target may stand in two places, with what each moves per member: one column a number.
    pub(crate) loose: Vec<(EffectId, Vec<DMatrix<f64>>)>,
    /// Candidates with the range of their columns.
    pub(crate) candidates: Vec<(EffectId, Range<usize>)>,
    /// Number of groups.
    pub(crate) groups: usize,
}

impl Returns {
    /// Gathers them; nothing if no pose was returned to.
    pub(crate) fn gather(machine: &Machine<'_>, fit: &Fit, survey: &Survey<'_>) -> Option<Self> {
        let groups = sampled(machine.table.returns(), machine.model.chain.len());
        if groups.is_empty() {
            return None;
        }
        // A jump between two returns is dated by the returns themselves.
        let mut passport = survey.passport.clone();
        let mut clocks: Vec<f64> = groups.iter().flatten().filter_map(|row| machine.clock(*row)).collect();
        clocks.sort_by(f64::total_cmp);
        clocks.dedup();
        passport.clocks = clocks;
        let survey = &Survey { model: survey.model, passport: &passport };
        let ids: Vec<EffectId> = effect::kinds()
            .iter()
            .filter(|kind| kind.depends_on_conditions)
            .flat_map(|kind| (kind.candidates)(survey))
            .chain(
                machine
                    .model
                    .definitions
                    .iter()
                    .filter(|definition| definition.depends_on_conditions())
                    .map(|definition| EffectId::at(&definition.name, definition.spot)),
            )
            .collect();
        let built: Vec<(EffectId, Box<dyn Effect>)> = ids
            .into_iter()
            .filter_map(|id| effect::build(&id, machine.model).ok().map(|effect| (id, effect)))
            .collect();
        let zeros: Vec<Box<dyn Effect>> = (0..machine.model.chain.len())
            .filter_map(|joint| {
                effect::build(&EffectId::at("joint_zero", Spot::Joint(joint)), machine.model).ok()
            })
            .collect();
        let probes: Vec<&dyn Effect> =
            built.iter().map(|(_, effect)| effect.as_ref()).chain(zeros.iter().map(Box::as_ref)).collect();
        let mut loose_ids =
            vec![EffectId::at("base_position", Spot::Base), EffectId::at("base_tilt", Spot::Base)];
        let targets = 0..machine.model.targets.len();
        loose_ids.extend(targets.map(|target| EffectId::at("tool_offset", Spot::Target(target))));
        let loose_built: Vec<(EffectId, Box<dyn Effect>)> = loose_ids
            .into_iter()
            .filter_map(|id| effect::build(&id, machine.model).ok().map(|effect| (id, effect)))
            .collect();
        let probes: Vec<&dyn Effect> =
            probes.into_iter().chain(loose_built.iter().map(|(_, effect)| effect.as_ref())).collect();
        let mut loose: Vec<(EffectId, Vec<DMatrix<f64>>)> =
            loose_built.iter().map(|(id, _)| (id.clone(), Vec::new())).collect();
        let own = machine.slots().len();
        let mut first = 0;
        let candidates: Vec<(EffectId, Range<usize>)> = built
            .iter()
            .map(|(id, effect)| {
                let range = first..first + effect.parameters().len();
                first = range.end;
                (id.clone(), range)
            })
            .collect();
        // A gap between the two sides may differ from pose to pose: worn teeth, friction.
        let gaps: Vec<usize> =
            (0..zeros.len()).filter(|joint| survey.passport.has_both_sides(*joint)).collect();
        let known = first;
        let mut candidates = candidates;
        for joint in &gaps {
            let range = first..first + groups.len();
            first = range.end;
            candidates.push((EffectId::at(SIDE_OF_APPROACH, Spot::Joint(*joint)), range));
        }
        let ones = vec![1.0; machine.table.len()];
        let (mut members, mut residuals, mut columns, mut motions) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (group, rows) in groups.iter().enumerate() {
            // Only equations every return has can be compared.
            let shape =
                |row: usize| machine.observations.of_row(row).iter().map(|e| e.reading).collect::<Vec<_>>();
            let first_shape = rows.first().map(|row| shape(*row)).unwrap_or_default();
            for row in rows.iter().filter(|row| !first_shape.is_empty() && shape(**row) == first_shape) {
                let block = machine.block(&fit.state, &[*row], &ones, &probes);
                members.push((*row, group));
                residuals.push(DVector::from_vec(block.residuals));
                let motion = |joint| block.jacobian.row(own + known + joint).transpose();
                let mut own_columns = DMatrix::zeros(block.jacobian.ncols(), first);
                own_columns.columns_mut(0, known).copy_from(&block.jacobian.rows(own, known).transpose());
                for (place, joint) in gaps.iter().enumerate() {
                    let side = f64::from(machine.table.approach_of(*row, *joint));
                    let column = known + place * groups.len() + group;
                    own_columns.column_mut(column).copy_from(&(motion(*joint) * side));
                }
                columns.push(own_columns);
                let mut from = own + known + zeros.len();
                for ((_, of_members), (_, effect)) in loose.iter_mut().zip(&loose_built) {
                    let count = effect.parameters().len();
                    of_members.push(block.jacobian.rows(from, count).transpose());
                    from += count;
                }
                motions.push((0..zeros.len()).map(motion).collect());
            }
        }
        Some(Self { members, residuals, columns, motions, loose, candidates, groups: groups.len() })
    }

    /// Deviations of residuals and of the given columns from their group's weighted mean.
    pub(super) fn centred(
        &self,
        weights: &[f64],
        wanted: &[usize],
    ) -> (Vec<DVector<f64>>, Vec<DMatrix<f64>>) {
        let mut residuals = self.residuals.clone();
        let mut columns: Vec<DMatrix<f64>> =
            self.columns.iter().map(|columns| columns.select_columns(wanted)).collect();
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

    /// Degrees of freedom within groups, before any allowance; `kept` tells which members count.
    pub(super) fn freedom(&self, kept: &[f64]) -> usize {
        let mut seen = vec![false; self.groups];
        let mut freedom = 0;
        for (((_, group), residuals), _) in
            self.members.iter().zip(&self.residuals).zip(kept).filter(|(_, kept)| **kept > 0.0)
        {
            if let Some(seen) = seen.get_mut(*group) {
                freedom += if *seen { residuals.len() } else { 0 };
                *seen = true;
            }
        }
        freedom
    }
}
