//! The T target as a cell file describes it: what the operator lays on the table. The screens draw the hand over it, `plumb target` prints it.
//!
//! Its own frame: the waist's axis is the origin; u points to where line B touches its circle, v to the left of that. Lengths in mm.

use plumb_document::{MapReader, Node};

use crate::read_context::ReadContext;

/// Numbers of a T that a file may leave out, mm and deg: the target of the simulated cells, which fits on a sheet of A4.
const HEAD_MM: (f64, f64) = (25.0, 120.0);
const BODY: (f64, f64) = (210.0, 12.0);
const MARGIN_MM: f64 = 20.0;

/// No target is larger, mm: arms that are on tables do not reach so far.
const LARGEST_MM: f64 = 2000.0;

/// A T target: a black head whose outer edge is line B, and a black body, a sector about the waist's axis, one side of which is line A.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TTarget {
    /// Direction of line A about the waist's axis, in the frame of the cell, rad.
    pub line_a: f64,
    /// Distance of line B from the waist's axis, mm: K of Yang & Siegel.
    pub line_b_distance: f64,
    /// From line A to where line B touches its circle, rad; its sign says on which side of line A white lies.
    pub line_b_offset: f64,
    /// How far the head reaches from line B toward the axis, mm.
    pub head_depth: f64,
    /// The head along line B, half to either side, mm.
    pub head_width: f64,
    /// Where the body ends, from the axis, mm.
    pub body_radius: f64,
    /// The body's angle, from line A away from white, rad.
    pub body_angle: f64,
    /// How far the white background reaches beyond the black, mm.
    pub margin: f64,
}

/// Where a point lies over the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverTarget {
    /// How far beyond line B, away from the axis, mm; negative on the axis's side.
    pub beyond_b: f64,
    /// How far to the left of line A, seen from the axis, mm; negative to the right.
    pub left_of_a: f64,
    /// What lies under it.
    pub under: Under,
}

/// What lies under a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Under {
    /// The white quadrant: beyond line B, on the white side of line A.
    WhiteQuadrant,
    /// The black T.
    Black,
    /// Neither.
    Beside,
}

/// Reads `target:`.
pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<TTarget> {
    let problems = context.problems;
    let mut map = MapReader::new(node, "`target`", problems)?;
    let t = map.required("t");
    map.finish();
    let mut map = MapReader::new(t?, "a T target", problems)?;
    let angle = |node: &Node, what: &str, most: f64| node.number_between(what, -most, most, problems);
    let length = |node: &Node, what: &str| node.number_between(what, 1.0, LARGEST_MM, problems);
    let line_a = map.required("line_a_deg").and_then(|node| angle(node, "`line_a_deg`", 180.0));
    let line_b = map.required("line_b").and_then(|node| {
        let mut map = MapReader::new(node, "`line_b`", problems)?;
        let distance = map.required("distance_mm").and_then(|node| length(node, "`distance_mm`"));
        let offset = map.required("offset_deg").and_then(|node| {
            let offset = angle(node, "`offset_deg`", 45.0)?;
            if offset == 0.0 {
                let help = "its sign says on which side of line A white lies: positive to the left, seen from the waist's axis";
                problems.add(node.span, "`offset_deg` is 0", help);
            }
            Some(offset)
        });
        map.finish();
        distance.zip(offset)
    });
    let mut pair = |key: &'static str, names: [&'static str; 2], usual: (f64, f64)| {
        let Some(node) = map.optional(key) else { return Some(usual) };
        let mut map = MapReader::new(node, key, problems)?;
        let mut number = |name: &'static str| {
            map.required(name)
                .and_then(|node| node.number_between(&format!("`{name}`"), 0.1, LARGEST_MM, problems))
        };
        let (first, second) = (number(names[0]), number(names[1]));
        map.finish();
        first.zip(second)
    };
    let head = pair("head", ["depth_mm", "width_mm"], HEAD_MM);
    let body = pair("body", ["radius_mm", "angle_deg"], BODY);
    let margin = map.optional("patch_margin_mm");
    let margin = margin
        .map_or(Some(MARGIN_MM), |node| node.number_between("`patch_margin_mm`", 0.0, LARGEST_MM, problems));
    map.finish();
    let (distance, offset) = line_b?;
    let ((depth, width), (radius, body_angle)) = (head?, body?);
    if depth >= distance || radius <= distance || body_angle >= 90.0 {
        let help = "the head lies between the waist's axis and line B, and the body reaches beyond line B, by less than 90 degrees";
        problems.add(node.span, "this T cannot be drawn", help);
    }
    Some(TTarget {
        line_a: line_a?.to_radians(),
        line_b_distance: distance,
        line_b_offset: offset.to_radians(),
        head_depth: depth,
        head_width: width,
        body_radius: radius,
        body_angle: body_angle.to_radians(),
        margin: margin?,
    })
}

impl TTarget {
    /// Which side of line A is white: 1 left of it, seen from the axis, -1 right of it.
    pub fn white_side(&self) -> f64 {
        self.line_b_offset.signum()
    }

    /// Where a point of the cell (mm) lies over the target.
    pub fn over(&self, [x, y]: [f64; 2]) -> OverTarget {
        let (sin, cos) = self.line_a.sin_cos();
        let left_of_a = y * cos - x * sin;
        let [u, v] = self.own_frame([x, y]);
        let beyond_b = u - self.line_b_distance;
        let under = if self.is_black(u, v) {
            Under::Black
        } else if beyond_b > 0.0 && left_of_a * self.white_side() > 0.0 {
            Under::WhiteQuadrant
        } else {
            Under::Beside
        };
        OverTarget { beyond_b, left_of_a, under }
    }

    fn is_black(&self, u: f64, v: f64) -> bool {
        let inner = self.line_b_distance - self.head_depth;
        if (inner..=self.line_b_distance).contains(&u) && v.abs() <= self.head_width / 2.0 {
            return true;
        }
        // From line A on, away from white.
        let angle = (v.atan2(u) + self.line_b_offset) * -self.white_side();
        (0.0..=self.body_angle).contains(&angle) && (inner..=self.body_radius).contains(&u.hypot(v))
    }

    fn own_frame(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = (self.line_a + self.line_b_offset).sin_cos();
        [x * cos + y * sin, y * cos - x * sin]
    }

    /// A point of the target's own frame in the frame of the cell, mm.
    pub fn in_cell(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = (self.line_a + self.line_b_offset).sin_cos();
        [u * cos - v * sin, u * sin + v * cos]
    }

    /// The corners of the head, in the target's own frame, mm.
    pub fn head(&self) -> Vec<[f64; 2]> {
        rectangle(self.line_b_distance - self.head_depth, self.line_b_distance, self.head_width / 2.0)
    }

    /// The outline of the body, in the target's own frame, mm: along line A first.
    pub fn body(&self) -> Vec<[f64; 2]> {
        let inner = self.line_b_distance - self.head_depth;
        let at = |radius: f64, angle: f64| {
            let angle = -self.line_b_offset - angle * self.white_side();
            [radius * angle.cos(), radius * angle.sin()]
        };
        let steps = 12;
        let angle = |step: i32| self.body_angle * f64::from(step) / f64::from(steps);
        let outer = (0..=steps).map(|step| at(self.body_radius, angle(step)));
        let back = (0..=steps).rev().map(|step| at(inner, angle(step)));
        outer.chain(back).collect()
    }

    /// The corners of the white background, in the target's own frame, mm.
    pub fn patch(&self) -> Vec<[f64; 2]> {
        let inner = self.line_b_distance - self.head_depth - self.margin;
        rectangle(inner, self.body_radius + self.margin, self.head_width / 2.0 + self.margin)
    }

    /// Line A from its beginning at the head's inner edge to the body's end, in the target's own frame, mm.
    pub fn line_a_ends(&self) -> [[f64; 2]; 2] {
        let (sin, cos) = self.line_b_offset.sin_cos();
        [self.line_b_distance - self.head_depth, self.body_radius].map(|radius| [radius * cos, -radius * sin])
    }
}

fn rectangle(near: f64, far: f64, half: f64) -> Vec<[f64; 2]> {
    vec![[near, half], [far, half], [far, -half], [near, -half]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn target(offset_deg: f64) -> TTarget {
        TTarget {
            line_a: 0.0,
            line_b_distance: 140.0,
            line_b_offset: offset_deg.to_radians(),
            head_depth: 25.0,
            head_width: 120.0,
            body_radius: 210.0,
            body_angle: 12_f64.to_radians(),
            margin: 20.0,
        }
    }

    fn at(radius: f64, angle_deg: f64) -> [f64; 2] {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        [radius * cos, radius * sin]
    }

    #[test]
    fn the_white_quadrant_lies_beyond_line_b_on_the_white_side_of_line_a() {
        let over = target(8.0).over(at(171.0, 8.0));
        assert!((over.beyond_b - 31.0).abs() < 1e-9, "{over:?}");
        assert!((over.left_of_a - 171.0 * 8_f64.to_radians().sin()).abs() < 1e-9, "{over:?}");
        assert_eq!(over.under, Under::WhiteQuadrant);
        for (radius, angle, under) in [
            (171.0, 0.1, Under::WhiteQuadrant),
            (171.0, -0.1, Under::Black),
            (171.0, -11.9, Under::Black),
            (171.0, -12.1, Under::Beside),
            (139.0, 8.0, Under::Black),
            (114.0, 8.0, Under::Beside),
        ] {
            assert_eq!(target(8.0).over(at(radius, angle)).under, under, "{radius} mm, {angle} deg");
            assert_eq!(
                target(-8.0).over(at(radius, -angle)).under,
                under,
                "mirrored: {radius} mm, {angle} deg"
            );
        }
    }

    #[test]
    fn the_outlines_enclose_what_is_black() {
        let target = target(8.0);
        for shape in [target.head(), target.body()] {
            let count = shape.len() as f64;
            let middle = [0, 1].map(|axis| shape.iter().map(|point| point[axis]).sum::<f64>() / count);
            let [x, y] = target.in_cell(middle);
            assert_eq!(target.over([x, y]).under, Under::Black, "{middle:?}");
        }
        let [near, far] = target.line_a_ends().map(|end| target.in_cell(end));
        assert!(
            near[1].abs() < 1e-9 && far[1].abs() < 1e-9,
            "line A runs through the axis: {near:?} {far:?}"
        );
    }
}
