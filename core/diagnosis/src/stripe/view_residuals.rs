//! What an adjustment leaves, view by view: an effect of the arm moves a whole stripe, so that a stripe is one reading.

use nalgebra::{Point3, Vector3};

use super::problem::{Problem, State};
use super::surface::Surface;

/// What is left of one view.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewResidual {
    /// Which view.
    pub view: usize,
    /// Points of it that took part.
    pub points: usize,
    /// How its points lie off their surfaces in the mean, away from these, mm in the base's frame.
    pub off_mm: [f64; 3],
    /// Root mean square distance of its points from their surfaces, mm.
    pub rms_mm: f64,
    /// The middle of its points, mm in the base's frame.
    pub middle_mm: [f64; 3],
}

/// Sums over the points of a view.
#[derive(Clone, Default)]
struct Sums {
    points: usize,
    off: Vector3<f64>,
    squares: f64,
    places: Vector3<f64>,
}

/// What is left of each view of which points took part.
pub(super) fn view_residuals(problem: &Problem<'_>, state: &State) -> Vec<ViewResidual> {
    let mut views = vec![Sums::default(); problem.views.len()];
    for (member, point) in problem.members.iter().zip(problem.points_in(state)) {
        let (Some(point), Some(surface)) = (point, state.surfaces.get(member.surface)) else { continue };
        let Some(sums) = views.get_mut(member.pixel.view) else { continue };
        let distance = surface.distance(member.part, &point);
        sums.points += 1;
        sums.off += outward(surface, member.part, &point) * distance;
        sums.squares += distance * distance;
        sums.places += point.coords;
    }
    let told = |(view, sums): (usize, Sums)| {
        let count = sums.points as f64;
        (sums.points > 0).then(|| ViewResidual {
            view,
            points: sums.points,
            off_mm: (sums.off / count).into(),
            rms_mm: (sums.squares / count).sqrt(),
            middle_mm: (sums.places / count).into(),
        })
    };
    views.into_iter().enumerate().filter_map(told).collect()
}

/// Away from a part of a surface, of length one.
fn outward(surface: &Surface, part: usize, point: &Point3<f64>) -> Vector3<f64> {
    match surface {
        Surface::Faces(faces) => faces.get(part).map_or(Vector3::zeros(), |(normal, _)| *normal),
        Surface::Sphere(centre, _) => (point - centre).try_normalize(1e-9).unwrap_or_default(),
    }
}
