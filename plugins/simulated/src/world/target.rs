//! The T target on the table: a black head whose outer edge is line B, a black body one side of which is line A, and the
//! patch of standard background both are painted on.
//!
//! Its own frame: the waist's axis, as the target was meant to be laid, is the origin; u points to where line B touches its
//! circle, v to the left of that. Lengths in mm.

use crate::physics::rigid::Vector;

/// The target's shape, colours and position.
#[derive(Debug, Clone, PartialEq)]
pub struct TTarget {
    /// Waist angle of line A in the world, rad.
    pub line_a: f64,
    /// Distance of line B from the waist's axis: K in the paper, mm.
    pub line_b_distance: f64,
    /// Waist angle from line A to the point where line B touches its circle, rad; its sign says on which side of A white lies.
    pub line_b_offset: f64,
    /// How far the head reaches from line B toward the waist's axis, mm.
    pub head_depth: f64,
    /// The head's extent along line B, half to either side, mm.
    pub head_width: f64,
    /// Radius at which the body ends, mm.
    pub body_radius: f64,
    /// The body's angle, from line A away from the white side, rad.
    pub body_angle: f64,
    /// Half the extent of the patch of standard background along v, and how far it reaches beyond head and body, mm.
    pub patch_margin: f64,
    /// Reflectance of the black, 0 to 1.
    pub black: f64,
    /// Reflectance of the standard background, 0 to 1.
    pub white: f64,
    /// How far the target was laid from where it should be, x and y of the world, mm.
    pub misplaced: [f64; 2],
    /// How far the target was turned about the waist's axis when it was laid, rad.
    pub misturned: f64,
}

impl TTarget {
    /// How far `point` lies outside the black, mm: positive outside, negative inside. Exact in sign and, near a straight
    /// edge, in size.
    pub fn outside_black(&self, point: Vector) -> f64 {
        let (u, v) = self.own_frame(point);
        self.outside_head(u, v).min(self.outside_body(u, v))
    }

    /// How far `point` lies outside the patch of standard background, mm: positive outside, negative inside.
    pub fn outside_patch(&self, point: Vector) -> f64 {
        let (u, v) = self.own_frame(point);
        let inner = self.line_b_distance - self.head_depth - self.patch_margin;
        let outer = self.body_radius + self.patch_margin;
        outside_box(u, v, inner, outer, self.head_width / 2.0 + self.patch_margin)
    }

    /// A point of the world in the frame that the target's lines make: that of the world, had it been laid where it was meant to.
    pub fn as_meant(&self, point: Vector) -> Vector {
        let (x, y) = (point.x - self.misplaced[0], point.y - self.misplaced[1]);
        let (sine, cosine) = self.misturned.sin_cos();
        Vector { x: x * cosine + y * sine, y: y * cosine - x * sine, z: point.z }
    }

    fn own_frame(&self, point: Vector) -> (f64, f64) {
        let x = point.x - self.misplaced[0];
        let y = point.y - self.misplaced[1];
        let (sine, cosine) = (self.line_a + self.line_b_offset + self.misturned).sin_cos();
        (x * cosine + y * sine, y * cosine - x * sine)
    }

    fn outside_head(&self, u: f64, v: f64) -> f64 {
        outside_box(u, v, self.line_b_distance - self.head_depth, self.line_b_distance, self.head_width / 2.0)
    }

    /// The body is a sector from the head outward; its near side is line A, which runs through the waist's axis.
    fn outside_body(&self, u: f64, v: f64) -> f64 {
        let white_side = self.line_b_offset.signum();
        let beyond = |angle: f64| {
            let (sine, cosine) = angle.sin_cos();
            (v * cosine - u * sine) * white_side
        };
        let near_side = beyond(-self.line_b_offset);
        let far_side = -beyond(-self.line_b_offset - white_side * self.body_angle);
        let radius = u.hypot(v);
        let inner = self.line_b_distance - self.head_depth - radius;
        let outer = radius - self.body_radius;
        near_side.max(far_side).max(inner).max(outer)
    }
}

/// How far (u, v) lies outside a rectangle: positive outside, negative inside.
fn outside_box(u: f64, v: f64, low_u: f64, high_u: f64, half_v: f64) -> f64 {
    let beyond_u = (low_u - u).max(u - high_u);
    let beyond_v = v.abs() - half_v;
    if beyond_u > 0.0 && beyond_v > 0.0 { beyond_u.hypot(beyond_v) } else { beyond_u.max(beyond_v) }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Line A at waist 0, white at positive waist angles, K = 140 mm.
    pub(crate) fn target() -> TTarget {
        TTarget {
            line_a: 0.0,
            line_b_distance: 140.0,
            line_b_offset: 8_f64.to_radians(),
            head_depth: 25.0,
            head_width: 120.0,
            body_radius: 210.0,
            body_angle: 12_f64.to_radians(),
            patch_margin: 20.0,
            black: 0.05,
            white: 0.9,
            misplaced: [0.0, 0.0],
            misturned: 0.0,
        }
    }

    fn at(radius: f64, angle_deg: f64) -> Vector {
        let (sine, cosine) = angle_deg.to_radians().sin_cos();
        Vector { x: radius * cosine, y: radius * sine, z: 0.0 }
    }

    #[test]
    fn line_a_is_the_waist_angle_at_which_white_turns_black_at_every_radius() {
        for radius in [150.0, 170.0, 200.0] {
            assert!(target().outside_black(at(radius, 0.01)) > 0.0);
            assert!(target().outside_black(at(radius, -0.01)) < 0.0);
            assert!(target().outside_black(at(radius, 0.0)).abs() < 1e-12);
        }
    }

    #[test]
    fn line_b_is_touched_at_its_distance_in_the_stated_direction() {
        assert!((target().outside_black(at(141.5, 8.0)) - 1.5).abs() < 1e-12);
        assert!((target().outside_black(at(139.0, 8.0)) + 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_negative_offset_puts_white_on_the_other_side() {
        let mirrored = TTarget { line_b_offset: -8_f64.to_radians(), ..target() };
        for (radius, angle) in [(160.0, 3.0), (160.0, -3.0), (139.0, 8.0), (150.0, -11.0)] {
            let here = target().outside_black(at(radius, angle));
            let there = mirrored.outside_black(at(radius, -angle));
            assert!((here - there).abs() < 1e-12);
        }
    }

    #[test]
    fn a_target_laid_aside_takes_its_lines_along() {
        let shifted = TTarget { misplaced: [0.0, 1.0], ..target() };
        let on_line_a = Vector { x: 170.0, y: 1.0, z: 0.0 };
        assert!(shifted.outside_black(on_line_a).abs() < 1e-12);
        let turned = TTarget { misturned: 2_f64.to_radians(), ..target() };
        assert!(turned.outside_black(at(170.0, 2.0)).abs() < 1e-12);
    }

    #[test]
    fn the_patch_surrounds_the_black() {
        for (radius, angle) in [(150.0, -5.0), (130.0, 8.0), (200.0, -11.0), (175.0, 4.0)] {
            assert!(target().outside_patch(at(radius, angle)) < 0.0);
        }
        assert!(target().outside_patch(at(300.0, 0.0)) > 0.0);
    }
}
