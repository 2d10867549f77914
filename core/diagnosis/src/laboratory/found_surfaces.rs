//! Where planes, balls, edges and points that were fitted along were found, and how sure that is.

use plumb_calibration::arm_model::SurfaceShape;
use plumb_calibration::fit::FreeParameter;
use serde::Serialize;

use super::standard_errors::StandardErrors;

/// One number of a surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundNumber {
    /// What it is: `offset`, `x`, `tilt`.
    pub name: &'static str,
    /// mm or deg, as its name says; nothing of a tilt or a turn, which have a standard error alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// One standard error; nothing where it cannot be determined.
    pub se: Option<f64>,
    /// `mm` or `deg`.
    pub unit: &'static str,
}

/// A surface that was fitted, frame of the measurements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundSurface {
    /// Its name.
    pub name: String,
    /// `plane`, `ball`, `edge` or `point`.
    pub shape: &'static str,
    /// Normal of a plane, direction of an edge; nothing of others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
    /// A point of an edge, the centre of a ball, mm; nothing of a plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub xyz_mm: Option<[f64; 3]>,
    /// Its fitted numbers.
    pub numbers: Vec<FoundNumber>,
    /// Of a plane: the angles to fitted planes that the model file names after it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub angles: Vec<FoundAngle>,
}

/// The angle between two fitted planes. It depends neither on where they are nor on where the base is: faces that are known to be square show errors of the arm.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundAngle {
    /// The other plane.
    pub to: String,
    /// Between their normals, deg.
    pub deg: f64,
    /// One standard error, deg; nothing where it cannot be determined.
    pub se_deg: Option<f64>,
}

/// A turn of a plane by which the change of an angle is looked at, rad: small beside the angle, large beside rounding.
const SMALL_ROTATION: f64 = 1e-6;

/// The numbers of a plane that turn it.
const TILTS: [usize; 2] = [1, 2];

/// The angle between the normals of two planes, rad.
fn between(one: &SurfaceShape, other: &SurfaceShape) -> Option<f64> {
    match (one, other) {
        (SurfaceShape::Plane { normal: one, .. }, SurfaceShape::Plane { normal: other, .. }) => {
            Some(one.angle(other))
        }
        _ => None,
    }
}

/// The angle between two fitted planes, with what the covariance of their tilts makes of it (GUM 5.2.2).
fn angle(errors: &StandardErrors<'_>, (first, second): (usize, usize)) -> Option<FoundAngle> {
    let StandardErrors { problem, fit, covariance } = errors;
    let (one, other) = (fit.state.surfaces.get(first)?, fit.state.surfaces.get(second)?);
    let at = between(one, other)?;
    let up = nalgebra::Vector3::z();
    let turned = |shape: &SurfaceShape, which: usize| {
        let mut shape = shape.clone();
        shape.shift(which, SMALL_ROTATION, &up);
        shape
    };
    let index = |surface, which| errors.index_of(FreeParameter::Surface(surface, which));
    let mut slopes = Vec::new();
    for which in TILTS {
        slopes.push((index(first, which), (between(&turned(one, which), other)? - at) / SMALL_ROTATION));
        slopes.push((index(second, which), (between(one, &turned(other, which))? - at) / SMALL_ROTATION));
    }
    let known: Option<Vec<(usize, f64)>> =
        slopes.into_iter().map(|(index, slope)| Some((index?, slope))).collect();
    let variance = known.map(|slopes| {
        let each = slopes.iter().flat_map(|one| slopes.iter().map(move |other| (one, other)));
        each.map(|((row, by), (column, and))| {
            by * and * covariance.get((*row, *column)).copied().unwrap_or(0.0)
        })
        .sum::<f64>()
    });
    Some(FoundAngle {
        to: problem.model.surfaces.get(second)?.name.clone(),
        deg: at.to_degrees(),
        se_deg: variance.map(|variance| variance.max(0.0).sqrt().to_degrees()),
    })
}

/// The surfaces of the model that were fitted and that the table reads.
pub(super) fn found_surfaces(errors: &StandardErrors<'_>) -> Vec<FoundSurface> {
    let StandardErrors { problem, fit, .. } = errors;
    let table = problem.table;
    let each = problem.model.surfaces.iter().zip(&fit.state.surfaces).enumerate();
    let is_read = |name: &String| table.on.names.contains(name) || table.distance_to.names.contains(name);
    let found: Vec<_> = each.filter(|(_, (known, _))| known.free && is_read(&known.name)).collect();
    let later = |index: usize| found.iter().map(|(other, _)| *other).filter(move |other| *other > index);
    found
        .iter()
        .map(|(index, (known, shape))| FoundSurface {
            angles: later(*index).filter_map(|other| angle(errors, (*index, other))).collect(),
            ..surface(&known.name, shape, &Errors { errors, index: *index })
        })
        .collect()
}

/// Standard errors of the numbers of one surface.
struct Errors<'a> {
    errors: &'a StandardErrors<'a>,
    /// Which of the model's surfaces.
    index: usize,
}

impl Errors<'_> {
    /// Of one number, mm or rad; nothing where it was held, for the rows cannot determine it.
    fn of(&self, which: usize) -> Option<f64> {
        self.errors.error_of(FreeParameter::Surface(self.index, which))
    }

    fn length(&self, name: &'static str, value: Option<f64>, which: usize) -> FoundNumber {
        FoundNumber { name, value, se: self.of(which), unit: "mm" }
    }

    /// A direction has no number of its own that a person could read, only an error about each axis across it.
    fn turn(&self, name: &'static str, which: usize) -> FoundNumber {
        FoundNumber { name, value: None, se: self.of(which).map(f64::to_degrees), unit: "deg" }
    }

    fn position_of(&self, at: &[f64; 3]) -> Vec<FoundNumber> {
        let axes = ["x", "y", "z"].into_iter().zip(at).enumerate();
        axes.map(|(axis, (name, value))| self.length(name, Some(*value), axis)).collect()
    }
}

fn surface(name: &str, shape: &SurfaceShape, errors: &Errors<'_>) -> FoundSurface {
    let (shape, direction, xyz_mm, numbers) = match shape {
        SurfaceShape::Plane { normal, offset } => (
            "plane",
            Some((*normal).into()),
            None,
            vec![
                errors.length("offset", Some(*offset), 0),
                errors.turn("tilt", 1),
                errors.turn("tilt across", 2),
            ],
        ),
        SurfaceShape::Line { point, direction } => (
            "edge",
            Some((*direction).into()),
            Some((*point).into()),
            vec![
                errors.length("left", None, 0),
                errors.length("over", None, 2),
                errors.turn("turn to the left", 1),
                errors.turn("tilt", 3),
            ],
        ),
        SurfaceShape::Sphere { centre, .. } => {
            let at: [f64; 3] = (*centre).into();
            ("ball", None, Some(at), errors.position_of(&at))
        }
        SurfaceShape::Point { point } => {
            let at: [f64; 3] = (*point).into();
            ("point", None, Some(at), errors.position_of(&at))
        }
    };
    FoundSurface { name: name.to_owned(), shape, direction, xyz_mm, numbers, angles: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn the_angle_between_two_planes_is_that_between_their_normals_and_a_ball_has_none() {
        let plane = |normal: Vector3<f64>| SurfaceShape::Plane { normal: normal.normalize(), offset: 5.0 };
        let found = between(&plane(Vector3::z()), &plane(Vector3::new(0.0, 1.0, 1.0))).unwrap();
        assert!((found.to_degrees() - 45.0).abs() < 1e-12, "{found}");
        let ball = SurfaceShape::Sphere { centre: Vector3::zeros(), radius: 3.0, free_radius: false };
        assert_eq!(
            (between(&plane(Vector3::z()), &ball), between(&ball, &plane(Vector3::z()))),
            (None, None)
        );
    }

    /// The normals of a table and of a wall.
    fn normals() -> [Vector3<f64>; 2] {
        [Vector3::new(0.01, -0.02, 1.0), Vector3::new(0.6, 0.8, 0.03)].map(|normal| normal.normalize())
    }

    /// Heights over a table and beside a wall, both about where the model has them, read by a known arm with noise of 0.1 mm.
    fn touched(seed: u64) -> crate::laboratory::Laboratory {
        let setup = "base: {free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
surfaces:
  table: {plane: {normal: [0, 0, 1], offset_mm: 0}, free: true}
  wall: {plane: {normal: [0.6, 0.8, 0], offset_mm: 0}, free: true}
free: []
noise: {height_mm: 0.1}
";
        let [table, wall] = normals();
        let mut random = plumb_estimation::Random::seeded(seed);
        let mut text = "q1_deg,q2_deg,q3_deg,on,height_mm\n".to_owned();
        for row in 0..40 {
            let q = [60.0, 50.0].map(|reach| reach * (2.0 * random.uniform() - 1.0));
            let (first, second) = (q[0].to_radians(), q[1].to_radians());
            // The last row leads 80 mm along the third axis: that of the first turned by the second and a quarter.
            let out = 350.0 * second.cos() + 80.0 * second.sin();
            let up = 400.0 + 350.0 * second.sin() - 80.0 * second.cos();
            let point = Vector3::new(out * first.cos(), out * first.sin(), up);
            let (name, normal) = if row % 2 == 0 { ("table", table) } else { ("wall", wall) };
            let height = normal.dot(&point) - 5.0 + 0.1 * random.normal();
            text.push_str(&format!("{},{},0,{name},{height}\n", q[0], q[1]));
        }
        let model = format!("{}{setup}", crate::testing::THREE_JOINTS);
        let model = plumb_calibration::arm_model::Model::parse("m.yaml", &model).unwrap();
        let table = plumb_calibration::table::Table::parse("t.csv", &text).unwrap();
        let holdout = crate::split::Holdout::None;
        let options = crate::laboratory::Options { holdout, ..Default::default() };
        crate::laboratory::Laboratory::new(model, table, options).unwrap()
    }

    #[test]
    fn the_middle_of_a_ball_and_a_point_are_three_numbers_with_their_values() {
        let lab = touched(3);
        let fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
        let errors = Errors { errors: &lab.standard_errors(&fitted), index: 0 };
        let at = Vector3::new(3.0, -4.0, 5.5);
        let ball = SurfaceShape::Sphere { centre: at, radius: 12.0, free_radius: false };
        for (shape, called) in [(ball, "ball"), (SurfaceShape::Point { point: at }, "point")] {
            let found = surface("it", &shape, &errors);
            let numbers: Vec<(&str, Option<f64>)> =
                found.numbers.iter().map(|number| (number.name, number.value)).collect();
            assert_eq!(numbers, [("x", Some(3.0)), ("y", Some(-4.0)), ("z", Some(5.5))]);
            assert_eq!((found.shape, found.xyz_mm), (called, Some([3.0, -4.0, 5.5])));
        }
    }

    #[test]
    fn the_angle_between_fitted_planes_scatters_as_its_standard_error_says() {
        let [table, wall] = normals();
        let truth = table.angle(&wall).to_degrees();
        let mut squares = 0.0;
        for seed in 0..40 {
            let lab = touched(seed);
            let fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
            let found = found_surfaces(&StandardErrors::of_the_fit(&fitted.problem, &fitted.fit));
            let names: Vec<&str> = found.iter().map(|one| one.name.as_str()).collect();
            assert_eq!((names, found[1].angles.len()), (vec!["table", "wall"], 0));
            let angle = &found[0].angles[0];
            let se = angle.se_deg.unwrap();
            assert!(
                found[0].angles.len() == 1 && angle.to == "wall" && (0.005..0.1).contains(&se),
                "{angle:?}"
            );
            squares += ((angle.deg - truth) / se).powi(2);
            let offset = &found[1].numbers[0];
            assert!((offset.value.unwrap() - 5.0).abs() < 5.0 * offset.se.unwrap(), "{offset:?}");
        }
        let ratio = (squares / 40.0_f64).sqrt();
        assert!((0.75..1.3).contains(&ratio), "{ratio}");
    }

    #[test]
    fn the_error_of_an_angle_is_made_of_the_tilts_of_both_planes() {
        let lab = touched(3);
        let mut fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
        let free_parameters = fitted.problem.free_parameters().to_vec();
        let mut error = |which: &[usize]| {
            fitted.fit.covariance.fill(0.0);
            for (index, free_parameter) in free_parameters.iter().enumerate() {
                if which.iter().any(|surface| {
                    TILTS.iter().any(|tilt| *free_parameter == FreeParameter::Surface(*surface, *tilt))
                }) {
                    fitted.fit.covariance[(index, index)] = 1e-6;
                }
            }
            angle(&StandardErrors::of_the_fit(&fitted.problem, &fitted.fit), (0, 1))
                .unwrap()
                .se_deg
                .unwrap()
                .to_radians()
        };
        // A normal that turns by a milliradian about two axes changes its angle to another by the part toward that one.
        for one in [error(&[0]), error(&[1])] {
            assert!((one / 1e-3 - 1.0).abs() < 1e-3, "{one}");
        }
        assert!((error(&[0, 1]) / 1e-3 - 2.0_f64.sqrt()).abs() < 1e-3);
    }
}
