//! Projects poses onto a surface. The arm's own sensor says nothing in mid-air: every pose is brought onto the surface it is to
//! trigger over, and only to positions like those where it did.

use nalgebra::Vector3;

use crate::laboratory::{Laboratory, LaboratoryError};
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::arm_model::SurfaceShape;
use plumb_calibration::fit::{ResidualModel, State};
use plumb_calibration::measurement::Observations;
use plumb_calibration::table::Table;

/// Where the sensor triggered so far: a plane, and positions on it.
#[derive(Debug, Clone)]
pub(super) struct Surface {
    /// The plane's name.
    pub(super) name: String,
    normal: Vector3<f64>,
    offset: f64,
    /// Where the model's first target was at the trigger poses, mm.
    positions: Vec<Vector3<f64>>,
    /// How far from the nearest of them a new position may be, mm.
    apart: f64,
    /// Of joints whose drive keeps attitudes: the joint, the one before it, and the least and greatest angle between the two so far, rad. Their stops lie there,
    /// and they are in no file.
    bends: Vec<(usize, usize, f64, f64)>,
}

/// Rounds of moving a joint until the point is on the plane, and how near to it is near enough, mm.
const ROUNDS: usize = 12;
const ON_IT: f64 = 0.01;

/// A joint that moves the point by less than this is not the one to bring it onto the plane, mm/rad.
const LEAST_LEVER: f64 = 20.0;

/// The farthest a joint is rotated in one round, rad.
const FARTHEST: f64 = 0.3;

/// How far a joint is rotated to see what it does to the point's height, rad.
const PROBE: f64 = 1e-5;

impl Surface {
    /// Of a table in which the sensor triggered over a plane and nothing else was read; nothing of any other.
    pub(super) fn of(lab: &Laboratory, state: &State, effects: &[AddedEffect]) -> Option<Self> {
        let table = lab.table();
        let mut lengths = table.scalars.iter().flat_map(|column| &column.values);
        let reads_else = !table.positions.is_empty()
            || lengths.any(|value| value.is_finite())
            || table.tilt.is_some()
            || !table.touch.names.is_empty();
        if lab.model().sensor.is_none() || reads_else {
            return None;
        }
        let mut named = table.on.names.iter().enumerate();
        let (index, (name, normal, offset)) = named.find_map(|(index, name)| {
            let surface = lab.model().surfaces.iter().find(|surface| surface.name == *name)?;
            match surface.shape {
                SurfaceShape::Plane { normal, offset } => Some((index, (name.clone(), normal, offset))),
                _ => None,
            }
        })?;
        let problem = ResidualModel::new(lab.model(), table, lab.observations(), effects).ok()?;
        let positions: Vec<Vector3<f64>> = (0..table.len())
            .filter(|row| table.on.of_row.get(*row).copied().flatten() == Some(index as u32))
            .map(|row| problem.believed_point(state, row))
            .collect();
        let [width, depth] = [0, 1].map(|axis| {
            let (low, high) = range(positions.iter().map(|position| position[axis]));
            high - low
        });
        let count = positions.len().max(1) as f64;
        // Were the positions spread evenly, each would have a square of this side.
        let apart = (width.max(1.0) * depth.max(1.0) / count).sqrt();
        let joints = lab.model().chain.joints.iter().enumerate();
        let bends = joints.filter_map(|(joint, row)| {
            let less = row.less?;
            let angles = (0..table.len()).filter_map(|row| bend_of(table.q_of(row), joint, less));
            let (low, high) = range(angles);
            Some((joint, less, low, high))
        });
        let bends = bends.collect();
        (positions.len() > 1).then_some(Self { name, normal, offset, positions, apart, bends })
    }

    /// Whether no joint bends further against the one before it than it did already.
    fn is_bent_so(&self, q: &[f64]) -> bool {
        self.bends.iter().all(|(joint, less, low, high)| {
            bend_of(q, *joint, *less).is_none_or(|angle| (*low..=*high).contains(&angle))
        })
    }

    /// How high a point is over the plane, mm.
    fn height(&self, point: &Vector3<f64>) -> f64 {
        self.normal.dot(point) - self.offset
    }

    fn is_known(&self, point: &Vector3<f64>) -> bool {
        self.positions.iter().any(|position| (position - point).norm() <= self.apart)
    }
}

/// Least and greatest of some numbers.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)))
}

/// The angle of a joint against another.
fn bend_of(q: &[f64], joint: usize, less: usize) -> Option<f64> {
    Some(q.get(joint)? - q.get(less)?)
}

/// The readings' points of a table of poses to come, as a fitted model believes them.
struct Points<'a> {
    lab: &'a Laboratory,
    surface: &'a Surface,
    state: &'a State,
    effects: &'a [AddedEffect],
}

impl Points<'_> {
    /// Where the first target is in every row, mm.
    fn of(&self, table: &Table) -> Result<Vec<Vector3<f64>>, LaboratoryError> {
        let observations = Observations::new(self.lab.model(), table)?;
        let problem = ResidualModel::new(self.lab.model(), table, &observations, self.effects)?;
        Ok((0..table.len()).map(|row| problem.believed_point(self.state, row)).collect())
    }

    /// How high over the plane, mm.
    fn heights(&self, table: &Table) -> Result<Vec<f64>, LaboratoryError> {
        Ok(self.of(table)?.iter().map(|point| self.surface.height(point)).collect())
    }

    /// How a joint moves each row's point up, mm/rad.
    fn levers(&self, table: &Table, heights: &[f64], joint: usize) -> Result<Vec<f64>, LaboratoryError> {
        let moved = self.heights(&rotated(table, joint))?;
        Ok(moved.iter().zip(heights).map(|(moved, height)| (moved - height) / PROBE).collect())
    }

    /// The joint that moves each row's point up and down most.
    fn strongest_joints(&self, table: &Table) -> Result<Vec<usize>, LaboratoryError> {
        let mut best: Vec<(f64, usize)> = vec![(0.0, 0); table.len()];
        let heights = self.heights(table)?;
        for joint in 0..table.joints {
            for (best, lever) in best.iter_mut().zip(self.levers(table, &heights, joint)?) {
                if lever.abs() > best.0 {
                    *best = (lever.abs(), joint);
                }
            }
        }
        Ok(best.into_iter().map(|(_, joint)| joint).collect())
    }
}

/// A table with one joint rotated a little in every row.
fn rotated(table: &Table, joint: usize) -> Table {
    let mut other = table.clone();
    other.q.iter_mut().skip(joint).step_by(table.joints.max(1)).for_each(|q| *q += PROBE);
    other
}

/// A step of Newton's method to height zero, rad; none where the joint hardly moves the point.
fn step_to_surface(height: f64, lever: f64) -> f64 {
    if lever.abs() > LEAST_LEVER { -(height / lever).clamp(-FARTHEST, FARTHEST) } else { 0.0 }
}

/// Rotates one joint of each row of `table` until the point is on the plane; whether that was possible within `ranges`, at a position
/// like those known.
///
/// # Errors
/// The table does not fit the model.
pub(super) fn onto_surface(
    lab: &Laboratory,
    surface: &Surface,
    (state, effects): (&State, &[AddedEffect]),
    table: &mut Table,
    ranges: &[(f64, f64)],
) -> Result<Vec<bool>, LaboratoryError> {
    let points = Points { lab, surface, state, effects };
    // One joint a pose: the others keep what was drawn, so that poses stay spread.
    let strongest = points.strongest_joints(table)?;
    // A joint far from its position moves the point along a circle: Newton's step is too long or too short and is repeated.
    for _ in 0..ROUNDS {
        let heights = points.heights(table)?;
        let joints = 0..table.joints;
        let all = joints.map(|joint| points.levers(table, &heights, joint)).collect::<Result<Vec<_>, _>>()?;
        for (row, (height, joint)) in heights.iter().zip(&strongest).enumerate() {
            let lever = all.get(*joint).and_then(|levers| levers.get(row)).copied().unwrap_or(0.0);
            if let Some(q) = table.q.get_mut(row * table.joints + joint) {
                *q += step_to_surface(*height, lever);
            }
        }
    }
    let ends = points.of(table)?;
    let reached = ends.iter().enumerate().map(|(row, end)| {
        let q = table.q_of(row);
        let inside = q.iter().zip(ranges).all(|(q, (low, high))| (*low..=*high).contains(q));
        inside && surface.is_bent_so(q) && surface.height(end).abs() < ON_IT && surface.is_known(end)
    });
    Ok(reached.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_calibration::arm_model::Model;

    #[test]
    fn a_step_goes_to_the_plane_and_no_farther_than_it_may() {
        assert_eq!(step_to_surface(10.0, 200.0), -0.05);
        assert_eq!(step_to_surface(-10.0, 200.0), 0.05);
        assert_eq!(step_to_surface(500.0, 200.0), -FARTHEST);
        assert_eq!(
            step_to_surface(10.0, 0.9 * LEAST_LEVER),
            0.0,
            "a joint that hardly moves the point is left alone"
        );
    }

    #[test]
    fn a_place_is_known_near_those_that_were_measured_and_no_bend_goes_further() {
        let surface = Surface {
            name: "table".to_owned(),
            normal: Vector3::z(),
            offset: 5.0,
            positions: vec![Vector3::zeros(), Vector3::x() * 100.0],
            apart: 30.0,
            bends: vec![(1, 0, -0.5, 0.5)],
        };
        assert_eq!(surface.height(&Vector3::new(3.0, 4.0, 12.0)), 7.0);
        assert!(
            surface.is_known(&Vector3::new(0.0, 29.0, 0.0))
                && !surface.is_known(&Vector3::new(0.0, 31.0, 0.0))
        );
        assert!(surface.is_bent_so(&[0.1, 0.5]) && !surface.is_bent_so(&[0.1, 0.7]));
    }

    /// The elbow angle, deg, at which the tip of the two links is 100 mm along y for an angle of the shoulder, deg.
    fn elbow_over_table(shoulder: f64) -> f64 {
        ((100.0 - 200.0 * shoulder.to_radians().sin()) / 150.0).asin().to_degrees() - shoulder
    }

    /// A planar arm whose sensor triggered over the line y = 100 mm, with further columns and what is in them.
    fn over_table(columns: &str, values: &str) -> Laboratory {
        let lines = "sensor: {working_mm: 8, peak_mm: 5}\nlevel: {after: elbow}\nfree: []\n\
                     surfaces: {table: {plane: {normal: [0, 1, 0], offset_mm: 100}}}\n";
        let model = Model::parse("model.yaml", &format!("{}{lines}", crate::testing::TWO_LINKS)).unwrap();
        let mut text = format!("q1_deg,q2_deg,on,signal{columns}\n");
        for row in 0..40 {
            let shoulder = -10.0 + f64::from(row);
            text.push_str(&format!("{shoulder},{},table,on{values}\n", elbow_over_table(shoulder)));
        }
        let table = Table::parse("table.csv", &text).unwrap();
        let options = crate::laboratory::Options {
            holdout: crate::split::Holdout::None,
            ..crate::laboratory::Options::default()
        };
        Laboratory::new(model, table, options).unwrap()
    }

    #[test]
    fn poses_are_brought_onto_the_plane_by_the_joint_that_moves_them_up_most() {
        let lab = over_table("", "");
        let problem = lab.problem(&[]).unwrap();
        let state = problem.start();
        let surface = Surface::of(&lab, &state, &[]).unwrap();
        assert_eq!((surface.name.as_str(), surface.positions.len()), ("table", 40));
        // Forty positions on a line, as on a strip of one millimetre.
        let across: Vec<f64> = surface.positions.iter().map(|position| position.x).collect();
        let (low, high) = range(across.into_iter());
        assert!(high - low > 20.0 && (surface.apart - ((high - low) / 40.0).sqrt()).abs() < 1e-9);
        // Two poses 3 deg beside measured ones and one far from all of them.
        let [near, other] = [5.5, 20.5].map(elbow_over_table);
        let text = format!(
            "q1_deg,q2_deg,on,signal\n8.5,{near},table,on\n17.5,{other},table,on\n-120,-20,table,on\n"
        );
        let wide = [(-3.0, 3.0); 2];
        let mut poses = Table::parse("poses.csv", &text).unwrap();
        let reached = onto_surface(&lab, &surface, (&state, &[]), &mut poses, &wide).unwrap();
        assert_eq!(reached, [true, true, false]);
        for (row, (shoulder, elbow)) in [(5.5, near), (20.5, other)].into_iter().enumerate() {
            let found: Vec<f64> = poses.q_of(row).iter().map(|q| q.to_degrees()).collect();
            assert!((found[0] - shoulder).abs() < 0.01 && (found[1] - elbow).abs() < 1e-9, "{found:?}");
        }
        // The same where the shoulder may not go so low.
        let mut poses = Table::parse("poses.csv", &text).unwrap();
        let narrow = [(7.0_f64.to_radians(), 3.0), (-3.0, 3.0)];
        let reached = onto_surface(&lab, &surface, (&state, &[]), &mut poses, &narrow).unwrap();
        assert_eq!(reached, [false, true, false]);
    }

    #[test]
    fn where_anything_else_was_read_poses_need_no_plane() {
        for (columns, values) in
            [(",p1_x_mm,p1_y_mm,p1_z_mm", ",,,"), (",height_mm", ",0"), (",tilt_y_deg", ",0")]
        {
            let lab = over_table(columns, values);
            let state = lab.problem(&[]).unwrap().start();
            assert!(Surface::of(&lab, &state, &[]).is_none(), "{columns}");
        }
    }

    #[test]
    fn the_strongest_joint_of_a_row_is_the_one_with_the_longest_lever_up() {
        let lab = over_table("", "");
        let state = lab.problem(&[]).unwrap().start();
        let surface = Surface::of(&lab, &state, &[]).unwrap();
        let points = Points { lab: &lab, surface: &surface, state: &state, effects: &[] };
        // Levers of the height are x of the tip from each joint: 200 cos(q1) + 150 cos(q1 + q2), and 150 cos(q1 + q2) alone.
        let text =
            "q1_deg,q2_deg,on,signal\n0,0,table,on\n0,180,table,on\n80,-80,table,on\n150,-150,table,on\n";
        let table = Table::parse("poses.csv", text).unwrap();
        let heights = points.heights(&table).unwrap();
        let shoulder = points.levers(&table, &heights, 0).unwrap();
        let elbow = points.levers(&table, &heights, 1).unwrap();
        for (found, expected) in
            [(shoulder[0], 350.0), (elbow[0], 150.0), (shoulder[1], 50.0), (elbow[1], -150.0)]
        {
            assert!((found - expected).abs() < 0.1, "{shoulder:?} {elbow:?}");
        }
        assert_eq!(points.strongest_joints(&table).unwrap(), [0, 1, 0, 1]);
    }
}
