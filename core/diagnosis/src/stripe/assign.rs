//! Which point lies on which surface, and how much the points of a stripe scatter.

use std::ops::Range;

use plumb_calibration::fit::{ResidualModel, State};
use plumb_calibration::table::Stretch;

use super::surface::away;
use super::table::{Scans, StripePixel};
use crate::thresholds::STRETCH_SCATTER;

/// A point at an edge could be of either side: it is left out, mm.
const EDGE_MM: f64 = 1.5;

/// What a surface is rough by, and what else no model knows, mm.
const ROUGH_MM: f64 = 0.02;

/// A point so many of its standard uncertainties off the middle of its neighbours is none of the stripe.
const STRAY: f64 = 6.0;

/// Neighbours on either side among which a stray point is looked for.
const NEIGHBOURS: usize = 2;

/// A point with the surface it lies on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Member {
    view: usize,
    pixel: [f64; 2],
    /// The surface, by its index in the model.
    part: usize,
    /// How far it lies outside, mm.
    distance: f64,
    /// Its standard uncertainty, mm.
    sigma_mm: f64,
}

impl Member {
    fn is_beside(&self, other: &Self) -> bool {
        self.view == other.view && self.part == other.part
    }
}

/// The pixels of each view, by their places: they are in the order of the views.
fn by_view(scans: &Scans) -> Vec<Vec<&StripePixel>> {
    let mut views: Vec<Vec<&StripePixel>> = vec![Vec::new(); scans.views.len()];
    for pixel in &scans.pixels {
        if let Some(view) = views.get_mut(pixel.view) {
            view.push(pixel);
        }
    }
    views
}

/// Gives every point within `limit` mm of one body, and of no other, to the part of it that is nearest.
pub(super) fn assigned(
    problem: &ResidualModel<'_>,
    state: &State,
    bodies: &[Range<usize>],
    scans: &Scans,
    limit: f64,
) -> Vec<Member> {
    let mut members = Vec::new();
    for (view, pixels) in by_view(scans).iter().enumerate() {
        let seen: Vec<[f64; 2]> = pixels
            .iter()
            // Half a pixel aside shows how many mm a pixel is there: it depends on distance and slant.
            .flat_map(|pixel| [[pixel.u_px, pixel.v_px], [pixel.u_px + 0.5, pixel.v_px]])
            .collect();
        let points = problem.stripe_points(state, view, &seen);
        let own = pixels.iter().zip(points.chunks(2)).filter_map(|(pixel, points)| {
            let (point, aside) = (points.first().copied()??, points.get(1).copied()??);
            let mut near: Vec<_> =
                bodies.iter().filter_map(|body| away(&state.surfaces, body, &point)).collect();
            near.sort_by(|one, other| one.distance.abs().total_cmp(&other.distance.abs()));
            let nearest = near.first()?;
            let rival = near.get(1).map_or(f64::INFINITY, |other| other.distance.abs());
            let distance = nearest.distance;
            // Near an edge the point may be of either face, and which one would follow from the errors that are sought.
            let certain = nearest.lead > EDGE_MM && rival - distance.abs() > EDGE_MM;
            let per_px = 2.0 * (aside - point).norm();
            (certain && distance.abs() <= limit).then(|| Member {
                view,
                pixel: [pixel.u_px, pixel.v_px],
                part: nearest.part,
                distance,
                sigma_mm: (per_px * pixel.sigma_px).hypot(ROUGH_MM),
            })
        });
        members.extend(own);
    }
    // The points of one surface in one picture come together, in the order in which they were seen.
    members.sort_by_key(|member| (member.view, member.part));
    without_strays(&members)
}

/// Those that do not lie far off their neighbours.
fn without_strays(members: &[Member]) -> Vec<Member> {
    let sound = members.iter().enumerate().filter(|(index, member)| {
        let near = index.saturating_sub(NEIGHBOURS)..(index + NEIGHBOURS + 1).min(members.len());
        let own = members.get(near).unwrap_or(&[]).iter().filter(|other| other.is_beside(member));
        let mut distances: Vec<f64> = own.map(|other| other.distance).collect();
        distances.sort_by(f64::total_cmp);
        // The median of the neighbours follows a stripe that runs aslant, and does not feel the stray itself.
        let middle = distances.get(distances.len() / 2).copied().unwrap_or(member.distance);
        (member.distance - middle).abs() <= STRAY * member.sigma_mm
    });
    sound.map(|(_, member)| *member).collect()
}

/// Root mean square distance from the surfaces, mm.
pub(super) fn rms_mm(members: &[Member]) -> f64 {
    root_mean_square(members.iter().map(|member| member.distance))
}

/// What the points' own uncertainties would leave, mm.
pub(super) fn floor_mm(members: &[Member]) -> f64 {
    root_mean_square(members.iter().map(|member| member.sigma_mm))
}

fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}

/// Scatter of neighbouring points of one stripe on one surface, mm, from second differences: what changes evenly along a stripe is not in it.
pub(super) fn noise_mm(members: &[Member]) -> f64 {
    let bends: Vec<f64> = members
        .windows(3)
        .filter_map(|three| match three {
            [before, at, after] if before.is_beside(at) && at.is_beside(after) => {
                Some(before.distance - 2.0 * at.distance + after.distance)
            }
            _ => None,
        })
        .collect();
    // A second difference has six times the variance of one point.
    (bends.iter().map(|bend| bend * bend).sum::<f64>() / 6.0 / bends.len().max(1) as f64).sqrt()
}

/// The stretches that the points make. Their uncertainty: the points' own, brought to the scatter that neighbours show, falls with their number; and points of
/// one stripe err alike besides, by up to a part of that scatter however many they are.
pub(super) fn stretches(members: &[Member]) -> Vec<Stretch> {
    let noise = noise_mm(members);
    let scatter_over_own = noise / floor_mm(members).max(f64::MIN_POSITIVE);
    let all = members.chunk_by(Member::is_beside).filter_map(|own| {
        let first = own.first()?;
        let per_point = floor_mm(own) * scatter_over_own;
        let alone = per_point / (own.len() as f64).sqrt();
        let sigma = alone.hypot(STRETCH_SCATTER * noise).max(f64::MIN_POSITIVE);
        let pixels = own.iter().map(|member| member.pixel).collect();
        Some(Stretch::new(first.view, first.part, pixels, sigma))
    });
    all.filter(|stretch| stretch.readings() > 0).collect()
}

#[cfg(test)]
mod assign_tests {
    use super::*;

    /// Points of one stripe on one surface, so far outside it, each known to 0.1 mm.
    fn stripe(view: usize, part: usize, distances: &[f64]) -> Vec<Member> {
        let members = (0..).zip(distances).map(|(index, distance)| Member {
            view,
            pixel: [f64::from(index), 7.0],
            part,
            distance: *distance,
            sigma_mm: 0.1,
        });
        members.collect()
    }

    #[test]
    fn a_point_far_off_the_median_of_its_neighbours_is_left_out_and_a_slope_is_not() {
        let kept = |distances: &[f64]| -> Vec<f64> {
            without_strays(&stripe(0, 0, distances)).iter().map(|member| member.distance).collect()
        };
        let slope = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0];
        assert_eq!(kept(&slope), slope);
        let edge = STRAY * 0.1;
        assert_eq!(kept(&[0.0, 0.0, 1.01 * edge, 0.0, 0.0]), [0.0; 4]);
        assert_eq!(kept(&[0.0, 0.0, 0.99 * edge, 0.0, 0.0]).len(), 5);
        assert_eq!(kept(&[0.0, 0.0, -1.01 * edge, 0.0, 0.0]), [0.0; 4], "on either side");
        // Points of another surface, or of another picture, are no neighbours.
        let two = [stripe(0, 0, &[0.0; 3]), stripe(0, 1, &[5.0; 3]), stripe(1, 1, &[9.0; 3])].concat();
        assert_eq!(without_strays(&two).len(), 9);
    }

    #[test]
    fn the_median_is_that_of_two_neighbours_on_either_side() {
        let kept = |distances: &[f64]| without_strays(&stripe(0, 0, distances)).len();
        // Three of five, though not of nine; two of five are strays.
        assert_eq!(kept(&[0.0, 0.0, 0.0, 0.0, 0.0, 9.0, 9.0, 9.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 13);
        assert_eq!(kept(&[9.0, 9.0, 9.0, 9.0, 9.0, 0.0, 0.0, 0.0, 9.0, 9.0, 9.0, 9.0, 9.0]), 13);
        assert_eq!(kept(&[0.0, 0.0, 0.0, 0.0, 0.0, 9.0, 9.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 11);
    }

    #[test]
    fn the_scatter_of_neighbours_feels_neither_place_nor_slope() {
        // Second differences of 0, 1, 0, 1, 0 are -2, 2, -2: root of 4 / 6. A slope adds nothing.
        let zigzag = |slope: f64| -> Vec<f64> {
            (0..5).map(|index| f64::from(index % 2) + slope * f64::from(index)).collect()
        };
        for slope in [0.0, 3.0] {
            assert!((noise_mm(&stripe(0, 0, &zigzag(slope))) - (4.0_f64 / 6.0).sqrt()).abs() < 1e-12);
        }
        assert_eq!(noise_mm(&stripe(0, 0, &[0.0, 9.0])), 0.0, "two points do not bend");
        // Three points of which the last lies on another surface do not either.
        let mixed = [stripe(0, 0, &[0.0, 4.0]), stripe(0, 1, &[0.0])].concat();
        assert_eq!(noise_mm(&mixed), 0.0);
        assert!((rms_mm(&stripe(0, 0, &[3.0, -4.0])) - 12.5_f64.sqrt()).abs() < 1e-12);
        assert!((floor_mm(&stripe(0, 0, &[3.0, -4.0])) - 0.1).abs() < 1e-12);
        assert_eq!(rms_mm(&[]), 0.0);
    }

    #[test]
    fn a_stretch_is_as_uncertain_as_the_mean_of_its_points_and_what_they_err_alike() {
        // Points known to 0.1 mm that scatter by s: each counts s, their mean s / root n, and 0.66 s besides.
        let zigzag: Vec<f64> = (0..9).map(|index| f64::from(index % 2)).collect();
        let all = [stripe(0, 2, &zigzag), stripe(1, 2, &[0.0, 1.0, 0.0])].concat();
        let scatter = noise_mm(&all);
        let made = stretches(&all);
        assert_eq!(
            made.iter().map(|one| (one.row, one.surface, one.pixels.len())).collect::<Vec<_>>(),
            [(0, 2, 9), (1, 2, 3)]
        );
        for (stretch, count) in made.iter().zip([9.0_f64, 3.0]) {
            let expected = scatter * (1.0 / count + STRETCH_SCATTER * STRETCH_SCATTER).sqrt();
            assert!((stretch.sigma - expected).abs() < 1e-9, "{} {expected}", stretch.sigma);
        }
    }

    /// Distance and uncertainty of a pixel's point that lies so far over horizontal planes, each a body or the faces of one; mm.
    fn given(over: &[f64], bodies: &[Range<usize>], limit: f64) -> Option<(usize, f64, f64)> {
        use crate::stripe::tests::{puma, rig};
        use plumb_calibration::arm_model::SurfaceShape;
        use plumb_calibration::measurement::Observations;
        let surfaces = [("low".to_owned(), crate::stripe::Surface::plane(nalgebra::Vector3::z(), 0.0))];
        let model = crate::stripe::prepare::prepared(&puma(), &rig(), &surfaces);
        let q = [-22.7_f64, -65.6, 198.0, 0.0, 47.6, 157.3].map(f64::to_radians).to_vec();
        let mut table = plumb_calibration::table::Table { joints: 6, q: q.clone(), ..Default::default() };
        table.lines.push(1);
        table.note(None, None);
        let nothing = Observations::without_readings(1);
        let problem = ResidualModel::new(&model, &table, &nothing, &[]).unwrap();
        let mut state = problem.start();
        let pixel = StripePixel { view: 0, u_px: 130.0, v_px: 120.0, sigma_px: 0.3 };
        let point = problem.stripe_points(&state, 0, &[[130.0, 120.0]])[0].unwrap();
        let planes = over
            .iter()
            .map(|over| SurfaceShape::Plane { normal: nalgebra::Vector3::z(), offset: point.z - over });
        state.surfaces = planes.collect();
        let view = super::super::table::View { q, speed: Vec::new(), approach: Vec::new(), time_s: None };
        let scans =
            Scans { views: vec![view], scan_of_view: vec![0], pixels: vec![pixel], names: Vec::new() };
        let found = assigned(&problem, &state, bodies, &scans, limit);
        found.first().map(|member| (member.part, member.distance, member.sigma_mm))
    }

    #[test]
    fn a_point_is_given_to_the_nearest_surface_within_the_limit_with_its_uncertainty_there() {
        let rig = crate::stripe::tests::rig();
        let aside = rig.point(130.5, 120.0).unwrap() - rig.point(130.0, 120.0).unwrap();
        // Three tenths of a pixel, which half a pixel shows the half of, and what the surface is rough by.
        let sigma = (2.0 * aside.norm() * 0.3).hypot(0.02);
        let view = std::slice::from_ref(&(0..1));
        for over in [0.4, -0.4] {
            let (part, distance, own) = given(&[over], view, 0.41).unwrap();
            assert!(
                part == 0 && (distance - over).abs() < 1e-9 && (own - sigma).abs() < 1e-9,
                "{own} {sigma}"
            );
            assert_eq!(given(&[over], view, 0.39), None);
        }
    }

    #[test]
    fn a_point_near_two_surfaces_is_given_to_neither() {
        let two_bodies = [0..1, 1..2];
        assert_eq!(given(&[0.2, 1.6], &two_bodies, 9.0), None);
        assert_eq!(given(&[0.2, 1.8], &two_bodies, 9.0).map(|found| found.0), Some(0));
        assert_eq!(given(&[-1.8, 0.2], &two_bodies, 9.0).map(|found| found.0), Some(1));
        // Two faces of one body: the outer one is nearer, and must be so clearly.
        assert_eq!(given(&[0.2, -1.2], std::slice::from_ref(&(0..2)), 9.0), None);
        assert_eq!(given(&[0.2, -1.4], std::slice::from_ref(&(0..2)), 9.0).map(|found| found.0), Some(0));
    }
}
