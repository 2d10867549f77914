//! What scores are made of: products of candidates' derivatives with those of the fitted parameters, with the residuals and with
//! themselves, gathered in one pass over the rows.
//!
//! Most candidates change the coordinate of one joint, by an amount of their own: a wheel out of true, play, a jump. They move
//! the readings along one and the same way, that of the joint, and differ by their rates. So that way is multiplied once a row
//! for all of them.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use plumb_calibration::effect::{Contribution, Effect, Parameter, Sample, Unit};
use plumb_calibration::fit::{Fit, ResidualModel};
use plumb_estimation::over_chunks;

/// Products of effects' derivatives, whitened; one row, or entry, per parameter of an effect.
#[derive(Clone)]
pub(super) struct Products {
    /// Effects' parameters by fitted parameters.
    pub(super) with_parameters: DMatrix<f64>,
    /// With the residuals.
    pub(super) with_residuals: DVector<f64>,
    /// Of each effect's parameters among themselves.
    pub(super) own: Vec<DMatrix<f64>>,
}

/// In which order effects are worked on: first those that need derivatives of their own, then, joint by joint, those that change
/// its coordinate alone.
pub(super) struct Plan<'e> {
    effects: &'e [&'e dyn Effect],
    plain: Vec<usize>,
    /// How many parameters the plain ones have.
    plain_parameters: usize,
    groups: Vec<Group>,
    /// Each effect's parameters in the products.
    pub(super) ranges: Vec<Range<usize>>,
}

/// Effects that change one joint's coordinate, and their parameters in the products.
struct Group {
    way: Way,
    effects: Vec<usize>,
    parameters: Range<usize>,
}

/// A joint's coordinate itself, changed by one.
#[derive(Debug)]
struct Way {
    joint: usize,
    parameters: [Parameter; 1],
}

impl Effect for Way {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        contributions.push(Contribution { rate: 1.0, ..sample.contribute_to_joint(self.joint, 0, 1.0) });
    }
}

/// Those effects that change this joint's coordinate and nothing else; with no joint, those that do anything else.
fn changing(effects: &[&dyn Effect], joint: Option<usize>) -> Vec<usize> {
    let own = effects.iter().enumerate().filter(|(_, effect)| effect.changes_coordinate() == joint);
    own.map(|(index, _)| index).collect()
}

impl<'e> Plan<'e> {
    pub(super) fn of(effects: &'e [&'e dyn Effect], joints: usize) -> Self {
        let plain = changing(effects, None);
        let mut plan = Self {
            effects,
            plain: plain.clone(),
            plain_parameters: 0,
            groups: Vec::new(),
            ranges: vec![0..0; effects.len()],
        };
        plan.plain_parameters = plan.number(&plain, 0);
        let mut next = plan.plain_parameters;
        for joint in 0..joints {
            // All of them move the readings as the joint does, each by its own factor a row: the joint's derivatives are worked out once.
            let effects = changing(effects, Some(joint));
            if !effects.is_empty() {
                let parameters = next..plan.number(&effects, next);
                next = parameters.end;
                let way = Way { joint, parameters: [Parameter::new("way", Unit::RATIO, (-1.0, 1.0))] };
                plan.groups.push(Group { way, effects, parameters });
            }
        }
        plan
    }

    /// Numbers the parameters of some effects from `next` on; one past the last.
    fn number(&mut self, effects: &[usize], mut next: usize) -> usize {
        for index in effects {
            if let (Some(range), Some(effect)) = (self.ranges.get_mut(*index), self.effects.get(*index)) {
                *range = next..next + effect.parameters().len();
                next = range.end;
            }
        }
        next
    }

    fn parameters(&self) -> usize {
        self.groups.last().map_or(self.plain_parameters, |last| last.parameters.end)
    }

    fn chosen(&self, indices: &[usize]) -> Vec<&'e dyn Effect> {
        indices.iter().filter_map(|index| self.effects.get(*index)).copied().collect()
    }
}

impl Products {
    fn zeros(plan: &Plan<'_>, free_parameters: usize) -> Self {
        Self {
            with_parameters: DMatrix::zeros(plan.parameters(), free_parameters),
            with_residuals: DVector::zeros(plan.parameters()),
            own: plan.ranges.iter().map(|range| DMatrix::zeros(range.len(), range.len())).collect(),
        }
    }

    /// Of effects that take no part, at a fit.
    pub(super) fn of(problem: &ResidualModel<'_>, fit: &Fit, plan: &Plan<'_>) -> Self {
        let ways = plan.groups.iter().map(|group| &group.way as &dyn Effect);
        let probes: Vec<&dyn Effect> = plan.chosen(&plan.plain).into_iter().chain(ways).collect();
        let driving: Vec<&dyn Effect> =
            plan.groups.iter().flat_map(|group| plan.chosen(&group.effects)).collect();
        let free_parameters = problem.free_parameters().len();
        let mut total = Self::zeros(plan, free_parameters);
        over_chunks(
            &fit.rows,
            || Self::zeros(plan, free_parameters),
            |sums, chunk| {
                let (block, rates) =
                    problem.block_and_rates(&fit.state, chunk, &fit.weights, &probes, &driving);
                let rows = Rows {
                    residuals: DVector::from_vec(block.residuals),
                    jacobian: block.jacobian,
                    equations: chunk.iter().map(|row| problem.observations.range(*row).len()).collect(),
                };
                sums.take_plain(plan, &rows, free_parameters);
                for (number, group) in plan.groups.iter().enumerate() {
                    let along = rows.along(free_parameters, free_parameters + plan.plain_parameters + number);
                    let first = group.parameters.start - plan.plain_parameters;
                    sums.take_group(
                        plan,
                        group,
                        &along,
                        &rates.rows(first, group.parameters.len()).into_owned(),
                    );
                }
            },
            |part| total.add(&part),
        );
        total
    }

    /// Effects with derivatives of their own.
    fn take_plain(&mut self, plan: &Plan<'_>, rows: &Rows, free_parameters: usize) {
        let count = plan.plain_parameters;
        let known = rows.jacobian.rows(0, free_parameters).transpose();
        let asked = rows.jacobian.rows(free_parameters, count);
        self.with_parameters.rows_mut(0, count).gemm(1.0, &asked, &known, 1.0);
        self.with_residuals.rows_mut(0, count).gemv(1.0, &asked, &rows.residuals, 1.0);
        for index in &plan.plain {
            if let (Some(own), Some(range)) = (self.own.get_mut(*index), plan.ranges.get(*index)) {
                let part = asked.rows(range.start, range.len());
                own.gemm(1.0, &part, &part.transpose(), 1.0);
            }
        }
    }

    /// Effects that move the readings along one joint's way, by their `rates` (parameters by rows).
    fn take_group(&mut self, plan: &Plan<'_>, group: &Group, along: &Along, rates: &DMatrix<f64>) {
        let (start, count) = (group.parameters.start, group.parameters.len());
        self.with_parameters.rows_mut(start, count).gemm(1.0, rates, &along.with_parameters.transpose(), 1.0);
        self.with_residuals.rows_mut(start, count).gemv(1.0, rates, &along.with_residuals, 1.0);
        // A rate belongs to a row, not to an equation: the products over a row's equations are gathered in `along` already.
        let by_row = rates.transpose();
        for index in &group.effects {
            let (Some(own), Some(range)) = (self.own.get_mut(*index), plan.ranges.get(*index)) else {
                continue;
            };
            for (column, one) in range.clone().enumerate() {
                // Sum over rows of rate times rate times the square of the way.
                let weighed = by_row.column(one - start).component_mul(&along.squares);
                for (row, other) in range.clone().enumerate() {
                    own[(row, column)] += weighed.dot(&by_row.column(other - start));
                }
            }
        }
    }

    fn add(&mut self, other: &Self) {
        self.with_parameters += &other.with_parameters;
        self.with_residuals += &other.with_residuals;
        for (own, other) in self.own.iter_mut().zip(&other.own) {
            *own += other;
        }
    }
}

/// Some rows, whitened.
struct Rows {
    residuals: DVector<f64>,
    /// Fitted parameters, plain effects' parameters and joints' ways, by equations.
    jacobian: DMatrix<f64>,
    /// Equations of each row.
    equations: Vec<usize>,
}

/// One joint's way in some rows, multiplied with what is known there: one column, or entry, per row.
struct Along {
    with_parameters: DMatrix<f64>,
    with_residuals: DVector<f64>,
    squares: DVector<f64>,
}

impl Rows {
    /// The way that is in line `way` of the derivatives, with the first `free_parameters` lines.
    fn along(&self, free_parameters: usize, way: usize) -> Along {
        let rows = self.equations.len();
        let mut along = Along {
            with_parameters: DMatrix::zeros(free_parameters, rows),
            with_residuals: DVector::zeros(rows),
            squares: DVector::zeros(rows),
        };
        let mut equation = 0;
        for (row, equations) in self.equations.iter().enumerate() {
            for _ in 0..*equations {
                let amount = self.jacobian[(way, equation)];
                let known = self.jacobian.view((0, equation), (free_parameters, 1));
                along.with_parameters.column_mut(row).axpy(amount, &known.column(0), 1.0);
                along.with_residuals[row] += amount * self.residuals[equation];
                along.squares[row] += amount * amount;
                equation += 1;
            }
        }
        along
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laboratory::{Laboratory, Options};
    use plumb_calibration::arm_model::Model;
    use plumb_calibration::effect::{EffectId, Site, build};
    use plumb_calibration::table::Table;
    use plumb_estimation::Progress;

    const ARM: &str = "
arm: lift-and-turn
convention: distal
joints:
  - {name: turn, a_mm: 200, sign: -1}
  - {name: slide, slides: true, alpha_deg: 90}
  - {name: tip, a_mm: 150}
targets: {p1: {xyz_mm: [0, 10, 0]}}
free: [joint_zero(turn)]
";

    /// The same effect, whose derivatives are worked out like those of any other.
    #[derive(Debug)]
    struct Plain<'e>(&'e dyn Effect);

    impl Effect for Plain<'_> {
        fn parameters(&self) -> &[Parameter] {
            self.0.parameters()
        }

        fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
            self.0.contribute(sample, contributions);
        }
    }

    fn table() -> Table {
        let mut text = "q1_deg,q2_mm,q3_deg,approach_q1,p1_x_mm,p1_y_mm,p1_z_mm,tilt_x_deg\n".to_owned();
        for row in 0..20_i32 {
            let (rotation, slide, tip) = ((37 * row) % 170, (53 * row) % 90, (71 * row) % 140);
            let (side, off) = (1 - 2 * (row % 2), 0.1 * f64::from((row * row) % 7));
            text.push_str(&format!(
                "{rotation},{slide},{tip},{side},{},{},{off},0.1\n",
                rotation + 100,
                slide - 50
            ));
        }
        Table::parse("table.csv", &text).unwrap()
    }

    #[test]
    fn what_shares_a_joints_way_has_the_products_of_derivatives_of_its_own() {
        let model = Model::parse("arm.yaml", &format!("{ARM}level: {{after: tip}}\n")).unwrap();
        let id = |name: &str, joint: usize| EffectId::at(name, Site::Joint(joint));
        let wheel = EffectId { order: Some(3.0), ..id("joint_harmonic", 2) };
        let jump = EffectId { inner: Some(8.0), ..id("joint_step", 1) };
        let pulled = EffectId { with: Some(2), ..id("joint_coupling", 0) };
        let ids = [
            id("joint_gain", 0),
            wheel,
            id("link_length", 0),
            id("joint_backlash", 0),
            jump,
            pulled,
            id("joint_settling", 2),
        ];
        let effects: Vec<_> = ids.iter().map(|id| build(id, &model).unwrap()).collect();
        let shared: Vec<&dyn Effect> = effects.iter().map(AsRef::as_ref).collect();
        let alone: Vec<Plain<'_>> = shared.iter().map(|effect| Plain(*effect)).collect();
        let alone: Vec<&dyn Effect> = alone.iter().map(|effect| effect as &dyn Effect).collect();
        assert!(shared.iter().filter(|effect| effect.changes_coordinate().is_some()).count() == 6);

        let lab = Laboratory::new(model.clone(), table(), Options::default()).unwrap();
        let problem = lab.problem(&[]).unwrap();
        let fit = lab.fit(&problem, &Progress::unwatched()).unwrap();
        let (one, other) = (Plan::of(&shared, 3), Plan::of(&alone, 3));
        let (fast, slow) = (Products::of(&problem, &fit, &one), Products::of(&problem, &fit, &other));
        let near = |left: &DMatrix<f64>, right: &DMatrix<f64>| {
            (left - right).norm() <= 1e-12 * right.norm().max(1e-12)
        };
        for (index, id) in ids.iter().enumerate() {
            let (here, there) = (one.ranges[index].clone(), other.ranges[index].clone());
            assert!(near(&fast.own[index], &slow.own[index]), "{id:?}");
            let rows = |products: &Products, range: &Range<usize>| {
                let known = products.with_parameters.rows(range.start, range.len()).into_owned();
                known.insert_column(0, 0.0) + {
                    let mut residuals = DMatrix::zeros(range.len(), products.with_parameters.ncols() + 1);
                    residuals.set_column(0, &products.with_residuals.rows(range.start, range.len()));
                    residuals
                }
            };
            assert!(near(&rows(&fast, &here), &rows(&slow, &there)), "{id:?}");
        }
    }
}
