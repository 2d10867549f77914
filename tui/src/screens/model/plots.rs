//! The residuals in fixed small plots: against each joint along that joint's own motion, as a bull's eye with the floor's
//! ring, as a histogram, against moments of gravity, sides of approach, order and every other condition. All share one
//! scale tied to the noise floor; what lies outside is drawn on the rim and counted, so that one gross error squashes
//! nothing.

use plumb_diagnosis::laboratory::Series;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line as TextLine, Span};
use ratatui::widgets::canvas::{Canvas, Circle, Context, Line, Points};

use super::arm_view;
use super::plane::{plane_name, span};
use super::residuals::{PLANES, Residuals, Subject, is_of_size, varies};
use super::state::ModelState;
use crate::screens::pane::{self, fitted};
use crate::screens::theme::Theme;

/// The least a plot takes, in columns and rows.
const SMALLEST: (u16, u16) = (26, 5);

/// Points to be drawn, mm upwards.
type Dots = Vec<(f64, f64)>;

/// One of the plots.
#[derive(Clone, Copy)]
enum Plot<'a> {
    /// Errors against something.
    Against(&'a Series),
    /// Errors in a plane, one axis over the other.
    BullsEye,
    /// How often which size.
    Histogram,
}

/// What all plots share.
struct Sheet<'a> {
    residuals: &'a Residuals,
    plane: [usize; 2],
    /// Half the height of a plot, mm.
    half: f64,
    floor: Option<f64>,
    inks: Inks,
}

/// Colours of what a plot shows.
#[derive(Clone, Copy)]
struct Inks {
    points: Color,
    floor: Color,
    axis: Color,
    outside: Color,
}

/// What the title of a plot tells of its drawing.
struct Drawn {
    title: String,
    /// Errors beyond the scale.
    outside: usize,
}

/// Rows of the pane from which the arm with its whiskers gets a third of them.
const ROOM_FOR_THE_ARM: u16 = 18;

/// Draws the arm with its whiskers, and below it as many plots as there is room for.
pub(crate) fn view(model: &ModelState, theme: &Theme, frame: &mut Frame, area: Rect) {
    let title = format!("Residuals \u{b1}{:.3} mm, {}", model.half_height_mm(), times(model));
    let title = fitted(&title, usize::from(area.width.saturating_sub(4)));
    let inner = pane::open(frame, area, theme, &title, false);
    let Some(residuals) = shown(model) else { return };
    let colour = |style: Style| style.fg.unwrap_or(Color::Reset);
    let sheet = Sheet {
        residuals,
        plane: PLANES.get(model.plane).copied().unwrap_or([0, 1]),
        half: model.half_height_mm(),
        floor: model.floor_mm(),
        inks: Inks {
            points: colour(if model.preview.is_some() { theme.preview } else { theme.measured }),
            floor: colour(theme.good),
            axis: colour(theme.faint),
            outside: colour(theme.bad),
        },
    };
    let drawn = if inner.height >= ROOM_FOR_THE_ARM { inner.height * 2 / 5 } else { 0 };
    let [arm, inner] = Layout::vertical([Constraint::Length(drawn), Constraint::Fill(1)]).areas(inner);
    let arm_mm = model.standing.as_ref().map_or(&[][..], |standing| standing.arm_mm.as_slice());
    arm_view::view(residuals, arm_mm, sheet.plane, sheet.inks.points, theme, frame, arm);
    let plots = order(residuals);
    let cells = grid(inner, plots.len());
    let first = model.plots_scrolled.min(plots.len().saturating_sub(cells.len()));
    for (plot, cell) in plots.into_iter().skip(first).zip(cells) {
        draw(plot, &sheet, theme, frame, cell);
    }
}

/// The residuals of the preview while there is one, else of the model as it is.
fn shown(model: &ModelState) -> Option<&Residuals> {
    match &model.preview {
        Some(preview) => Some(&preview.residuals),
        None => model.standing.as_ref().map(|standing| &standing.residuals),
    }
}

fn times(model: &ModelState) -> String {
    let times = model.half_height_mm() / model.unit_mm();
    match model.floor_mm() {
        Some(_) => format!("{times:.0} \u{d7} noise"),
        None => format!("{times:.0} typical errors"),
    }
}

/// The plots in the order in which they are shown: joints, bull's eye and histogram, moments of gravity, sides of approach,
/// then order, time, temperature and the rest.
fn order(residuals: &Residuals) -> Vec<Plot<'_>> {
    let mut series: Vec<&Series> =
        residuals.series.iter().filter(|series| varies(series, &residuals.series)).collect();
    series.sort_by_key(|series| Subject::of(series));
    let (joints, others): (Vec<&Series>, Vec<&Series>) =
        series.into_iter().partition(|series| Subject::of(series) == Subject::Joint);
    let mut plots: Vec<Plot> = joints.into_iter().map(Plot::Against).collect();
    if residuals.rows.iter().any(|row| row.vector_mm != [0.0; 3]) {
        plots.push(Plot::BullsEye);
    }
    plots.push(Plot::Histogram);
    plots.extend(others.into_iter().map(Plot::Against));
    plots
}

/// Divides the room into as many cells as are useful.
fn grid(area: Rect, plots: usize) -> Vec<Rect> {
    let columns = (area.width / SMALLEST.0).clamp(1, 4);
    let wanted = u16::try_from(plots.div_ceil(usize::from(columns))).unwrap_or(u16::MAX).max(1);
    let rows = (area.height / SMALLEST.1).clamp(1, wanted);
    let lines = Layout::vertical((0..rows).map(|_| Constraint::Fill(1))).split(area);
    let across = Layout::horizontal((0..columns).map(|_| Constraint::Fill(1))).spacing(1);
    lines.iter().flat_map(|line| across.split(*line).to_vec()).collect()
}

fn draw(plot: Plot, sheet: &Sheet, theme: &Theme, frame: &mut Frame, area: Rect) {
    if area.height < 2 || area.width < 4 {
        return;
    }
    let head = Rect { height: 1, ..area };
    let body = Rect { y: area.y + 1, height: area.height - 1, ..area };
    let drawn = match plot {
        Plot::Against(series) => against(series, sheet, frame, body),
        Plot::BullsEye => bulls_eye(sheet, frame, body),
        Plot::Histogram => histogram(sheet, frame, body),
    };
    let count = if drawn.outside > 0 { format!("{} off", drawn.outside) } else { String::new() };
    let room = usize::from(area.width).saturating_sub(count.len() + 1);
    frame.render_widget(Span::styled(fitted(&drawn.title, room), theme.heading), head);
    frame.render_widget(TextLine::from(Span::styled(count, theme.bad)).right_aligned(), head);
}

/// Parts points into those inside the height of a plot and those on its rim.
fn parted(points: Dots, wide: f64, low: f64, high: f64) -> (Dots, Dots) {
    let inside = |point: &(f64, f64)| point.0.abs() <= wide && (low..=high).contains(&point.1);
    let (inside, outside): (Vec<_>, Vec<_>) = points.into_iter().partition(inside);
    let rim =
        outside.into_iter().map(|point| (point.0.clamp(-wide, wide), point.1.clamp(low, high))).collect();
    (inside, rim)
}

fn against(series: &Series, sheet: &Sheet, frame: &mut Frame, area: Rect) -> Drawn {
    let points: Vec<(f64, f64)> = series
        .points
        .iter()
        .map(|(against, error, _)| (*against, *error))
        .filter(|point| point.0.is_finite() && point.1.is_finite())
        .collect();
    let Some((left, right)) = span(points.iter().map(|point| point.0)) else {
        return Drawn { title: series.against.clone(), outside: 0 };
    };
    let [low, high] = if is_of_size(series) { [0.0, sheet.half] } else { [-sheet.half, sheet.half] };
    let (inside, rim) = parted(points, f64::INFINITY, low, high);
    let margin = 0.02 * (right - left).max(1e-9);
    let x = [left - margin, right + margin];
    let canvas =
        Canvas::default().marker(Marker::Braille).x_bounds(x).y_bounds([low, high]).paint(|context| {
            floor_lines(context, sheet, x);
            context.draw(&Points { coords: &inside, color: sheet.inks.points });
            context.layer();
            context.draw(&Points { coords: &rim, color: sheet.inks.outside });
        });
    frame.render_widget(canvas, area);
    Drawn {
        title: format!("{} {} {}", series.against, from_to(left, right), series.unit),
        outside: rim.len(),
    }
}

/// The ends of an axis with the digits that tell them apart.
fn from_to(left: f64, right: f64) -> String {
    // Between 0 and 4.
    let decimals = (1.0 - (right - left).abs().max(1e-12).log10().floor()).clamp(0.0, 4.0) as usize;
    let decimals = if right - left >= 10.0 { 0 } else { decimals };
    // A negative nothing is nothing.
    let shown = |value: f64| if value.abs() < 1e-9 { 0.0 } else { value };
    format!("{:.decimals$}\u{2026}{:.decimals$}", shown(left), shown(right))
}

/// The line of no error, and the floor above and below it.
fn floor_lines(context: &mut Context, sheet: &Sheet, x: [f64; 2]) {
    context.draw(&Line { x1: x[0], y1: 0.0, x2: x[1], y2: 0.0, color: sheet.inks.axis });
    for y in sheet.floor.into_iter().flat_map(|floor| [-floor, floor]) {
        let dots: Vec<(f64, f64)> =
            (0..24).map(|dot| (x[0] + (x[1] - x[0]) * f64::from(dot) / 23.0, y)).collect();
        context.draw(&Points { coords: &dots, color: sheet.inks.floor });
    }
    context.layer();
}

fn bulls_eye(sheet: &Sheet, frame: &mut Frame, area: Rect) -> Drawn {
    let half = sheet.half;
    // One scale both ways: a Braille dot is about square, two across and four down to a cell.
    let wide = half * f64::from(area.width) / (2.0 * f64::from(area.height));
    let (inside, rim) = parted(sheet.residuals.in_plane(sheet.plane).collect(), wide, -half, half);
    let inks = sheet.inks;
    let canvas =
        Canvas::default().marker(Marker::Braille).x_bounds([-wide, wide]).y_bounds([-half, half]).paint(
            |context| {
                context.draw(&Line { x1: -wide, y1: 0.0, x2: wide, y2: 0.0, color: inks.axis });
                context.draw(&Line { x1: 0.0, y1: -half, x2: 0.0, y2: half, color: inks.axis });
                context.layer();
                context.draw(&Points { coords: &inside, color: inks.points });
                context.draw(&Points { coords: &rim, color: inks.outside });
                context.layer();
                if let Some(floor) = sheet.floor {
                    context.draw(&Circle { x: 0.0, y: 0.0, radius: 2.0 * floor, color: inks.floor });
                }
            },
        );
    frame.render_widget(canvas, area);
    Drawn { title: format!("error {}", plane_name(sheet.plane)), outside: rim.len() }
}

fn histogram(sheet: &Sheet, frame: &mut Frame, area: Rect) -> Drawn {
    let most_mm = sheet.half;
    let bins = usize::from(area.width) * 2;
    let mut counts = vec![0_u32; bins];
    let mut outside = 0;
    for row in &sheet.residuals.rows {
        let place = row.size_mm / most_mm * bins as f64;
        // A size is never negative; what is not finite fails the comparison.
        match counts.get_mut(place as usize) {
            Some(count) if place.is_finite() => *count += 1,
            _ => outside += 1,
        }
    }
    let most = f64::from(counts.iter().copied().max().unwrap_or(0).max(1));
    let canvas =
        Canvas::default().marker(Marker::Braille).x_bounds([0.0, most_mm]).y_bounds([0.0, most]).paint(
            |context| {
                for (bin, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
                    let x = (bin as f64 + 0.5) * most_mm / bins as f64;
                    context.draw(&Line {
                        x1: x,
                        y1: 0.0,
                        x2: x,
                        y2: f64::from(*count),
                        color: sheet.inks.points,
                    });
                }
                context.layer();
                if let Some(x) = sheet.floor {
                    context.draw(&Line { x1: x, y1: 0.0, x2: x, y2: most, color: sheet.inks.floor });
                }
            },
        );
    frame.render_widget(canvas, area);
    Drawn { title: format!("frequency, 0\u{2026}{most_mm:.2} mm"), outside }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_an_axis_are_told_apart() {
        assert_eq!(from_to(-150.2, 149.8), "-150\u{2026}150");
        assert_eq!(from_to(20.1, 23.4), "20.1\u{2026}23.4");
        assert_eq!(from_to(-1e-15, 0.31), "0.00\u{2026}0.31");
    }
}
