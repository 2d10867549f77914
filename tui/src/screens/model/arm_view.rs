//! What is left as whiskers where the target stood, on a drawing of the arm: each whisker points to where the target was
//! measured, many times enlarged.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::symbols::Marker;
use ratatui::text::Span;
use ratatui::widgets::canvas::{Canvas, Circle, Line};

use super::plane::{plane_name, span};
use super::residuals::Residuals;
use crate::screens::pane::fitted;
use crate::screens::theme::Theme;

/// Whiskers drawn at most; of more, every n-th.
const MOST_WHISKERS: usize = 150;

/// Length of a typical whisker, dots of the drawing.
const TYPICAL_LENGTH: f64 = 7.0;

/// Draws the arm and the whiskers in a plane: two of the axes x, y, z.
pub(crate) fn view(
    residuals: &Residuals,
    arm_mm: &[[f64; 3]],
    plane: [usize; 2],
    ink: Color,
    theme: &Theme,
    frame: &mut Frame,
    area: Rect,
) {
    if area.height < 4 || area.width < 8 {
        return;
    }
    let [first, second] = plane;
    let in_plane = |point: &[f64; 3]| finite(*point.get(first)?, *point.get(second)?);
    let arm: Vec<(f64, f64)> = arm_mm.iter().filter_map(&in_plane).collect();
    let whiskers = whiskers(residuals, &in_plane);
    let points = || arm.iter().chain(whiskers.iter().map(|(point, _)| point));
    let (Some((left, right)), Some((below, above))) =
        (span(points().map(|point| point.0)), span(points().map(|point| point.1)))
    else {
        return;
    };
    let head = Rect { height: 1, ..area };
    let body = Rect { y: area.y + 1, height: area.height - 1, ..area };
    let (across, up) = (2.0 * f64::from(body.width), 4.0 * f64::from(body.height));
    // One scale both ways, with some air.
    let dot = 1.1 * ((right - left) / across).max((above - below) / up).max(1e-9);
    let (middle_x, middle_y) = (f64::midpoint(left, right), f64::midpoint(below, above));
    let times = magnification(TYPICAL_LENGTH * dot / residuals.typical_mm().max(1e-12));
    let machine = theme.machine.fg.unwrap_or(Color::Reset);
    let canvas = Canvas::default()
        .marker(Marker::Braille)
        .x_bounds([middle_x - 0.5 * dot * across, middle_x + 0.5 * dot * across])
        .y_bounds([middle_y - 0.5 * dot * up, middle_y + 0.5 * dot * up])
        .paint(|context| {
            for ((x, y), (across, up)) in &whiskers {
                // A gross error does not strike through the whole drawing.
                let most = 6.0 * TYPICAL_LENGTH * dot;
                let length = (times * across.hypot(*up)).max(1e-12);
                let times = times * (most / length).min(1.0);
                context.draw(&Line {
                    x1: *x,
                    y1: *y,
                    x2: x + times * across,
                    y2: y + times * up,
                    color: ink,
                });
            }
            context.layer();
            for (from, to) in arm.iter().zip(arm.iter().skip(1)) {
                context.draw(&Line { x1: from.0, y1: from.1, x2: to.0, y2: to.1, color: machine });
            }
            for (x, y) in &arm {
                context.draw(&Circle { x: *x, y: *y, radius: 1.2 * dot, color: machine });
            }
        });
    frame.render_widget(canvas, body);
    let title = format!("the arm, errors \u{d7}{times:.0}, {}", plane_name(plane));
    frame.render_widget(Span::styled(fitted(&title, usize::from(area.width)), theme.heading), head);
}

/// Two coordinates that can be drawn.
fn finite(across: f64, up: f64) -> Option<(f64, f64)> {
    (across.is_finite() && up.is_finite()).then_some((across, up))
}

/// Where errors sit and which way they point, in a plane; of many every n-th.
fn whiskers(
    residuals: &Residuals,
    in_plane: &impl Fn(&[f64; 3]) -> Option<(f64, f64)>,
) -> Vec<((f64, f64), (f64, f64))> {
    let every = residuals.rows.len().div_ceil(MOST_WHISKERS).max(1);
    let rows = residuals.rows.iter().step_by(every);
    rows.filter_map(|row| Some((in_plane(&row.point_mm)?, in_plane(&row.vector_mm)?))).collect()
}

/// The round magnification below `wanted`: 1, 2 or 5 times a power of ten.
fn magnification(wanted: f64) -> f64 {
    if !wanted.is_finite() || wanted <= 0.0 {
        return 1.0;
    }
    let power = 10_f64.powf(wanted.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|step| step * power).find(|step| *step <= wanted).unwrap_or(power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn magnifications_are_round() {
        assert_eq!(magnification(7.3), 5.0);
        assert_eq!(magnification(430.0), 200.0);
        assert!((magnification(0.15) - 0.1).abs() < 1e-12);
        assert_eq!(magnification(f64::NAN), 1.0);
    }
}
