//! The columns of the flexible regression: smooth functions of what is known of a row, each carried to the readings as the arm would carry an error: of a joint's
//! coordinate, or a shift or a tilt of the base. So one column serves every kind of measurement and every target. Functions of the whole pose are random Fourier
//! features (Rahimi & Recht 2007), those of one number are cosines on its range with a prior that falls with the frequency (Hilbert-space approximation of a
//! Gaussian process, Solin & Särkkä 2020).

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::functions::{centred, cosines, times};
use super::known::{Column, Known};
use super::regression::Products;
use plumb_calibration::effect::{self, Effect, EffectId, Site};
use plumb_calibration::fit::{Fit, ResidualModel};
use plumb_estimation::{NormalEquations, Random};

/// Length scales of the functions of the whole pose, relative to the mean distance of two poses.
const LENGTH_SCALES: [f64; 2] = [0.4, 0.9];

/// Random frequencies of a length scale: one for so many poses, within these limits.
const POSES_A_FREQUENCY: usize = 16;
const FREQUENCIES: (usize, usize) = (3, 24);

/// Cosines in one joint's coordinate: one for so many poses, within these limits.
const POSES_A_COSINE: usize = 30;
const COSINES: (usize, usize) = (4, 16);

/// Cosines in the order or time, and in any other number.
const TIME_COSINES: usize = 8;
const OTHER_COSINES: usize = 4;

/// Cosines in the last move of a joint, and in its coordinate where the side of approach changes with it.
const MOVE_COSINES: usize = 4;
const SIDE_COSINES: usize = 2;

/// Frequencies of the functions of the pose that a condition is multiplied with.
const CONDITION_FREQUENCIES: usize = 6;

/// What is known of a row in one respect, and its components of columns.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Group {
    pub(super) name: String,
    pub(super) components: Range<usize>,
}

/// All columns: equations by fitted numbers (orthonormal), flexible columns, and the residuals last.
pub(crate) struct Features {
    pub(crate) design: DMatrix<f64>,
    /// Columns that are not penalised.
    pub(super) fixed: usize,
    /// Of the flexible columns.
    pub(super) components: Vec<Range<usize>>,
    /// Of each component: the joint at which its errors are, if at one.
    pub(crate) joints: Vec<Option<usize>>,
    /// Of each joint: how an error of its coordinate moves the readings, by equations; nothing where it moves none.
    pub(crate) carriers: Vec<Option<DVector<f64>>>,
    pub(super) groups: Vec<Group>,
    /// Per row of `rows`: its equations.
    pub(crate) equations: Vec<Range<usize>>,
    /// What is known of the fitted numbers besides the rows: distances between touched places.
    pub(super) knowledge: Products,
}

/// How errors of the base and of the joints move the readings: each by equations.
struct Carriers {
    shifts: Vec<DVector<f64>>,
    tilts: Vec<DVector<f64>>,
    joints: Vec<Option<DVector<f64>>>,
}

impl Carriers {
    /// `jacobian` holds the parameters of the probes in this order, by equations.
    fn of(jacobian: &DMatrix<f64>, shifts: usize, tilts: usize, joints: &[bool]) -> Self {
        let mut columns = jacobian.row_iter().map(|row| unit(row.transpose()));
        let shifts = columns.by_ref().take(shifts).flatten().collect();
        let tilts = columns.by_ref().take(tilts).flatten().collect();
        // A joint whose zero cannot act in this model has no probe, and so no row.
        let joints = joints.iter().map(|known| if *known { columns.next().flatten() } else { None });
        Self { shifts, tilts, joints: joints.collect() }
    }

    /// The joints that move any reading.
    fn moving(&self) -> impl Iterator<Item = (usize, &DVector<f64>)> {
        self.joints.iter().enumerate().filter_map(|(joint, carrier)| Some((joint, carrier.as_ref()?)))
    }
}

/// A column of root mean square 1; nothing if it is all zeros.
fn unit(column: DVector<f64>) -> Option<DVector<f64>> {
    let length = column.norm() / (column.len().max(1) as f64).sqrt();
    (length > 1e-12).then(|| column / length)
}

/// Collects columns into components and groups.
struct Builder<'a> {
    known: &'a Known,
    /// Row (by its index in the list) of each equation.
    row_of: Vec<usize>,
    columns: Vec<DVector<f64>>,
    components: Vec<Range<usize>>,
    joints: Vec<Option<usize>>,
    groups: Vec<Group>,
}

impl Builder<'_> {
    /// A column: a function of the rows, carried.
    fn push(&mut self, carrier: &DVector<f64>, function: &[f64]) {
        let values = carrier.iter().zip(&self.row_of);
        let column = values.map(|(carrier, row)| carrier * function.get(*row).copied().unwrap_or(0.0));
        self.columns.push(DVector::from_iterator(carrier.len(), column));
    }

    /// Ends a component of errors at one joint, or at several places: its columns together get mean square 1 a column.
    fn close_component(&mut self, joint: Option<usize>) {
        let first = self.components.last().map_or(0, |last| last.end);
        let own = first..self.columns.len();
        let squares: f64 = self.columns.iter().skip(first).map(DVector::norm_squared).sum();
        let entries = (own.len() * self.row_of.len()).max(1) as f64;
        // All components begin at the same ratio of variances; so a coefficient must mean as much in each.
        let length = (squares / entries).sqrt();
        if own.is_empty() || length < 1e-12 {
            self.columns.truncate(first);
            return;
        }
        self.columns.iter_mut().skip(first).for_each(|column| *column /= length);
        self.components.push(own);
        self.joints.push(joint);
    }

    /// Ends a group.
    fn close_group(&mut self, name: &str) {
        let first = self.groups.last().map_or(0, |last| last.components.end);
        if self.components.len() > first {
            self.groups.push(Group { name: name.to_owned(), components: first..self.components.len() });
        }
    }

    /// Functions of the pose: of the whole pose, and of each joint's coordinate.
    fn pose(&mut self, carriers: &Carriers) {
        let poses = self.known.poses;
        // The same frequencies every time: a diagnosis of the same table says the same.
        let mut random = Random::seeded(23);
        for scale in LENGTH_SCALES {
            let count = (poses / POSES_A_FREQUENCY).clamp(FREQUENCIES.0, FREQUENCIES.1);
            let functions = self.known.pose_functions(scale, count, &mut random);
            for carrier in &carriers.shifts {
                functions.iter().for_each(|function| self.push(carrier, function));
            }
            self.close_component(None);
        }
        for (joint, carrier) in carriers.moving() {
            let count = (poses / POSES_A_COSINE).clamp(COSINES.0, COSINES.1);
            for function in cosines(self.known.coordinate(joint), count) {
                self.push(carrier, &function);
            }
            self.close_component(Some(joint));
        }
        self.close_group("pose");
    }

    /// Functions of each joint's last move and side of approach.
    fn last_move(&mut self, carriers: &Carriers) {
        for (joint, carrier) in carriers.moving() {
            // Play and friction change over a joint's range, slowly.
            let along = cosines(self.known.coordinate(joint), SIDE_COSINES);
            for side in self.known.sides(joint) {
                self.push(carrier, &side);
                for function in &along {
                    self.push(carrier, &times(&side, function));
                }
            }
            for function in cosines(self.known.last_move(joint), MOVE_COSINES) {
                self.push(carrier, &function);
            }
            self.close_component(Some(joint));
        }
        self.close_group("last move");
    }

    /// Functions of one number, as shifts of the base and as errors of the joints; and, where it is a condition that acts with the pose, times those of the pose.
    fn number(&mut self, name: &str, values: &[f64], count: usize, with_pose: bool, carriers: &Carriers) {
        let functions = cosines(values.to_vec(), count);
        for carrier in &carriers.shifts {
            functions.iter().for_each(|function| self.push(carrier, function));
        }
        self.close_component(None);
        for (_, carrier) in carriers.moving() {
            functions.iter().for_each(|function| self.push(carrier, function));
        }
        self.close_component(None);
        if with_pose {
            let mut random = Random::seeded(29);
            let scale = LENGTH_SCALES[1];
            let poses = self.known.pose_functions(scale, CONDITION_FREQUENCIES, &mut random);
            let centred = centred(values);
            for carrier in &carriers.shifts {
                poses.iter().for_each(|function| self.push(carrier, &times(&centred, function)));
            }
            self.close_component(None);
            for (joint, carrier) in carriers.moving() {
                for function in cosines(self.known.coordinate(joint), SIDE_COSINES) {
                    self.push(carrier, &times(&centred, &function));
                }
            }
            self.close_component(None);
        }
        self.close_group(name);
    }

    /// One shift, tilt and error of each joint for every category.
    fn categories(&mut self, name: &str, of_row: &[Option<usize>], carriers: &Carriers) {
        let count = of_row.iter().flatten().max().map_or(0, |most| most + 1);
        let levels: Vec<Vec<f64>> = (0..count)
            .map(|level| of_row.iter().map(|own| f64::from(u8::from(*own == Some(level)))).collect())
            .collect();
        let moving: Vec<&DVector<f64>> = carriers.moving().map(|(_, carrier)| carrier).collect();
        let parts: [Vec<&DVector<f64>>; 3] =
            [carriers.shifts.iter().collect(), carriers.tilts.iter().collect(), moving];
        for part in parts {
            for carrier in part {
                levels.iter().for_each(|level| self.push(carrier, level));
            }
            self.close_component(None);
        }
        self.close_group(name);
    }
}

/// What known distances between touched places say of the fitted numbers, in the units of the design's first columns. Without them places and lengths would shrink
/// together to nothing.
pub(super) fn knowledge(problem: &ResidualModel<'_>, fit: &Fit, columns: usize) -> Products {
    let mut known = NormalEquations::zeros(problem.free_parameters().len());
    problem.known_besides_rows(&fit.state, &fit.rows, &mut known);
    // The fitted columns are whitened by the fit's own factor R; what is known of them is then R^-T K R^-1.
    let half = fit.factor.whiten(&known.matrix);
    let own = fit.factor.whiten(&half.transpose());
    let gradient = DMatrix::from_column_slice(known.gradient.len(), 1, known.gradient.as_slice());
    let readings: DVector<f64> = fit.factor.whiten(&gradient).column(0).into_owned();
    Products::of_knowledge(&own, &readings, columns)
}

/// The equations of each of these rows.
fn equations_of(problem: &ResidualModel<'_>, rows: &[usize]) -> Vec<Range<usize>> {
    let mut next = 0;
    rows.iter()
        .map(|row| {
            let own = next..next + problem.observations.range(*row).len();
            next = own.end;
            own
        })
        .collect()
}

/// The effect whose derivatives say how an error of one kind at one place moves the readings; nothing where it cannot act in this model.
pub(super) fn carrier_of(problem: &ResidualModel<'_>, name: &str, site: Site) -> Option<Box<dyn Effect>> {
    effect::build(&EffectId::at(name, site), problem.model).ok()
}

/// The same of an error of each joint's coordinate.
pub(super) fn joint_carriers(problem: &ResidualModel<'_>) -> Vec<Option<Box<dyn Effect>>> {
    let joints = 0..problem.model.chain.len();
    joints.map(|joint| carrier_of(problem, "joint_zero", Site::Joint(joint))).collect()
}

impl Features {
    /// Of these rows of a fitted model, without any flexible column: what is fitted, and the residuals.
    pub(crate) fn plain(problem: &ResidualModel<'_>, fit: &Fit, rows: &[usize]) -> Self {
        let block = problem.block(&fit.state, rows, &fit.weights, &[]);
        let fitted = fit.factor.whiten(&block.jacobian);
        let fixed = fitted.nrows();
        let mut design = fitted.transpose().insert_column(fixed, 0.0);
        design.set_column(fixed, &DVector::from_vec(block.residuals));
        let knowledge = knowledge(problem, fit, design.ncols());
        Self {
            design,
            fixed,
            components: Vec::new(),
            joints: Vec::new(),
            carriers: Vec::new(),
            groups: Vec::new(),
            equations: equations_of(problem, rows),
            knowledge,
        }
    }

    /// The same with further components: columns by equations, those of one component with one variance.
    pub(crate) fn with_components(mut self, further: &[DMatrix<f64>]) -> Self {
        for component in further {
            let last = self.design.ncols() - 1;
            let entries = component.len().max(1) as f64;
            let length = (component.norm_squared() / entries).sqrt();
            if length < 1e-12 {
                continue;
            }
            self.design = self.design.insert_columns(last, component.ncols(), 0.0);
            self.design.columns_mut(last, component.ncols()).copy_from(&(component / length));
            let first = last - self.fixed;
            self.components.push(first..first + component.ncols());
            self.joints.push(None);
            self.knowledge = self.knowledge.widened(component.ncols());
        }
        self
    }

    /// Adds so much to what is left of each equation.
    pub(crate) fn add_to_residuals(&mut self, more: &DVector<f64>) {
        let last = self.design.ncols() - 1;
        let mut residuals = self.design.column_mut(last);
        residuals += more;
    }

    /// Of these rows of a fitted model.
    pub(crate) fn of(problem: &ResidualModel<'_>, fit: &Fit, rows: &[usize]) -> Self {
        let known = Known::of(problem, rows);
        let shift = carrier_of(problem, "base_position", Site::Base);
        let tilt = carrier_of(problem, "base_tilt", Site::Base);
        let zeros = joint_carriers(problem);
        let probes: Vec<&dyn Effect> =
            [&shift, &tilt].into_iter().chain(&zeros).flatten().map(AsRef::as_ref).collect();
        let block = problem.block(&fit.state, rows, &fit.weights, &probes);
        let free_parameters = problem.free_parameters().len();
        let [shifts, tilts] =
            [&shift, &tilt].map(|effect| effect.as_ref().map_or(0, |one| one.parameters().len()));
        // Orthonormal columns keep the matrix of products well conditioned, whatever units the fitted numbers have.
        let fitted = fit.factor.whiten(&block.jacobian.rows(0, free_parameters).into_owned());
        let driven =
            block.jacobian.rows(free_parameters, block.jacobian.nrows() - free_parameters).into_owned();
        let joints: Vec<bool> = zeros.iter().map(Option::is_some).collect();
        let carriers = Carriers::of(&driven, shifts, tilts, &joints);
        let equations = equations_of(problem, rows);
        let numbered = equations.iter().enumerate();
        let row_of = numbered.flat_map(|(row, own)| std::iter::repeat_n(row, own.len())).collect();
        let mut builder = Builder {
            known: &known,
            row_of,
            columns: Vec::new(),
            components: Vec::new(),
            joints: Vec::new(),
            groups: Vec::new(),
        };
        builder.pose(&carriers);
        builder.last_move(&carriers);
        for Column { name, values, with_pose, in_order } in &known.numbers {
            let cosines = if *in_order { TIME_COSINES } else { OTHER_COSINES };
            builder.number(name, values, cosines, *with_pose, &carriers);
        }
        for (name, of_row) in &known.categories {
            builder.categories(name, of_row, &carriers);
        }
        let Builder { columns, components, joints, groups, .. } = builder;
        let fixed = fitted.nrows();
        let mut design = DMatrix::zeros(block.residuals.len(), fixed + columns.len() + 1);
        design.columns_mut(0, fixed).copy_from(&fitted.transpose());
        for (index, column) in columns.iter().enumerate() {
            design.set_column(fixed + index, column);
        }
        design.set_column(fixed + columns.len(), &DVector::from_vec(block.residuals));
        let knowledge = knowledge(problem, fit, design.ncols());
        Self { design, fixed, components, joints, carriers: carriers.joints, groups, equations, knowledge }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_column_has_mean_square_one_and_a_column_of_nothing_is_none() {
        let column = unit(DVector::from_row_slice(&[3.0, 4.0, 0.0, 0.0])).unwrap();
        assert!(
            (column.norm_squared() / 4.0 - 1.0).abs() < 1e-12 && (column[0] / column[1] - 0.75).abs() < 1e-12
        );
        assert!(unit(DVector::zeros(5)).is_none());
    }

    #[test]
    fn carriers_take_their_rows_in_order_and_a_joint_without_a_probe_takes_none() {
        let jacobian = DMatrix::from_row_slice(4, 2, &[1.0, 0.0, 0.0, 2.0, 3.0, 3.0, 0.0, 0.0]);
        let carriers = Carriers::of(&jacobian, 1, 1, &[false, true, true]);
        assert_eq!((carriers.shifts.len(), carriers.tilts.len()), (1, 1));
        assert!(carriers.shifts[0][0] > 0.0 && carriers.tilts[0][1] > 0.0);
        let joints: Vec<usize> = carriers.moving().map(|(joint, _)| joint).collect();
        assert_eq!(joints, [1], "the first has no probe, the last moves nothing");
        let own = carriers.joints[1].as_ref().unwrap();
        assert!(own.iter().all(|value| (value - 1.0).abs() < 1e-12), "{own}");
    }

    #[test]
    fn what_is_added_to_the_residuals_is_added_to_them_alone() {
        let lab = crate::testing::two_links(8, "joint_zero(*)", 0.05, 4, |_| [0.0; 2]);
        let fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
        let plain = Features::plain(&fitted.problem, &fitted.fit, &fitted.fit.rows);
        let (mut features, last) = (plain, 2);
        let before = features.design.clone();
        features.add_to_residuals(&DVector::from_element(24, 0.5));
        let added = &features.design - &before;
        assert!(added.column(last).iter().all(|one| (one - 0.5).abs() < 1e-12));
        assert_eq!(added.columns(0, last).amax(), 0.0);
    }

    /// What is known of a table with so many poses of two joints.
    fn known(poses: usize) -> Known {
        let lab = crate::testing::two_links(poses, "", 0.05, 4, |_| [0.0; 2]);
        let problem = lab.problem(&[]).unwrap();
        Known::of(&problem, &(0..poses).collect::<Vec<usize>>())
    }

    fn builder(known: &Known, rows: usize) -> Builder<'_> {
        Builder {
            known,
            row_of: (0..rows).collect(),
            columns: Vec::new(),
            components: Vec::new(),
            joints: Vec::new(),
            groups: Vec::new(),
        }
    }

    #[test]
    fn a_component_has_mean_square_one_and_one_of_nothing_is_none() {
        let known = known(3);
        let mut builder = builder(&known, 2);
        let carrier = DVector::from_row_slice(&[1.0, 2.0]);
        builder.push(&carrier, &[3.0, 4.0]);
        builder.push(&carrier, &[0.0, 1.0]);
        builder.close_component(Some(1));
        // 9, 64, 0 and 4: the mean square is 77 / 4.
        let length = (77.0_f64 / 4.0).sqrt();
        assert!((builder.columns[0][1] - 8.0 / length).abs() < 1e-12);
        assert!((builder.columns[1][1] - 2.0 / length).abs() < 1e-12);
        builder.push(&carrier, &[0.0, 0.0]);
        builder.close_component(Some(0));
        builder.close_component(None);
        assert_eq!((builder.columns.len(), &builder.joints), (2, &vec![Some(1)]));
        assert_eq!((builder.components.len(), builder.components.first()), (1, Some(&(0..2))));
        builder.close_group("pose");
        builder.close_group("nothing");
        builder.push(&carrier, &[1.0, 1.0]);
        builder.close_component(None);
        builder.close_group("load");
        let named = |name: &str, components| Group { name: name.to_owned(), components };
        assert_eq!(builder.groups, [named("pose", 0..1), named("load", 1..2)]);
    }

    #[test]
    fn a_joint_has_a_cosine_for_thirty_poses_and_the_whole_pose_a_frequency_for_sixteen() {
        let columns = |poses: usize| {
            let known = known(poses);
            let mut builder = builder(&known, poses);
            let carrier = Some(DVector::from_element(poses, 1.0));
            let shifts = vec![DVector::from_element(poses, 1.0)];
            builder.pose(&Carriers { shifts, tilts: Vec::new(), joints: vec![carrier.clone(), carrier] });
            assert_eq!(builder.joints, [None, None, Some(0), Some(1)]);
            builder.components.iter().map(ExactSizeIterator::len).collect::<Vec<usize>>()
        };
        // A sine and a cosine of each frequency.
        assert_eq!(columns(59), [6, 6, 4, 4], "three frequencies and four cosines at least");
        assert_eq!(columns(150), [18, 18, 5, 5]);
        assert_eq!(columns(600), [48, 48, 16, 16], "24 frequencies and 16 cosines at most");
    }

    #[test]
    fn a_number_acts_as_shifts_and_at_joints_and_a_condition_with_the_pose_as_well() {
        let known = known(40);
        let carriers = || Carriers {
            shifts: vec![DVector::from_element(40, 1.0); 3],
            tilts: vec![DVector::from_element(40, 1.0); 2],
            joints: vec![Some(DVector::from_element(40, 1.0)), None],
        };
        let values: Vec<f64> = (0..40).map(f64::from).collect();
        let widths = |builder: &Builder<'_>| {
            builder.components.iter().map(ExactSizeIterator::len).collect::<Vec<usize>>()
        };
        let mut plain = builder(&known, 40);
        plain.number("time", &values, TIME_COSINES, false, &carriers());
        assert_eq!(widths(&plain), [24, 8]);
        let mut with_pose = builder(&known, 40);
        with_pose.number("temperature", &values, OTHER_COSINES, true, &carriers());
        // Of the pose six frequencies for each shift and two cosines of the joint.
        assert_eq!(widths(&with_pose), [12, 4, 36, 2]);
        let mut levels = builder(&known, 40);
        let of_row: Vec<Option<usize>> = (0..40).map(|row| (row > 0).then_some(row % 3)).collect();
        levels.categories("operator", &of_row, &carriers());
        assert_eq!(widths(&levels), [9, 6, 3]);
        assert_eq!(levels.groups, [Group { name: "operator".to_owned(), components: 0..3 }]);
    }
}
