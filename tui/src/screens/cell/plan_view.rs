//! The arm seen from above: its links over the T target, the hand over or beside the white quadrant. Drawn from the joints the program believes.

use plumb_cell::event::NamedValue;
use plumb_cell::workcell::{TTarget, Under};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line as TextLine;
use ratatui::widgets::canvas::{Canvas, Circle, Context, Line, Points};

use super::CellState;
use super::arm_drawing::draw_text;
use crate::screens::theme::Theme;

/// Where the hand is, over the target and the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HandPosition {
    /// In the frame of the cell, mm.
    point: [f64; 3],
    /// Over the target.
    over: plumb_cell::workcell::OverTarget,
    /// What the operator is asked to find lies to the left of line A (1), or to the right (-1).
    white_side: f64,
}

impl HandPosition {
    /// Where the hand of this robot is over the cell's target; none where either is not known.
    pub(crate) fn of(cell: &CellState, device: &str) -> Option<Self> {
        let (shape, target) = (cell.shape.as_ref()?, cell.target.as_ref()?);
        let joints = cell.joints_of(&shape.device).filter(|_| shape.device == device)?;
        let point = shape.points(joints)?.last().copied()?;
        Some(Self { point, over: target.over([point[0], point[1]]), white_side: target.white_side() })
    }

    /// The same in one sentence.
    pub(crate) fn in_words(&self) -> String {
        let side = |value: f64, positive: &str, negative: &str| {
            format!("{:.0} mm {}", value.abs(), if value >= 0.0 { positive } else { negative })
        };
        format!(
            "hand {}, {}, {}",
            side(self.over.beyond_b, "beyond B", "short of B"),
            side(self.over.left_of_a, "left of A", "right of A"),
            side(self.point[2], "over the table", "BELOW the table"),
        )
    }

    /// Whether it is over the white quadrant; if not, where that lies.
    pub(crate) fn advice(&self) -> Result<&'static str, String> {
        match self.over.under {
            Under::WhiteQuadrant => Ok("over the white quadrant"),
            Under::Black | Under::Beside => {
                let side = if self.white_side > 0.0 { "left" } else { "right" };
                let wrong_side = self.over.left_of_a * self.white_side <= 0.0;
                let mut ways = Vec::new();
                if wrong_side {
                    ways.push(format!(
                        "to the {side} of line A (waist {})",
                        if self.white_side > 0.0 { "+" } else { "-" }
                    ));
                }
                if self.over.beyond_b <= 0.0 {
                    ways.push("out beyond line B".to_owned());
                }
                Err(format!("not over the white quadrant: go {}", ways.join(" and ")))
            }
        }
    }

    /// Whether it is below the table, by the zeros believed.
    pub(crate) fn is_below_the_table(&self) -> bool {
        self.point[2] < 0.0
    }
}

/// Draws the first robot of the cell from above.
pub(crate) fn plan_view(cell: &CellState, theme: &Theme, frame: &mut Frame, area: Rect) {
    let drawn = cell.shape.as_ref().and_then(|shape| {
        let joints: &[NamedValue] = cell.joints_of(&shape.device)?;
        Some((shape, shape.points(joints)?))
    });
    let Some((shape, points)) = drawn else {
        return draw_text(
            "The arm has not yet reported its position, or its lengths are not known.",
            theme,
            frame,
            area,
        );
    };
    let reach: f64 =
        points.windows(2).map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1])).sum();
    let hand = points.last().copied().unwrap_or_default();
    let hand_kept_out = shape.is_kept_out(hand[2]);
    let scene = Scene::around(cell.target.as_ref(), &points, reach, area);
    let canvas =
        Canvas::default().marker(Marker::Braille).x_bounds(scene.x).y_bounds(scene.y).paint(|context| {
            target(context, &scene, cell.target.as_ref(), theme);
            arm(context, &scene, &points, hand_kept_out, theme);
        });
    frame.render_widget(canvas, area);
}

/// What is shown, at one scale both ways, turned so that what is away from the arm is up. `x` runs to the right as the arm's own right hand does.
struct Scene {
    x: [f64; 2],
    y: [f64; 2],
    /// Size of one Braille dot, mm.
    dot: f64,
    /// The direction, in the frame of the cell, that is up, rad.
    up: f64,
}

impl Scene {
    /// Shows the axis, the target and the whole arm, with some room around.
    fn around(target: Option<&TTarget>, points: &[[f64; 3]], reach: f64, area: Rect) -> Self {
        let up = target.map_or(0.0, |target| target.line_a + target.line_b_offset);
        let mut scene = Self { x: [0.0, 0.0], y: [0.0, 0.0], dot: 1.0, up };
        let seen = points.iter().map(|point| scene.turned([point[0], point[1]]));
        let mut corners: Vec<[f64; 2]> = std::iter::once([0.0, 0.0]).chain(seen).collect();
        match target {
            Some(target) => {
                corners.extend(target.patch().into_iter().map(|point| scene.turned(target.in_cell(point))))
            }
            None => corners.extend([[-reach, 0.0], [reach, reach]]),
        }
        let range = |axis: usize| {
            let values = corners.iter().filter_map(|corner| corner.get(axis).copied());
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| {
                (least.min(value), most.max(value))
            })
        };
        let ((left, right), (low, high)) = (range(0), range(1));
        let (across, along) = (f64::from(area.width.max(1)) * 2.0, f64::from(area.height.max(1)) * 4.0);
        let margin = 1.08;
        scene.dot = (margin * (right - left) / across).max(margin * (high - low) / along).max(1e-9);
        let around =
            |middle: f64, dots: f64| [middle - scene.dot * dots / 2.0, middle + scene.dot * dots / 2.0];
        scene.x = around((left + right) / 2.0, across);
        scene.y = around((low + high) / 2.0, along);
        scene
    }

    /// A point of the cell as it is drawn: what lies to the arm's left is at the left.
    fn turned(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.up.sin_cos();
        [x * sin - y * cos, x * cos + y * sin]
    }
}

/// The T, its white background, and the names of its edges; nothing where there is none.
fn target(context: &mut Context, scene: &Scene, target: Option<&TTarget>, theme: &Theme) {
    let (ground, measured) = (colour(theme.ground), colour(theme.measured));
    if let Some(target) = target {
        let drawn = |shape: Vec<[f64; 2]>| {
            shape.into_iter().map(|point| scene.turned(target.in_cell(point))).collect::<Vec<_>>()
        };
        outline(context, &drawn(target.patch()), ground);
        let black = dots(scene, |point| target.over(point).under == Under::Black);
        context.draw(&Points { coords: &black, color: ground });
        context.layer();
        let edges = [
            ("A", target.line_a_ends(), [target.body_radius + target.margin / 2.0, 0.0]),
            (
                "B",
                [
                    [target.line_b_distance, target.head_width / 2.0],
                    [target.line_b_distance, -target.head_width / 2.0],
                ],
                [target.line_b_distance, target.white_side() * (target.head_width + target.margin) / 2.0],
            ),
        ];
        for (name, ends, label) in edges {
            let [from, to] = ends.map(|end| scene.turned(target.in_cell(end)));
            context.draw(&Line { x1: from[0], y1: from[1], x2: to[0], y2: to[1], color: measured });
            let at = if name == "A" { extended(target.line_a_ends(), target.margin / 2.0) } else { label };
            let [x, y] = scene.turned(target.in_cell(at));
            context.print(x, y, TextLine::styled(name, theme.measured));
        }
        let white = [
            (target.line_b_distance + target.body_radius) / 2.0 + target.margin,
            target.white_side() * target.head_width / 4.0 + 12.0 * scene.dot,
        ];
        let [x, y] = scene.turned(target.in_cell(white));
        context.print(x, y, TextLine::styled("white", theme.text));
        context.layer();
    }
}

/// The links from above, and the hand: a circle with a cross, in the colour of a fault where it is kept out.
fn arm(context: &mut Context, scene: &Scene, points: &[[f64; 3]], hand_kept_out: bool, theme: &Theme) {
    let machine = colour(theme.machine);
    let flat: Vec<[f64; 2]> = points.iter().map(|point| scene.turned([point[0], point[1]])).collect();
    for pair in flat.windows(2) {
        let [from, to] = pair else { continue };
        context.draw(&Line { x1: from[0], y1: from[1], x2: to[0], y2: to[1], color: machine });
    }
    if let Some(base) = flat.first() {
        context.draw(&Circle { x: base[0], y: base[1], radius: 3.0 * scene.dot, color: machine });
    }
    let color = if hand_kept_out { colour(theme.bad) } else { machine };
    if let Some([x, y]) = flat.last().copied() {
        context.layer();
        context.draw(&Circle { x, y, radius: 3.5 * scene.dot, color });
        let arm = 6.0 * scene.dot;
        context.draw(&Line { x1: x - arm, y1: y, x2: x + arm, y2: y, color });
        context.draw(&Line { x1: x, y1: y - arm, x2: x, y2: y + arm, color });
    }
}

/// The point so far beyond the second end of a line.
fn extended([from, to]: [[f64; 2]; 2], by: f64) -> [f64; 2] {
    let length = (to[0] - from[0]).hypot(to[1] - from[1]).max(1e-9);
    [0, 1].map(|axis| to[axis] + (to[axis] - from[axis]) * by / length)
}

fn outline(context: &mut Context, corners: &[[f64; 2]], color: Color) {
    for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        context.draw(&Line { x1: from[0], y1: from[1], x2: to[0], y2: to[1], color });
    }
}

/// Every second dot of the scene, in a chequer, whose position in the cell is as wanted.
fn dots(scene: &Scene, requested: impl Fn([f64; 2]) -> bool) -> Vec<(f64, f64)> {
    let count = |range: [f64; 2]| ((range[1] - range[0]) / scene.dot).round().clamp(0.0, 2000.0) as usize;
    let (sin, cos) = scene.up.sin_cos();
    let mut found = Vec::new();
    for row in 0..count(scene.y) {
        for column in 0..count(scene.x) {
            let (x, y) =
                (scene.x[0] + (column as f64 + 0.5) * scene.dot, scene.y[0] + (row as f64 + 0.5) * scene.dot);
            if (row + column).is_multiple_of(2) && requested([x * sin + y * cos, y * sin - x * cos]) {
                found.push((x, y));
            }
        }
    }
    found
}

fn colour(style: Style) -> Color {
    style.fg.unwrap_or(Color::Reset)
}
