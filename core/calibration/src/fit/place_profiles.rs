//! A first guess of how a laser line sensor sits on the flange, and where what it sees lies: from no start at all.
//!
//! How the sensor is turned is tried in the 24 ways in which its axes can lie along those of the flange; every turn is within 63 degrees of one of them. From each the
//! surfaces are put through the points as they would then be, and sensor and surfaces descend a few steps; the best go on.

use nalgebra::{DMatrix, DVector, Matrix3, Point3, Rotation3, Vector3};

use super::residual_model::ResidualModel;
use super::state::{FreeParameter, State};
use crate::arm_model::SurfaceShape;
use plumb_estimation::RankRevealingCholesky;
use plumb_estimation::{CAREFUL, Cancelled, Progress, Settings, descend};

/// Rows looked at, spread over the table.
const LOOKED_AT: usize = 60;

/// Fraction of the spread of the flange's positions by which the profiles must be off for the sensor to be looked for anew.
const FAR: f64 = 0.02;

/// Steps of the descent from each way in which the sensor may be turned.
const FIRST_STEPS: usize = 8;

/// Ways that go on, and their further steps.
const GO_ON: usize = 3;
const FURTHER_STEPS: usize = 40;

/// Fewest points of a surface from which it can be placed.
const FEWEST_POINTS: usize = 4;

/// The rotations that take axes to axes: 24.
fn along_axes() -> Vec<Rotation3<f64>> {
    let signed: Vec<Vector3<f64>> =
        (0..3).flat_map(|axis| [1.0, -1.0].map(|sign| Vector3::ith(axis, sign))).collect();
    let mut found = Vec::new();
    for x in &signed {
        // Six directions for x, four across it for y; z follows, so that none is a reflection.
        for y in signed.iter().filter(|y| x.dot(y).abs() < 0.5) {
            found.push(Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[*x, *y, x.cross(y)])));
        }
    }
    found
}

/// The points of every surface as the sensor is believed to sit, frame of the measurements, mm.
fn points_by_surface(
    problem: &ResidualModel<'_>,
    state: &State,
    rows: &[usize],
    sensor: usize,
) -> Vec<Vec<Vector3<f64>>> {
    let mut points = vec![Vec::new(); state.surfaces.len()];
    let mut scratch = problem.scratch(state);
    for row in rows {
        let named = problem.table.on.name(*row).and_then(|name| problem.model.surface_position(name));
        let (Some(own), Some(rotation), Some(position)) = (
            named.and_then(|surface| points.get_mut(surface)),
            state.rotations.get(sensor),
            state.targets.get(sensor),
        ) else {
            continue;
        };
        let flange = state.base * problem.flange(*row, &mut scratch);
        for columns in &problem.table.profiles {
            let [x, z] = columns.xz.get(*row).copied().unwrap_or([f64::NAN; 2]);
            if x.is_finite() && z.is_finite() {
                // A profile lies in the sensor's x and z: its sheet of light is y = 0.
                own.push((flange * Point3::from(position + rotation * Vector3::new(x, 0.0, z))).coords);
            }
        }
    }
    points
}

/// The axes along which points spread, the most first, and their middle.
fn principal_axes(points: &[Vector3<f64>]) -> (Vector3<f64>, [Vector3<f64>; 3]) {
    let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let spread: Matrix3<f64> =
        points.iter().map(|point| (point - middle) * (point - middle).transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|one, other| eigen.eigenvalues[*other].total_cmp(&eigen.eigenvalues[*one]));
    (middle, order.map(|column| eigen.eigenvectors.column(column).into_owned()))
}

/// The centre of the ball that passes nearest to points: linear, as its radius is left open.
fn centre_of_ball(points: &[Vector3<f64>]) -> Vector3<f64> {
    let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let (mut matrix, mut right) = (DMatrix::zeros(4, 4), DVector::zeros(4));
    for point in points {
        // |p - c|^2 = r^2 is linear in c and in r^2 - |c|^2; about the middle of the points, so that far coordinates do not spoil the products.
        let away = point - middle;
        let row = DVector::from_column_slice(&[2.0 * away.x, 2.0 * away.y, 2.0 * away.z, 1.0]);
        matrix.ger(1.0, &row, &row, 1.0);
        right.axpy(away.norm_squared(), &row, 1.0);
    }
    let found = RankRevealingCholesky::new(&matrix).solve(&right);
    let centre = Vector3::new(found[0], found[1], found[2]);
    if centre.iter().all(|part| part.is_finite()) { middle + centre } else { middle }
}

/// A vector that points the way another does.
fn towards(vector: Vector3<f64>, other: &Vector3<f64>) -> Vector3<f64> {
    // The sign of an eigenvector is arbitrary; which side of a surface is outside is not.
    if vector.dot(other) < 0.0 { -vector } else { vector }
}

/// Puts the free surfaces through the points they were seen by.
fn put_surfaces(problem: &ResidualModel<'_>, state: &mut State, rows: &[usize], sensor: usize) {
    let points = points_by_surface(problem, state, rows, sensor);
    let free = problem.model.surfaces.iter().map(|surface| surface.free);
    for ((shape, points), free) in state.surfaces.iter_mut().zip(&points).zip(free) {
        if !free || points.len() < FEWEST_POINTS {
            continue;
        }
        // Total least squares (Pearson 1901): a plane has least spread along its normal, a line most along itself.
        let (middle, [most, _, least]) = principal_axes(points);
        match shape {
            SurfaceShape::Plane { normal, offset } => {
                *normal = towards(least, normal);
                *offset = normal.dot(&middle);
            }
            SurfaceShape::Line { point, direction } => {
                *direction = towards(most, direction);
                *point = middle;
            }
            SurfaceShape::Sphere { centre, .. } => *centre = centre_of_ball(points),
            SurfaceShape::Point { .. } => {}
        }
    }
}

/// Whether profiles are off by more than a good guess would leave, beside how far the flange went.
fn far_off(problem: &ResidualModel<'_>, state: &State, rows: &[usize]) -> bool {
    let (mut squares, mut count) = (0.0, 0.0_f64);
    let (mut scratch, mut residuals) = (problem.scratch(state), Vec::new());
    let mut positions = Vec::new();
    for row in rows {
        positions.push(problem.flange(*row, &mut scratch).translation.vector);
        residuals.clear();
        problem.row_residuals(*row, &mut scratch, &mut residuals);
        for (equation, residual) in problem.observations.of_row(*row).iter().zip(&residuals) {
            if equation.measurand.kind.name() == "profile" {
                squares += residual * residual;
                count += 1.0;
            }
        }
    }
    let middle = positions.iter().sum::<Vector3<f64>>() / positions.len().max(1) as f64;
    let spread = positions.iter().map(|position| (position - middle).norm_squared()).sum::<f64>();
    // The spread of the flange is the scale: a sensor drawn at the wrong place misses by a good part of it, whatever the arm's size.
    squares / count.max(1.0) > FAR * FAR * spread / positions.len().max(1) as f64
}

/// Places the sensor and what it sees, where the model's own start is far off.
pub(super) fn place_profiles(
    problem: &ResidualModel<'_>,
    state: &mut State,
    rows: &[usize],
    progress: &Progress,
) -> Result<(), Cancelled> {
    let Some(sensor) = problem.model.profile_sensor else { return Ok(()) };
    let seen: Vec<usize> = rows.iter().copied().filter(|row| problem.table.has_profile(*row)).collect();
    let some: Vec<usize> = seen.iter().copied().step_by(seen.len().div_ceil(LOOKED_AT).max(1)).collect();
    if some.is_empty() || !far_off(problem, state, &some) {
        return Ok(());
    }
    let ones = vec![1.0; problem.observations.rows()];
    let is_own = |free_parameter: &FreeParameter| match free_parameter {
        FreeParameter::Target(target, _) | FreeParameter::TargetRotation(target, _) => *target == sensor,
        FreeParameter::Surface(..) => true,
        _ => false,
    };
    let held: Vec<usize> = (0..problem.free_parameters().len())
        .filter(|index| !problem.free_parameters().get(*index).is_some_and(is_own))
        .collect();
    let settle = |guess: &State, steps: usize| {
        let settled = descend(
            &problem.over(&some, &ones),
            guess,
            &held,
            Settings { steps, damping: CAREFUL },
            progress,
        )?;
        Ok((settled.normal.squares, settled.state))
    };
    let rotations_free = problem.model.targets.get(sensor).is_some_and(|target| target.rotation_free);
    let mut turns: Vec<Rotation3<f64>> = state.rotations.get(sensor).copied().into_iter().collect();
    turns.extend(rotations_free.then(along_axes).into_iter().flatten());
    let mut tried = Vec::new();
    for rotation in turns {
        let mut guess = state.clone();
        if let Some(entry) = guess.rotations.get_mut(sensor) {
            *entry = rotation;
        }
        put_surfaces(problem, &mut guess, &some, sensor);
        tried.push(settle(&guess, FIRST_STEPS)?);
    }
    // A few steps from every rotation distinguish the hopeless from the others; only the best are worth a whole fit.
    tried.sort_by(|one, other| one.0.total_cmp(&other.0));
    let mut best = (problem.squares(state, &some, &ones), state.clone());
    for (_, guess) in tried.iter().take(GO_ON) {
        let found = settle(guess, FURTHER_STEPS)?;
        if found.0 < best.0 && found.1.is_finite() {
            best = found;
        }
    }
    *state = best.1;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ways_of_lying_along_axes_are_twenty_four_and_none_is_far_from_any_turn() {
        let ways = along_axes();
        assert_eq!(ways.len(), 24);
        let mut random = plumb_estimation::Random::seeded(5);
        for _ in 0..500 {
            let rotation = Rotation3::new(Vector3::from_fn(|_, _| 2.0 * random.normal()));
            let nearest = ways.iter().map(|way| way.angle_to(&rotation)).fold(f64::INFINITY, f64::min);
            assert!(nearest.to_degrees() < 63.0, "{nearest}");
        }
        assert!(ways.iter().all(|way| (way.matrix().determinant() - 1.0).abs() < 1e-12));
    }

    #[test]
    fn a_ball_is_centred_by_points_of_one_side_of_it() {
        let centre = Vector3::new(500.0, -40.0, 120.0);
        let points: Vec<Vector3<f64>> = (0..12)
            .map(|step| {
                let (rotation, tilt) = (f64::from(step), 0.2 + 0.05 * f64::from(step));
                centre
                    + 20.0
                        * Vector3::new(tilt.sin() * rotation.cos(), tilt.sin() * rotation.sin(), tilt.cos())
            })
            .collect();
        assert!((centre_of_ball(&points) - centre).norm() < 1e-6);
    }

    /// A lift and a reach that slide, with a sensor 10 mm along x of the flange: the point (x, z) of a profile is at (10 + x, -reach - z, lift).
    const GANTRY: &str = "
arm: gantry
convention: distal
joints:
  - {name: lift, alpha_deg: 90, slides: true}
  - {name: reach, slides: true}
base: {free: false}
targets: {p1: {xyz_mm: [10, 0, 0], free: false}}
profile: {seen_by: p1}
surfaces:
  wall: {plane: {normal: [0.1, 0.9, 0], offset_mm: -250}, free: true}
  known: {plane: {normal: [0, 1, 0], offset_mm: -300}}
  ball: {sphere: {centre_mm: [0, 0, 0], radius_mm: 12}, free: true}
measured_from: world
";

    /// What a gantry with these rows has to do with profiles.
    fn gantry(model: &str, rows: &str, look: impl FnOnce(&ResidualModel<'_>, State)) {
        let header = "q1_mm,q2_mm,profile1_x_mm,profile1_z_mm,profile2_x_mm,profile2_z_mm,on\n";
        let model = crate::arm_model::Model::parse("m.yaml", model).unwrap();
        let table = crate::table::Table::parse("t.csv", &format!("{header}{rows}")).unwrap();
        let observations = crate::measurement::Observations::new(&model, &table).unwrap();
        let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
        let state = problem.start();
        look(&problem, state);
    }

    /// Four profiles of a wall at y = -300.
    const OF_WALL: &str = "100,100,-5,200,5,200,wall\n160,120,0,180,20,180,wall\n\
                           220,60,-30,240,7,240,wall\n300,110,3,190,9,190,wall\n";

    #[test]
    fn points_of_profiles_belong_to_the_surface_they_lie_on_and_those_not_seen_to_none() {
        let rows = "100,50,5,200,-3,210,wall\n120,60,1,90,,,ball\n130,70,2,80,,,wall\n";
        gantry(GANTRY, rows, |problem, state| {
            let points = points_by_surface(problem, &state, &[0, 1], 0);
            let expected = [
                vec![Vector3::new(15.0, -250.0, 100.0), Vector3::new(7.0, -260.0, 100.0)],
                vec![],
                vec![Vector3::new(11.0, -150.0, 120.0)],
            ];
            assert_eq!(points.len(), 3);
            for (found, expected) in points.iter().zip(expected) {
                assert_eq!(found.len(), expected.len(), "{points:?}");
                assert!(found.iter().zip(expected).all(|(one, other)| (one - other).norm() < 1e-9));
            }
        });
    }

    #[test]
    fn a_free_surface_is_put_through_its_points_and_a_known_one_stays() {
        let rows = format!("{OF_WALL}{}", OF_WALL.replace("wall", "known").replace("200", "150"));
        gantry(GANTRY, &rows, |problem, mut state| {
            let known = state.surfaces[1].clone();
            put_surfaces(problem, &mut state, &(0..8).collect::<Vec<_>>(), 0);
            let SurfaceShape::Plane { normal, offset } = state.surfaces[0] else { panic!("a plane") };
            assert!(
                (normal - Vector3::y()).norm() < 1e-9 && (offset + 300.0).abs() < 1e-9,
                "{normal} {offset}"
            );
            assert_eq!(state.surfaces[1], known);
        });
    }

    /// Whether profiles of a wall are far off that come back from so much too far, mm. The flange is at 100, 100 and 160 mm of the lift: root mean
    /// square 28.28 mm from the middle, and a fiftieth of that is 0.566 mm.
    fn is_far_off(off: f64) -> bool {
        let rows =
            [100, 100, 160].map(|lift| format!("{lift},100,0,{},5,{},known\n", 200.0 + off, 200.0 + off));
        let mut found = false;
        gantry(GANTRY, &rows.concat(), |problem, state| found = far_off(problem, &state, &[0, 1, 2]));
        found
    }

    #[test]
    fn profiles_are_far_off_from_a_fiftieth_of_the_flanges_spread_on() {
        assert!(is_far_off(0.58) && is_far_off(-0.58) && !is_far_off(0.55) && !is_far_off(0.0));
    }

    #[test]
    fn a_sensor_and_a_wall_are_placed_from_no_start_where_they_are_far_off() {
        gantry(GANTRY, OF_WALL, |problem, mut state| {
            place_profiles(problem, &mut state, &[0, 1, 2, 3], &Progress::unwatched()).unwrap();
            let SurfaceShape::Plane { normal, offset } = state.surfaces[0] else { panic!("a plane") };
            assert!(
                (normal - Vector3::y()).norm() < 1e-6 && (offset + 300.0).abs() < 1e-4,
                "{normal} {offset}"
            );
        });
    }
}
