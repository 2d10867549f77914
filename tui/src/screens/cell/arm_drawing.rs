//! The arm seen from the side: its links over the table, drawn from the reported joints and the arm's own lengths, with
//! the positions where searches have found what they looked for.

use plumb_cell::event::NamedValue;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line as TextLine;
use ratatui::widgets::Paragraph;
use ratatui::widgets::canvas::{Canvas, Circle, Context, Line, Points};

use super::{ArmShape, CellState};
use crate::screens::theme::Theme;

/// A point in the vertical plane through the arm: distance from the waist's axis and height over the table, mm.
type PlanePoint = (f64, f64);

/// The points along an arm, turned into the vertical plane through its tip.
fn in_plane(shape: &ArmShape, joints: &[NamedValue]) -> Option<Vec<PlanePoint>> {
    let points = shape.points(joints)?;
    let is_out = |point: &&[f64; 3]| point[0].hypot(point[1]) > 1.0;
    let tip = points.iter().rev().find(is_out).copied().unwrap_or([1.0, 0.0, 0.0]);
    let (sin, cos) = tip[1].atan2(tip[0]).sin_cos();
    Some(points.iter().map(|point| (point[0] * cos + point[1] * sin, point[2])).collect())
}

/// Draws the first robot of the cell from the side; says what is missing where it cannot.
pub(crate) fn side_view(cell: &CellState, theme: &Theme, frame: &mut Frame, area: Rect) {
    let Some(shape) = &cell.shape else {
        return draw_text(
            "The lengths of this arm are not known: the cell names no model file for it.",
            theme,
            frame,
            area,
        );
    };
    let Some(robot) =
        cell.devices.iter().find(|device| device.name == shape.device && !device.joints.is_empty())
    else {
        return draw_text("The arm has not yet reported its position.", theme, frame, area);
    };
    let Some(points) = in_plane(shape, &robot.joints) else {
        return draw_text("The reported joints do not fit the arm's model file.", theme, frame, area);
    };
    let triggers: Vec<PlanePoint> =
        cell.triggers.iter().filter_map(|joints| in_plane(shape, joints)?.last().copied()).collect();
    let reach: f64 = points.windows(2).map(|pair| (pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1)).sum();
    let scene = Scene::around(reach, shape.table(), &points, area);
    let canvas = Canvas::default()
        .marker(Marker::Braille)
        .x_bounds(scene.x)
        .y_bounds(scene.y)
        .paint(|context| paint(context, &scene, shape, &points, &triggers, theme));
    frame.render_widget(canvas, area);
}

/// Says why nothing is drawn.
pub(super) fn draw_text(text: &str, theme: &Theme, frame: &mut Frame, area: Rect) {
    let line = Paragraph::new(TextLine::styled(text.to_owned(), theme.faint));
    frame.render_widget(line.wrap(ratatui::widgets::Wrap { trim: true }), area);
}

/// The part of the plane that is shown, at the same scale both ways.
struct Scene {
    x: [f64; 2],
    y: [f64; 2],
    /// Size of one Braille dot, mm.
    dot: f64,
}

impl Scene {
    /// How wide so many letters are, mm: a letter is two dots wide.
    fn columns(&self, letters: usize) -> f64 {
        2.0 * self.dot * letters as f64
    }

    /// Shows the table and what an arm of this reach usually has in front of its base, and more, in large steps, where the arm is
    /// elsewhere: so it is steady while the arm moves, and nothing of the arm is cut off.
    fn around(reach: f64, table: f64, points: &[PlanePoint], area: Rect) -> Self {
        let (across, up) = (f64::from(area.width.max(1)) * 2.0, f64::from(area.height.max(1)) * 4.0);
        let below = table - 0.07 * reach;
        let (wide, high) = (0.72 * reach, 0.62 * reach);
        let step = (0.25 * reach).max(1.0);
        let [left, right] = more([-0.12 * reach, 0.6 * reach], points.iter().map(|point| point.0), step);
        let [down, above] = more([below, below + high], points.iter().map(|point| point.1), step);
        let (wide, high) = (wide + left + right, high + down + above);
        let dot = (wide / across).max(high / up).max(1e-9);
        let (left, low) = (-0.12 * reach - left - 0.5 * (dot * across - wide), below - down);
        Self { x: [left, left + dot * across], y: [low, low + dot * up], dot }
    }
}

/// By how much a range has to be longer at its beginning and at its end to hold all of `values`: whole steps.
fn more([low, high]: [f64; 2], values: impl Iterator<Item = f64>, step: f64) -> [f64; 2] {
    values.fold([0.0, 0.0], |[before, behind], value| {
        let steps = |short: f64| (short / step).ceil().max(0.0) * step;
        [steps(low - value).max(before), steps(value - high).max(behind)]
    })
}

fn paint(
    context: &mut Context,
    scene: &Scene,
    shape: &ArmShape,
    points: &[PlanePoint],
    triggers: &[PlanePoint],
    theme: &Theme,
) {
    let (ground, machine, measured) = (colour(theme.ground), colour(theme.machine), colour(theme.measured));
    let table = shape.table();
    context.draw(&Line { x1: scene.x[0], y1: table, x2: scene.x[1], y2: table, color: ground });
    for (name, distance) in &shape.marks {
        for lift in [0.0, -1.0, -2.0] {
            let y = lift * scene.dot;
            context.draw(&Line {
                x1: distance - (14.0 * scene.dot).min(45.0),
                y1: y,
                x2: *distance,
                y2: y,
                color: measured,
            });
        }
        // Inside the picture, also where the edge lies at its right end.
        let last = scene.x[1] - scene.columns(name.chars().count());
        let at = distance.min(last).max(scene.x[0]);
        context.print(at, scene.y[0], TextLine::styled(name.clone(), theme.measured));
    }
    context.layer();
    let bad = colour(theme.bad);
    for pair in points.windows(2) {
        // What is out of bounds by the zeros believed is drawn as the fault it would be.
        let color = if shape.is_kept_out(pair[1].1) { bad } else { machine };
        thick(context, pair[0], pair[1], scene.dot, color);
    }
    for point in points {
        context.draw(&Circle { x: point.0, y: point.1, radius: 1.6 * scene.dot, color: machine });
    }
    context.layer();
    let crosses: Vec<PlanePoint> = triggers.iter().flat_map(|point| cross(*point, scene.dot)).collect();
    context.draw(&Points { coords: &crosses, color: measured });
    if let Some(tip) = points.last() {
        let style = if shape.is_kept_out(tip.1) { theme.bad } else { theme.machine };
        let texts = tip_texts(*tip);
        let fits = |text: &&String| scene.columns(text.chars().count()) <= scene.x[1] - scene.x[0];
        if let Some(text) = texts.iter().find(fits) {
            context.print(scene.x[0], scene.y[1], TextLine::styled(text.clone(), style));
        }
    }
}

/// Where the tip is, in words: the longest first, of which the first that fits is shown whole.
fn tip_texts((out, up): PlanePoint) -> [String; 3] {
    [
        format!(" tip {out:.1} mm out, {up:.1} mm up"),
        format!(" tip {out:.0} mm out, {up:.0} up"),
        format!(" {out:.0}, {up:.0} mm"),
    ]
}

/// A line two dots wide.
fn thick(context: &mut Context, from: PlanePoint, to: PlanePoint, dot: f64, color: Color) {
    let (along, up) = (to.0 - from.0, to.1 - from.1);
    let (side_x, side_y) = if along.abs() > up.abs() { (0.0, dot) } else { (dot, 0.0) };
    context.draw(&Line { x1: from.0, y1: from.1, x2: to.0, y2: to.1, color });
    context.draw(&Line {
        x1: from.0 + side_x,
        y1: from.1 + side_y,
        x2: to.0 + side_x,
        y2: to.1 + side_y,
        color,
    });
}

fn cross(at: PlanePoint, dot: f64) -> [PlanePoint; 5] {
    let arm = 1.0 * dot;
    [
        at,
        (at.0 - arm, at.1 - arm),
        (at.0 - arm, at.1 + arm),
        (at.0 + arm, at.1 - arm),
        (at.0 + arm, at.1 + arm),
    ]
}

fn colour(style: Style) -> Color {
    style.fg.unwrap_or(Color::Reset)
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Rect = Rect { x: 0, y: 0, width: 60, height: 12 };

    fn holds(scene: &Scene, points: &[PlanePoint]) -> bool {
        points.iter().all(|(out, up)| {
            (scene.x[0]..=scene.x[1]).contains(out) && (scene.y[0]..=scene.y[1]).contains(up)
        })
    }

    #[test]
    fn an_arm_upright_hanging_down_or_behind_its_base_is_shown_whole() {
        let upright = [(0.0, 0.0), (0.0, 500.0), (120.0, 1000.0)];
        let hanging = [(0.0, 0.0), (430.0, 0.0), (430.0, -490.0)];
        let behind = [(0.0, 0.0), (-400.0, 100.0), (-900.0, 100.0)];
        for (points, table) in [(upright, 0.0), (hanging, -545.0), (hanging, 0.0), (behind, 0.0)] {
            let scene = Scene::around(1000.0, table, &points, AREA);
            assert!(holds(&scene, &points), "{points:?}: x {:?}, y {:?}", scene.x, scene.y);
            assert!((scene.y[0]..scene.y[1]).contains(&table), "the table is seen: {:?}", scene.y);
        }
    }

    #[test]
    fn the_picture_is_steady_while_an_arm_moves_in_front_of_its_base() {
        let scene = |out: f64, up: f64| Scene::around(1000.0, 0.0, &[(0.0, 0.0), (out, up)], AREA);
        let (one, other) = (scene(300.0, 20.0), scene(580.0, 500.0));
        assert_eq!((one.x, one.y), (other.x, other.y));
    }
}
