//! What is left unexplained in every row, and against what it may be drawn.

use std::sync::Arc;

use nalgebra::Vector3;
use serde::{Serialize, Serializer};

use super::placements::orientation_errors;
use super::point_errors::{ErrorSummary, point_squares};
use plumb_calibration::fit::{Fit, ResidualModel, RowDetails};
use plumb_calibration::measurement::ReadingUnit;
use plumb_calibration::table::Covariate;

/// What is left in one row.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RowResidual {
    /// Row of the table, from 0.
    pub row: usize,
    /// Line of the file.
    pub line: u32,
    /// Whether the row was held out.
    pub held_out: bool,
    /// Weight in the fit, 1 for a row inside the others' scatter.
    pub weight: f64,
    /// Measured less predicted, mm, frame of the measurements; one a target or touched place, the mean of them where a
    /// row has several. Zero along axes that were not measured.
    pub vector_mm: [f64; 3],
    /// Root mean square error of the row's measured points, in the unit of the table's readings; nothing of a row without a reading in that unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<f64>,
    /// Root mean square angle by which the row's measured orientations, and other angles beside lengths, are off, deg; nothing of a row without any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_deg: Option<f64>,
    /// Where the point is believed to be, mm, frame of the measurements.
    pub point_mm: [f64; 3],
    /// Commanded coordinates of the joints, deg (mm for joints that slide).
    pub joints: Vec<f64>,
}

/// Residuals against one quantity: what the small plots show.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// What it is against: a joint's name, `moment of shoulder`, `order`, `temperature`, ...
    pub against: String,
    /// Unit of the horizontal axis.
    pub unit: String,
    /// What is drawn upwards.
    pub shows: String,
    /// Whether that is a size, which is never negative.
    pub of_size: bool,
    /// Whether it is of orientations, in degrees: these have a scale of their own.
    pub in_deg: bool,
    /// Horizontal value, residual in the unit of the table's readings (deg of orientations), and the row.
    pub points: Points,
}

/// The points of a plot. Plots of the same residuals share these: of a large table they are most of what a comparison holds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Points {
    across: Vec<f64>,
    up: Arc<[f64]>,
    rows: Arc<[usize]>,
}

impl Points {
    /// Every point: its horizontal value, its vertical one, and its row.
    pub fn iter(&self) -> impl Iterator<Item = (f64, f64, usize)> + Clone + '_ {
        let pairs = self.across.iter().zip(self.up.iter()).zip(self.rows.iter());
        pairs.map(|((across, up), row)| (*across, *up, *row))
    }

    /// Whether the points differ in what they are drawn against.
    fn vary(&self) -> bool {
        self.across.iter().any(|x| self.across.first().is_some_and(|first| (x - first).abs() > 1e-9))
    }
}

impl FromIterator<(f64, f64, usize)> for Points {
    fn from_iter<T: IntoIterator<Item = (f64, f64, usize)>>(points: T) -> Self {
        let (mut across, mut up, mut rows) = (Vec::new(), Vec::new(), Vec::new());
        for (x, y, row) in points {
            across.push(x);
            up.push(y);
            rows.push(row);
        }
        Self { across, up: up.into(), rows: rows.into() }
    }
}

impl Serialize for Points {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

/// What a series of sizes shows.
fn size_of_a_row(unit: ReadingUnit) -> String {
    format!("error of a row, {unit}")
}

/// What a series of how far orientations are off shows.
const TURN: &str = "orientation of a row off, deg";

pub(super) fn row_residuals(problem: &ResidualModel<'_>, fit: &Fit, held_out: &[bool]) -> Vec<RowResidual> {
    (0..problem.table.len())
        .map(|row| {
            let own = fit.residuals.get(problem.observations.range(row)).unwrap_or(&[]);
            let equations = problem.observations.of_row(row);
            let (mut vector, mut counts) = (Vector3::zeros(), Vector3::repeat(0.0_f64));
            for (equation, residual) in equations.iter().zip(own) {
                if let Some(axis) = equation.measurand.coordinate() {
                    vector[axis] += residual;
                    counts[axis] += 1.0;
                }
            }
            // A coordinate may be read more than once in a row, and then the mean of its readings is the row's.
            let mean = vector.component_div(&counts.map(|count: f64| count.max(1.0)));
            RowResidual {
                row,
                line: problem.table.lines.get(row).copied().unwrap_or(0),
                held_out: held_out.get(row).copied().unwrap_or(false),
                weight: fit.weights.get(row).copied().unwrap_or(1.0),
                vector_mm: mean.into(),
                size: ErrorSummary::of(point_squares(problem, &fit.residuals, row).into_iter())
                    .map(|error| error.rms),
                size_deg: orientation_errors(problem, &fit.residuals, &[row]).map(|error| error.rms),
                point_mm: problem.believed_point(&fit.state, row).into(),
                joints: shown_joints(problem, row),
            }
        })
        .collect()
}

/// The unit a joint's coordinate is shown in.
pub(super) fn unit_of_joint(problem: &ResidualModel<'_>, joint: usize) -> &'static str {
    if problem.model.slides(joint) { "mm" } else { "deg" }
}

/// The commanded coordinates of a row as they are shown.
fn shown_joints(problem: &ResidualModel<'_>, row: usize) -> Vec<f64> {
    let coordinates = problem.table.q_of(row).iter().enumerate();
    let shown = coordinates.map(|(joint, coordinate)| match problem.model.slides(joint) {
        true => *coordinate,
        false => coordinate.to_degrees(),
    });
    shown.collect()
}

/// The points along the arm in the row whose target is nearest the middle of all targets.
pub(super) fn arm_in_the_middle(
    problem: &ResidualModel<'_>,
    fit: &Fit,
    rows: &[RowResidual],
) -> Vec<[f64; 3]> {
    let points = rows.iter().map(|row| Vector3::from(row.point_mm));
    let middle = points.clone().sum::<Vector3<f64>>() / (rows.len().max(1) as f64);
    let distances = points.map(|point| (point - middle).norm()).enumerate();
    let Some((row, _)) = distances.min_by(|one, other| one.1.total_cmp(&other.1)) else { return Vec::new() };
    problem.points_along(&fit.state, row).into_iter().map(Into::into).collect()
}

/// What is drawn upwards.
#[derive(Clone, Copy)]
enum Shows<'a> {
    /// The residual along a joint's motion.
    Along(&'a str, ReadingUnit),
    /// The error of a row.
    Size(ReadingUnit),
    /// How far a row's orientations are off.
    Turn,
}

/// A series, where what it is drawn against varies.
fn series_if_varied(against: String, unit: &str, shows: Shows<'_>, points: Points) -> Option<Series> {
    points.vary().then(|| Series {
        against,
        unit: unit.to_owned(),
        shows: match shows {
            Shows::Along(joint, unit) => format!("residual along the motion of {joint}, {unit}"),
            Shows::Size(unit) => size_of_a_row(unit),
            Shows::Turn => TURN.to_owned(),
        },
        of_size: !matches!(shows, Shows::Along(..)),
        in_deg: matches!(shows, Shows::Turn),
        points,
    })
}

/// Residuals drawn against every joint, every moment of gravity that varies, approach, order and temperature.
pub(super) fn series(problem: &ResidualModel<'_>, fit: &Fit, rows: &[RowResidual]) -> Vec<Series> {
    let mut all = against_joints(problem, fit, rows);
    all.extend(against_conditions(problem, rows));
    all
}

/// What is drawn of one joint: its residuals, and in the same rows its coordinate, its moment of gravity and its side of approach.
struct JointColumns {
    residual: Vec<f64>,
    coordinate: Vec<f64>,
    moment: Vec<f64>,
    side: Vec<f64>,
}

impl JointColumns {
    /// Empty, with room for so many rows: a column that grows by doubling holds twice what it needs for a while.
    fn for_rows(rows: usize) -> Self {
        let [residual, coordinate, moment, side] = [(); 4].map(|()| Vec::with_capacity(rows));
        Self { residual, coordinate, moment, side }
    }
}

/// The residual of a row along a joint's motion; zero where the joint does not move the point.
fn along(residual: &RowResidual, details: &RowDetails, joint: usize) -> f64 {
    let motion = details.by_joint.get(joint).and_then(|motion| motion.try_normalize(1e-9));
    motion.map_or(0.0, |direction| Vector3::from(residual.vector_mm).dot(&direction))
}

/// The residual along each joint's motion, against its coordinate, its moment and its side of approach; its size where no coordinate of a point was read,
/// for an angle or a distance has no direction in space.
fn against_joints(problem: &ResidualModel<'_>, fit: &Fit, rows: &[RowResidual]) -> Vec<Series> {
    let unit = problem.observations.unit();
    let directed =
        problem.observations.equations().iter().any(|equation| equation.measurand.coordinate().is_some());
    let seen = |residual: &&RowResidual| directed || residual.size.is_some();
    let shown: Arc<[usize]> = rows.iter().filter(seen).map(|residual| residual.row).collect();
    let joints = problem.model.chain.joints.iter();
    let mut drawn: Vec<JointColumns> = joints.map(|_| JointColumns::for_rows(shown.len())).collect();
    // Row by row, for what a row moves by takes more room than its points.
    for residual in rows.iter().filter(seen) {
        let row = residual.row;
        let details = problem.row_details(&fit.state, row);
        for (joint, columns) in drawn.iter_mut().enumerate() {
            let error = if directed { Some(along(residual, &details, joint)) } else { residual.size };
            columns.residual.extend(error);
            columns.coordinate.push(residual.joints.get(joint).copied().unwrap_or(0.0));
            if !problem.model.masses.is_empty() {
                columns.moment.push(details.moments.get(joint).copied().unwrap_or(0.0));
            }
            columns.side.push(f64::from(problem.table.approach_of(row, joint)));
        }
    }
    let mut all = Vec::new();
    for ((joint, described), columns) in problem.model.chain.joints.iter().enumerate().zip(drawn) {
        let name = &described.name;
        let shows = if directed { Shows::Along(name, unit) } else { Shows::Size(unit) };
        let up: Arc<[f64]> = columns.residual.into();
        let points = |across| Points { across, up: Arc::clone(&up), rows: Arc::clone(&shown) };
        let of_joint = unit_of_joint(problem, joint);
        all.extend(series_if_varied(name.clone(), of_joint, shows, points(columns.coordinate)));
        all.extend(series_if_varied(format!("moment of {name}"), "N m", shows, points(columns.moment)));
        all.extend(series_if_varied(format!("approach of {name}"), "side", shows, points(columns.side)));
    }
    all
}

/// The size of the residual against the order of the rows and every condition on record.
fn against_conditions(problem: &ResidualModel<'_>, rows: &[RowResidual]) -> Vec<Series> {
    let table = problem.table;
    let mut order = vec![0.0; table.len()];
    for (index, row) in table.order().into_iter().enumerate() {
        if let Some(slot) = order.get_mut(row) {
            *slot = index as f64;
        }
    }
    let mut columns: Vec<(&str, &str, &[f64])> = vec![("order", "row", &order)];
    for (name, unit, column) in [
        ("time", "s", &table.time),
        ("temperature", "deg C", &table.temperature),
        ("payload", "kg", &table.payload),
    ] {
        columns.extend(column.as_ref().map(|values| (name, unit, values.as_slice())));
    }
    let covariates: Vec<(String, Vec<f64>)> = table
        .covariates
        .iter()
        .map(|one| (covariate_axis(one), (0..table.len()).map(|row| one.number(row)).collect()))
        .collect();
    columns.extend(covariates.iter().map(|(axis, numbers)| (axis.as_str(), "", numbers.as_slice())));
    // Against a condition the size is drawn, for the direction in which it acts is not known.
    let mut all = Vec::new();
    for (name, unit, values) in columns {
        let sizes = values.iter().enumerate().filter_map(|(row, x)| Some((*x, rows.get(row)?.size?, row)));
        let shows = Shows::Size(problem.observations.unit());
        all.extend(series_if_varied(name.to_owned(), unit, shows, sizes.collect()));
        let turns =
            values.iter().enumerate().filter_map(|(row, x)| Some((*x, rows.get(row)?.size_deg?, row)));
        all.extend(series_if_varied(name.to_owned(), unit, Shows::Turn, turns.collect()));
    }
    all
}

/// What a plot's axis says of a column: of words, which word is at which number.
fn covariate_axis(covariate: &Covariate) -> String {
    let words = covariate.levels().iter().enumerate().map(|(index, word)| format!("{index} {word}"));
    let words: Vec<String> = words.collect();
    match words.is_empty() {
        true => covariate.name.clone(),
        false => format!("{} ({})", covariate.name, words.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::Points;

    #[test]
    fn points_vary_where_one_is_elsewhere_than_the_first() {
        let varies = |across: [f64; 3]| across.into_iter().map(|x| (x, 0.0, 0)).collect::<Points>().vary();
        assert!(varies([5.0, 5.0, 5.1]) && varies([5.0, -5.0, 5.0]));
        assert!(!varies([5.0; 3]) && !varies([-5.0; 3]) && !varies([5.0, 5.0 + 1e-10, 5.0]));
        assert!(!Points::default().vary());
    }

    #[test]
    fn points_come_back_as_they_were_given() {
        let given = [(1.0, -2.0, 4), (3.0, 0.5, 0)];
        let points: Points = given.into_iter().collect();
        assert!(points.iter().eq(given));
        assert_eq!(
            serde_json::to_value(&points).unwrap(),
            serde_json::json!([[1.0, -2.0, 4], [3.0, 0.5, 0]])
        );
    }

    #[test]
    fn the_arm_is_drawn_in_the_row_whose_point_is_nearest_the_middle() {
        let lab = crate::testing::two_links(9, "", 0.0, 3, |_| [0.0; 2]);
        let drawn = lab.compare(&plumb_estimation::Progress::unwatched()).unwrap().arm_points_mm;
        let points = &lab.table().positions[0].xyz;
        let middle = [0, 1, 2].map(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / 9.0);
        let far = |point: &[f64; 3]| (0..3).map(|axis| (point[axis] - middle[axis]).powi(2)).sum::<f64>();
        let nearest = points.iter().min_by(|one, other| far(one).total_cmp(&far(other))).unwrap();
        let tip = drawn.last().unwrap();
        assert!(
            tip.iter().zip(nearest).all(|(found, read)| (found - read).abs() < 1e-6),
            "{tip:?} {nearest:?}"
        );
        assert!(drawn[0].iter().all(|part| part.abs() < 1e-9), "it begins in the base");
    }
}
