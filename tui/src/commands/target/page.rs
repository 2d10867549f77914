//! The sheet: the T, what the operator has to know to lay it, and rulers to check the print. Nothing is printed on the white that the sensor sees.

use plumb_cell::workcell::TTarget;

/// Room a printer leaves blank at the edges of the paper, mm.
const EDGE: f64 = 7.0;
/// Height of the title, its lines and the horizontal ruler above the target, mm.
const HEAD: f64 = 30.0;
/// Length of the rulers, mm.
const RULER: f64 = 100.0;
/// Height of small letters, mm.
const SMALL: f64 = 3.2;

/// A sheet of paper with what is on it. Millimetres from the lower left corner, x to the right, y up.
pub(super) struct Page {
    /// Width and height, mm.
    pub(super) size: [f64; 2],
    pub(super) title: String,
    pub(super) marks: Vec<Mark>,
}

/// Something on the sheet.
pub(super) enum Mark {
    /// An area filled in black.
    Black(Vec<[f64; 2]>),
    /// A line, its width, mm, and whether it is dashed.
    Line { points: Vec<[f64; 2]>, width: f64, dashed: bool },
    /// A text that begins at this point of its base line; height of its letters, mm.
    Text { at: [f64; 2], height: f64, text: String },
}

/// Why a target is not printed.
#[derive(Debug, PartialEq, thiserror::Error)]
pub(super) enum PageError {
    #[error(
        "the target is {wide:.0} x {high:.0} mm with its white margin, and this paper has room for {room_wide:.0} x {room_high:.0} mm: choose another --paper"
    )]
    TooLarge { wide: f64, high: f64, room_wide: f64, room_high: f64 },
}

impl Page {
    /// The sheet with this target: away from the arm is up, so that what is left of line A lies at the left.
    pub(super) fn of(cell: &str, target: &TTarget, size: [f64; 2]) -> Result<Self, PageError> {
        let patch = target.patch();
        let (near, far) = (patch[0][0], patch[1][0]);
        // A body far out reaches to the side beyond the white.
        let half = patch.iter().chain(&target.body()).map(|point| point[1].abs()).fold(0.0, f64::max);
        let (wide, high) = (2.0 * half, far - near);
        let room = [size[0] - 2.0 * EDGE, size[1] - 2.0 * EDGE - HEAD];
        if wide > room[0] || high > room[1] {
            let [room_wide, room_high] = room;
            return Err(PageError::TooLarge { wide, high, room_wide, room_high });
        }
        // The waist's axis on the sheet too, where there is room for it.
        let with_axis = far <= room[1] - EDGE;
        let bottom =
            if with_axis { EDGE + (room[1] - far) / 2.0 } else { EDGE + (room[1] - high) / 2.0 - near };
        let axis = [size[0] / 2.0, bottom];
        let at = |[u, v]: [f64; 2]| [axis[0] - v, axis[1] + u];
        let mut page = Self { size, title: format!("T target of {cell}"), marks: Vec::new() };
        page.head(target, with_axis);
        page.marks.push(Mark::Black(target.head().into_iter().map(at).collect()));
        page.marks.push(Mark::Black(target.body().into_iter().map(at).collect()));
        let mut border: Vec<[f64; 2]> = patch.iter().copied().map(at).collect();
        border.extend(border.first().copied());
        page.line(border, 0.15, true);
        page.lines_named(target, at);
        if with_axis {
            page.axis(target, axis, at);
        } else {
            let [x, y] = at([near, patch[0][1]]);
            let text =
                format!("The waist's axis lies {near:.1} mm below this edge of the frame, in its middle.");
            page.text([x, y - 5.0], SMALL, &text);
        }
        Ok(page)
    }

    fn text(&mut self, at: [f64; 2], height: f64, text: &str) {
        self.marks.push(Mark::Text { at, height, text: text.to_owned() });
    }

    fn line(&mut self, points: Vec<[f64; 2]>, width: f64, dashed: bool) {
        self.marks.push(Mark::Line { points, width, dashed });
    }

    /// Title, how to lay it, and the two rulers.
    fn head(&mut self, target: &TTarget, with_axis: bool) {
        let (left, top) = (EDGE + 3.0, self.size[1] - EDGE);
        let title = self.title.clone();
        self.text([left, top - 5.0], 4.5, &title);
        let degrees = target.line_b_offset.abs().to_degrees();
        let side = if target.white_side() > 0.0 { "left" } else { "right" };
        let facts = format!(
            "Line B {:.1} mm from the waist's axis, met {degrees:.1} deg {side} of line A. White side: {side} of line A, seen from the arm.",
            target.line_b_distance
        );
        self.text([left, top - 10.5], SMALL, &facts);
        let lay = if with_axis {
            "Lay it flat, the cross on the waist's axis, and fix it. Print at 100 %, matt. Both rulers have to be 100 mm long:"
        } else {
            "Lay it flat, line A pointing at the waist's axis, and fix it. Print at 100 %, matt. Both rulers have to be 100 mm long:"
        };
        self.text([left, top - 15.0], SMALL, lay);
        self.ruler([left, top - 24.0], [1.0, 0.0]);
        let right = self.size[0] - EDGE - 8.0;
        self.ruler([right, top - 22.0 - RULER], [0.0, 1.0]);
    }

    /// A ruler from a point in a direction, with a tick each millimetre.
    fn ruler(&mut self, from: [f64; 2], along: [f64; 2]) {
        let across = [along[1].abs(), along[0].abs()];
        let at =
            |way: f64, aside: f64| [0, 1].map(|axis| from[axis] + way * along[axis] + aside * across[axis]);
        self.line(vec![at(0.0, 0.0), at(RULER, 0.0)], 0.2, false);
        for millimetre in 0..=100_u32 {
            let way = f64::from(millimetre);
            let length = match millimetre {
                whole if whole.is_multiple_of(10) => 4.0,
                half if half.is_multiple_of(5) => 3.0,
                _ => 2.0,
            };
            self.line(vec![at(way, 0.0), at(way, length)], 0.12, false);
            if millimetre.is_multiple_of(50) {
                self.text(at(way + 0.5, 4.3), 2.4, &millimetre.to_string());
            }
        }
    }

    /// The names of lines A and B and of the white side, outside the white that the sensor sees.
    fn lines_named(&mut self, target: &TTarget, at: impl Fn([f64; 2]) -> [f64; 2]) {
        let patch = target.patch();
        let (far, half) = (patch[1][0], patch[0][1]);
        let side = target.white_side();
        // Where line A leaves the frame: at its far edge, or at its side.
        let [near_end, far_end] = target.line_a_ends();
        let slope = (far_end[1] - near_end[1]) / (far_end[0] - near_end[0]);
        let beside = half.copysign(slope);
        let (leaves, tick, label) = match far_end[1] + (far - far_end[0]) * slope {
            v if v.abs() <= half => ([far, v], [0.0, 4.0], [1.0, 1.5]),
            _ if beside > 0.0 => {
                ([far_end[0] + (beside - far_end[1]) / slope, beside], [-4.0, 0.0], [-13.0, 1.0])
            }
            _ => ([far_end[0] + (beside - far_end[1]) / slope, beside], [4.0, 0.0], [2.0, 1.0]),
        };
        let [x, y] = at(leaves);
        self.line(vec![[x, y], [x + tick[0], y + tick[1]]], 0.2, false);
        self.text([x + label[0], y + label[1]], SMALL, "line A");
        for (v, offset) in [(half, -13.0), (-half, 2.0)] {
            let [x, y] = at([target.line_b_distance, v]);
            self.line(vec![[x, y], [x + if v > 0.0 { -4.0 } else { 4.0 }, y]], 0.2, false);
            self.text([x + offset, y + 1.0], SMALL, "line B");
        }
        let [x, y] = at([far, side * half]);
        let x = if side > 0.0 { x } else { x - 40.0 };
        self.text([x, y + 1.5], SMALL, "white side: begin over it");
    }

    /// The cross on the waist's axis, and line A from there.
    fn axis(&mut self, target: &TTarget, [x, y]: [f64; 2], at: impl Fn([f64; 2]) -> [f64; 2]) {
        for (dx, dy) in [(6.0, 0.0), (0.0, 6.0)] {
            self.line(vec![[x - dx, y - dy], [x + dx, y + dy]], 0.2, false);
        }
        self.text([x + 7.0, y - 1.0], SMALL, "waist's axis");
        let [near, _] = target.line_a_ends();
        let ends_at = target.patch()[0][0] / near[0];
        let begins_at = 8.0 / near[0];
        let part = |share: f64| at([near[0] * share, near[1] * share]);
        if ends_at > begins_at {
            self.line(vec![part(begins_at), part(ends_at)], 0.15, true);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn target(distance: f64) -> TTarget {
        TTarget {
            line_a: 0.3,
            line_b_distance: distance,
            line_b_offset: 8_f64.to_radians(),
            head_depth: 25.0,
            head_width: 120.0,
            body_radius: distance + 70.0,
            body_angle: 12_f64.to_radians(),
            margin: 20.0,
        }
    }

    fn black(page: &Page) -> Vec<&Vec<[f64; 2]>> {
        let areas = page.marks.iter();
        areas.filter_map(|mark| if let Mark::Black(points) = mark { Some(points) } else { None }).collect()
    }

    #[test]
    fn the_head_lies_its_distance_from_the_cross_on_the_waists_axis() {
        let page = Page::of("bench", &target(140.0), [210.0, 297.0]).expect("it fits");
        let cross = page.marks.iter().find_map(|mark| match mark {
            Mark::Text { at, text, .. } if text == "waist's axis" => Some([at[0] - 7.0, at[1] + 1.0]),
            _ => None,
        });
        let cross = cross.expect("A4 has room for the axis");
        let line_b = black(&page)[0].iter().map(|point| point[1]).fold(f64::NEG_INFINITY, f64::max);
        assert!((line_b - cross[1] - 140.0).abs() < 1e-9);
        // Line A runs through the cross.
        let body = black(&page)[1];
        let [first, last] = [body[0], *body.last().expect("points")];
        let turn =
            (first[0] - cross[0]) * (last[1] - cross[1]) - (first[1] - cross[1]) * (last[0] - cross[0]);
        assert!(turn.abs() < 1e-6, "{turn}");
    }

    #[test]
    fn everything_stays_on_the_paper_and_what_does_not_fit_is_refused() {
        for (distance, size) in [(140.0, [210.0, 297.0]), (140.0, [215.9, 279.4]), (300.0, [297.0, 420.0])] {
            let page = Page::of("bench", &target(distance), size).expect("it fits");
            for mark in &page.marks {
                let points = match mark {
                    Mark::Black(points) | Mark::Line { points, .. } => points.clone(),
                    Mark::Text { at, .. } => vec![*at],
                };
                for [x, y] in points {
                    assert!(
                        (0.0..=size[0]).contains(&x) && (0.0..=size[1]).contains(&y),
                        "{x} {y} on {size:?}"
                    );
                }
            }
        }
        let wide = TTarget { head_width: 300.0, ..target(140.0) };
        for target in [wide, target(300.0)] {
            assert!(matches!(Page::of("bench", &target, [210.0, 297.0]), Err(PageError::TooLarge { .. })));
        }
    }
}
