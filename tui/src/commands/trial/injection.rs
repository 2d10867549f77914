//! Something hidden in somebody's own measurements: its motion, by the simulated world's mechanics, is carried through the fitted arm and
//! added to what was read.

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};
use plumb_calibration::arm_model::{MeasuredFrom, Model, SurfaceShape};
use plumb_calibration::effect::{self, CandidateContext, DatasetSummary};
use plumb_calibration::file::model_text;
use plumb_calibration::forward::ForwardModel;
use plumb_calibration::prediction::{self, Pose};
use plumb_calibration::table::scalar::{DISTANCE, HEIGHT};
use plumb_calibration::table::{Body, Table};
use plumb_diagnosis::laboratory::{Laboratory, LaboratoryError, Options};
use plumb_diagnosis::{Diagnosis, Verdict};
use plumb_estimation::Progress;
use plumb_simulated::physics::campaign::carried::{MeasuredRow, displacements};
use plumb_simulated::physics::campaign::catalogue::{Choice, ChoiceError};
use plumb_simulated::physics::description::{ArmDescription, DescriptionError};
use plumb_simulated::physics::imperfection::{Imperfection, Mechanism};
use plumb_simulated::physics::machine::NoEquilibrium;
use plumb_simulated::physics::random::Random;
use plumb_simulated::physics::rigid::Vector;
use thiserror::Error;

use super::shown::shown_size;

/// Time between two rows of a table that logs none, s.
const USUAL_INTERVAL_S: f64 = 10.0;

/// Temperature of a table that logs none, degrees Celsius.
const USUAL_TEMPERATURE_C: f64 = 20.0;

/// Ends of the flange's axes at which its turns are looked at, mm: far enough that rounding does not count.
const LEVER: f64 = 100.0;

/// Rounds in which a size is found that shows so much; the motion is nearly proportional to it.
const ROUNDS: usize = 3;

/// Why nothing can be hidden in these measurements.
#[derive(Debug, Error)]
pub enum InjectionError {
    /// The lab cannot open or fit them.
    #[error(transparent)]
    Laboratory(#[from] LaboratoryError),
    /// The world cannot make this arm.
    #[error("the simulated world cannot make this arm: {0}")]
    Description(#[from] DescriptionError),
    /// What is to be hidden makes no sense on this arm.
    #[error(transparent)]
    Choice(#[from] ChoiceError),
    /// The arm falls down.
    #[error(transparent)]
    Balance(#[from] NoEquilibrium),
    /// The fitted arm has no points.
    #[error(transparent)]
    Prediction(#[from] prediction::PredictionError),
    /// Nothing that could be moved was read.
    #[error(
        "{0}: nothing can be added to these readings; what is hidden moves positions (p1_x_mm ...), their orientations and distances"
    )]
    NoReadings(String),
    /// Something was read that would move as well, and cannot be moved.
    #[error(
        "{table}: the table also has {what}, which something hidden would move as well: inject moves positions (p1_x_mm ...), their orientations and distances. Take those \
         columns out, with rows that have nothing else, or hide something in a simulated cell (`plumb trial new --cell`)"
    )]
    Unmoved {
        /// The table.
        table: String,
        /// What it has, with its columns.
        what: &'static str,
    },
    /// The effect does not show.
    #[error(
        "`{effect}` at `{site}`: of what it does to these rows the free parameters leave nothing to be seen; choose another effect or place, or free less"
    )]
    DoesNotShow {
        /// The effect.
        effect: &'static str,
        /// Where.
        site: String,
    },
    /// Its size would be beyond belief.
    #[error(
        "`{effect}` at `{site}` would need {} to show so much, more than any working machine has; give a smaller size, or another place",
        shown_size(*size, unit)
    )]
    Unbelievable {
        /// The effect.
        effect: &'static str,
        /// Where.
        site: String,
        /// The size.
        size: f64,
        /// Its unit.
        unit: &'static str,
    },
}

/// Somebody's measurements, and the arm that was fitted to them.
pub struct Measurements {
    model: Model,
    table: Table,
    options: Options,
    fitted: Model,
    arm: ArmDescription,
    known: Vec<Imperfection>,
    rows: Vec<MeasuredRow>,
    /// The table's row of each of `rows`.
    order: Vec<usize>,
    /// From the world to the frame of the measurements.
    to_readings: Matrix3<f64>,
    /// Where each target is believed to be in each row, mm.
    believed: Vec<Vec<Vector3<f64>>>,
    /// How the flange is believed to be turned in each row, frame of the measurements.
    hands: Vec<Rotation3<f64>>,
    /// What the model leaves of the measurements, mm.
    left_mm: f64,
}

/// What the lab says of something hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Found {
    /// Something else is named.
    NamedWrong,
    /// It is not among what the lab lists.
    Missed,
    /// It is among the candidates.
    Listed,
    /// It is in a tie, or in the family of a located joint.
    InSet,
    /// It is in a tie in which all are the same thing in these rows: they move every reading alike.
    Same,
    /// It is named.
    Named,
}

impl Found {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::NamedWrong => "something else is named",
            Self::Missed => "it is not listed",
            Self::Listed => "it is among the candidates, and not named",
            Self::InSet => "it is one of several that cannot be distinguished",
            Self::Same => "it is one of several that are the same thing in these rows",
            Self::Named => "it is named",
        }
    }

    /// What a diagnosis says of something hidden. What the lab named without it (`before`, an effect and its site) is no wrong name. A joint that jumped is also named
    /// where its zero was found to be re-set several times: the rows may hold jumps of their own.
    pub fn of(diagnosis: &Diagnosis, hidden: (&str, &str), before: Option<(&str, &str)>) -> Self {
        let is = |effect: &str, site: &str| {
            (effect, site) == hidden || (effect == "joint_zero_reset" && ("joint_step", site) == hidden)
        };
        if let Some(named) = &diagnosis.named {
            let name = (named.effect.effect.as_str(), named.effect.site.as_str());
            if is(name.0, name.1) {
                return Self::Named;
            }
            if before != Some(name) && diagnosis.verdict == Verdict::Named {
                return Self::NamedWrong;
            }
        }
        let tied = diagnosis.tied.iter().any(|one| is(&one.effect, &one.site));
        let located = diagnosis.located.as_ref();
        if tied && diagnosis.tied.len() == diagnosis.same.len() + 1 {
            return Self::Same;
        }
        if tied || located.is_some_and(|one| one.family.iter().any(|effect| is(effect, &one.site))) {
            return Self::InSet;
        }
        match diagnosis.candidates.iter().any(|one| is(&one.effect.effect, &one.effect.site)) {
            true => Self::Listed,
            false => Self::Missed,
        }
    }
}

impl Measurements {
    /// Fits the model to the table, and makes the fitted arm in the world.
    ///
    /// # Errors
    /// [`InjectionError`]
    pub fn new(
        model: Model,
        table: Table,
        options: Options,
        progress: &Progress,
    ) -> Result<Self, InjectionError> {
        if let Some(what) = unmoved(&table) {
            return Err(InjectionError::Unmoved { table: table.source, what });
        }
        if table.positions.is_empty() && table.scalar(&DISTANCE).is_none() {
            return Err(InjectionError::NoReadings(table.source));
        }
        let lab = Laboratory::new(model.clone(), table.clone(), options.clone())?;
        let accepted = lab.accept(progress)?;
        let fitted = accepted.model;
        let down = fitted.down(&fitted.base.pose.rotation);
        // In the world the arm is as its gravity says.
        let upright = Rotation3::rotation_between(&down, &-Vector3::z())
            .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
        let arm = described(&fitted, &upright)?;
        let order = table.order();
        let rows = measured_rows(&table, &order);
        let poses: Vec<Pose> = (0..table.len()).map(|row| pose(&table, row)).collect();
        let targets = fitted.targets.iter().map(|target| target.name.as_str());
        let believed = targets
            .map(|name| prediction::points(&fitted, Some(name), &poses))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            hands: hands(&fitted, &poses)?,
            known: known(&fitted),
            to_readings: (fitted.base.pose.rotation * upright.inverse()).into_inner(),
            left_mm: accepted.comparison.rms_mm.fit,
            model,
            table,
            options,
            fitted,
            arm,
            rows,
            order,
            believed,
        })
    }

    /// The arm as the world makes it.
    pub fn arm(&self) -> &ArmDescription {
        &self.arm
    }

    /// What the model leaves of the measurements, mm RMS.
    pub fn left_mm(&self) -> f64 {
        self.left_mm
    }

    /// Draws what a choice leaves open.
    ///
    /// # Errors
    /// There is no such effect, or not on this arm.
    pub fn draw(&self, choice: &Choice, seed: u64) -> Result<Mechanism, InjectionError> {
        let duration = self.rows.last().map_or(1.0, |row| row.time_s.max(1.0));
        Ok(choice.draw(&self.arm, duration, &mut Random::new(seed, "injection"))?)
    }

    /// Whether the table logs what drives a mechanism, where an effect of the library describes it: time for what warms up, say. A mechanism outside the library may be
    /// driven by anything.
    pub fn logs_what_drives(&self, mechanism: &Mechanism) -> bool {
        let Some(kind) = effect::kind(mechanism.name()) else { return true };
        let summary = DatasetSummary::of(&self.model, &self.table);
        let context = CandidateContext { model: &self.model, summary: &summary };
        let site = mechanism.site(&self.arm);
        (kind.candidates)(&context).iter().any(|id| self.model.site_name(id.site) == site)
    }

    /// How an imperfection moves every target in every row of the table, mm, frame of the measurements.
    fn motion(&self, hidden: &Imperfection) -> Result<Vec<Vec<Vector3<f64>>>, InjectionError> {
        let points: Vec<Vector> = self.fitted.targets.iter().map(|target| vector(target.xyz)).collect();
        let moved = displacements(&self.arm, &points, &self.rows, &self.known, hidden)?;
        let mut by_row = vec![vec![Vector3::zeros(); points.len()]; self.table.len()];
        for (row, moved) in self.order.iter().zip(moved) {
            if let Some(entry) = by_row.get_mut(*row) {
                *entry =
                    moved.iter().map(|one| self.to_readings * Vector3::new(one.x, one.y, one.z)).collect();
            }
        }
        Ok(by_row)
    }

    /// The measurements with it in.
    ///
    /// # Errors
    /// The arm falls down.
    pub fn with(&self, hidden: &Imperfection) -> Result<Table, InjectionError> {
        let mut table = self.table.clone();
        self.add_motion(&mut table, &self.motion(hidden)?);
        self.add_turns(&mut table, hidden)?;
        Ok(table)
    }

    /// Turns measured orientations as an imperfection turns the flange.
    fn add_turns(&self, table: &mut Table, hidden: &Imperfection) -> Result<(), InjectionError> {
        if table.orientations.is_empty() {
            return Ok(());
        }
        let ends =
            [(LEVER, 0.0, 0.0), (0.0, LEVER, 0.0), (0.0, 0.0, LEVER)].map(|(x, y, z)| Vector::new(x, y, z));
        let points = [&[Vector::ZERO][..], &ends].concat();
        let moved = displacements(&self.arm, &points, &self.rows, &self.known, hidden)?;
        for (row, moved) in self.order.iter().zip(moved) {
            let in_readings = |one: &Vector| self.to_readings * Vector3::new(one.x, one.y, one.z);
            let (Some(hand), Some((origin, ends))) = (self.hands.get(*row), moved.split_first()) else {
                continue;
            };
            let origin = in_readings(origin);
            // A small turn w moves the end of an axis e by w x e; the sum of e x (w x e) over the three axes is 2 w.
            let turn: Vector3<f64> = (0..3)
                .zip(ends)
                .map(|(axis, end)| (hand * Vector3::ith(axis, 1.0)).cross(&(in_readings(end) - origin)))
                .sum();
            let turn = Rotation3::new(turn / (2.0 * LEVER));
            for columns in &mut table.orientations {
                if let Some(Some(measured)) = columns.rotations.get_mut(*row) {
                    *measured = turn * *measured;
                }
            }
        }
        Ok(())
    }

    fn add_motion(&self, table: &mut Table, motion: &[Vec<Vector3<f64>>]) {
        for columns in &mut table.positions {
            let Some(target) = self.fitted.target_position(&columns.target) else { continue };
            for (xyz, moved) in columns.xyz.iter_mut().zip(motion) {
                for (part, moved) in xyz.iter_mut().zip(moved.get(target).into_iter().flat_map(Vector3::iter))
                {
                    *part += moved;
                }
            }
        }
        let names = table.distance_to.clone();
        let Some(distances) = table.scalar_mut(&DISTANCE) else { return };
        for (row, distance) in distances.iter_mut().enumerate() {
            let at = self.believed.first().and_then(|points| points.get(row));
            let moved = motion.get(row).and_then(|targets| targets.first());
            if let (Some(at), Some(moved), Some(anchor)) = (at, moved, self.anchor(names.name(row))) {
                *distance += (at + moved - anchor).norm() - (at - anchor).norm();
            }
        }
    }

    /// The point a distance is measured to.
    fn anchor(&self, name: Option<&str>) -> Option<Vector3<f64>> {
        let surface = self.fitted.surfaces.get(self.fitted.surface_position(name?)?)?;
        match surface.shape {
            SurfaceShape::Point { point } => Some(point),
            _ => None,
        }
    }

    /// What is left of an imperfection's motion when everything that is free has been fitted to it alone, mm RMS.
    ///
    /// # Errors
    /// See [`InjectionError`].
    pub fn visible_mm(&self, hidden: &Imperfection, progress: &Progress) -> Result<f64, InjectionError> {
        let mut table = self.table.clone();
        for columns in &mut table.positions {
            let Some(target) = self.fitted.target_position(&columns.target) else { continue };
            let believed = self.believed.get(target).map_or(&[][..], Vec::as_slice);
            for (xyz, believed) in columns.xyz.iter_mut().zip(believed) {
                for (part, believed) in xyz.iter_mut().zip(believed.iter()) {
                    *part = if part.is_finite() { *believed } else { *part };
                }
            }
        }
        let names = table.distance_to.clone();
        for (row, distance) in table.scalar_mut(&DISTANCE).into_iter().flatten().enumerate() {
            let at = self.believed.first().and_then(|points| points.get(row));
            if let (Some(at), Some(anchor)) = (at, self.anchor(names.name(row)))
                && distance.is_finite()
            {
                *distance = (at - anchor).norm();
            }
        }
        self.add_motion(&mut table, &self.motion(hidden)?);
        for columns in &mut table.orientations {
            let turn =
                self.fitted.target_position(&columns.body.name()).and_then(|at| self.fitted.targets.get(at));
            let Some(target) = turn else { continue };
            for (measured, hand) in columns.rotations.iter_mut().zip(&self.hands) {
                *measured = measured.map(|_| hand * target.rotation);
            }
        }
        self.add_turns(&mut table, hidden)?;
        let mut options = self.options.clone();
        options.fit.robust = false;
        let lab = Laboratory::new(self.model.clone(), table, options)?;
        Ok(lab.left_by_fit(progress)?)
    }

    /// A mechanism at the size at which `times` what the model leaves is to be seen of it.
    ///
    /// # Errors
    /// It does not show, or its size would be beyond belief.
    pub fn sized(
        &self,
        mechanism: &Mechanism,
        times: f64,
        progress: &Progress,
    ) -> Result<Imperfection, InjectionError> {
        let (effect, site) = (mechanism.name(), mechanism.site(&self.arm));
        let requested = times * self.left_mm;
        let mut hidden = Imperfection { mechanism: mechanism.clone(), size: mechanism.small_size() };
        let greatest = mechanism.greatest_plausible(&self.arm);
        for _ in 0..ROUNDS {
            let shown = self.visible_mm(&hidden, progress)?;
            if shown <= f64::MIN_POSITIVE {
                return Err(InjectionError::DoesNotShow { effect, site });
            }
            hidden.size *= requested / shown;
            if hidden.size.abs() > greatest {
                let unit = mechanism.unit_on(&self.arm);
                return Err(InjectionError::Unbelievable { effect, site, size: hidden.size, unit });
            }
            if (requested / shown - 1.0).abs() < 0.02 {
                break;
            }
        }
        Ok(hidden)
    }

    /// What the lab says of the measurements with something hidden in them; of those as they are, where that is nothing.
    ///
    /// # Errors
    /// See [`InjectionError`].
    pub fn diagnose(
        &self,
        hidden: Option<&Imperfection>,
        progress: &Progress,
    ) -> Result<Diagnosis, InjectionError> {
        let table = match hidden {
            Some(hidden) => self.with(hidden)?,
            None => self.table.clone(),
        };
        let lab = Laboratory::new(self.model.clone(), table, self.options.clone())?;
        Ok(lab.diagnose(progress)?)
    }
}

/// What a table has that something hidden would move, and that is not moved here.
fn unmoved(table: &Table) -> Option<&'static str> {
    [
        (!table.profiles.is_empty(), "line profiles (profile1_x_mm ...)"),
        (table.sees_a_board(), "a board that a camera sees (board_x_mm ...)"),
        (table.scalar(&HEIGHT).is_some(), "heights (height_mm)"),
        (
            table.scalars.iter().any(|column| ![&HEIGHT, &DISTANCE].contains(&column.scalar)),
            "readings of one number a row other than distances",
        ),
        (table.tilt.is_some(), "tilts (tilt_x_deg ...)"),
        (!table.touch.names.is_empty(), "touches (touch)"),
        (!table.on.names.is_empty(), "places where a sensor triggered or a tip lay (on)"),
        (table.is_of_stripes(), "light stripes"),
        (
            table.orientations.iter().any(|columns| columns.body == Body::Flange),
            "poses of the flange (flange_x_mm ...)",
        ),
    ]
    .into_iter()
    .find_map(|(has, what)| has.then_some(what))
}

/// How the flange is turned at each pose, frame of the measurements.
fn hands(fitted: &Model, poses: &[Pose]) -> Result<Vec<Rotation3<f64>>, InjectionError> {
    let forward = ForwardModel::new(fitted.clone()).map_err(LaboratoryError::from)?;
    Ok(poses
        .iter()
        .map(|pose| (fitted.base.pose * forward.flange(&pose.q, &pose.approach)).rotation)
        .collect())
}

/// The fitted arm as the world reads it: nominal rows, and the base turned so that what is down lies along -z.
fn described(fitted: &Model, upright: &Rotation3<f64>) -> Result<ArmDescription, InjectionError> {
    let mut plain = fitted.clone();
    for list in [&mut plain.effects, &mut plain.fitted] {
        list.clear();
    }
    plain.free.clear();
    plain.definitions.clear();
    (plain.epochs, plain.revision, plain.touch, plain.sensor) = (None, None, None, None);
    plain.levels.clear();
    plain.surfaces.clear();
    plain.measured_from = MeasuredFrom::World;
    plain.base.per_session = false;
    plain.base.pose = nalgebra::IsometryMatrix3::from_parts(nalgebra::Translation3::identity(), *upright);
    if let Some(first) = plain.targets.first_mut() {
        "p1".clone_into(&mut first.name);
        plain.targets.truncate(1);
    }
    plain.noise = plumb_calibration::arm_model::Noise::default();
    Ok(ArmDescription::from_yaml(&model_text(&plain))?)
}

/// What is fitted of the arm's shape, as the world has it; what else is fitted changes the motion of something small by hardly anything.
fn known(fitted: &Model) -> Vec<Imperfection> {
    let one = |added: &plumb_calibration::arm_model::AddedEffect| {
        let joint = added.id.joint()?;
        let mechanism = match added.id.name.as_str() {
            "joint_zero" => Mechanism::JointZero { joint },
            "link_length" => Mechanism::LinkLength { joint },
            "link_offset" => Mechanism::LinkOffset { joint },
            "link_twist" => Mechanism::LinkTwist { joint },
            "axis_skew" => Mechanism::AxisSkew { joint },
            _ => return None,
        };
        Some(Imperfection { mechanism, size: added.values.first().copied()? })
    };
    fitted.fitted.iter().chain(&fitted.effects).filter_map(one).collect()
}

fn vector(point: Vector3<f64>) -> Vector {
    let Point3 { coords } = Point3::from(point);
    Vector::new(coords.x, coords.y, coords.z)
}

fn cell(column: Option<&Vec<f64>>, row: usize) -> Option<f64> {
    column.and_then(|column| column.get(row)).copied().filter(|value| value.is_finite())
}

fn pose(table: &Table, row: usize) -> Pose {
    Pose {
        q: table.q_of(row).to_vec(),
        approach: (0..table.joints).map(|joint| table.approach_of(row, joint)).collect(),
        payload: cell(table.payload.as_ref(), row).unwrap_or(0.0),
    }
}

/// The rows as they were taken, in the order of time.
fn measured_rows(table: &Table, order: &[usize]) -> Vec<MeasuredRow> {
    let time = |row: usize| cell(table.time.as_ref(), row);
    let first = order.first().and_then(|row| time(*row)).unwrap_or(0.0);
    let row = |(index, row): (usize, &usize)| MeasuredRow {
        commanded: table.q_of(*row).to_vec(),
        sides: match table.approach {
            Some(_) => (0..table.joints).map(|joint| f64::from(table.approach_of(*row, joint))).collect(),
            None => Vec::new(),
        },
        time_s: time(*row).map_or(index as f64 * USUAL_INTERVAL_S, |time| time - first),
        temperature_c: cell(table.temperature.as_ref(), *row).unwrap_or(USUAL_TEMPERATURE_C),
        payload_kg: cell(table.payload.as_ref(), *row).unwrap_or(0.0),
    };
    order.iter().enumerate().map(row).collect()
}
