//! The residuals in fixed small plots: against each joint and condition, as a bull's eye with the floor's ring, as
//! whiskers over the work space, as a histogram. All share one height tied to the noise floor; what lies outside is drawn
//! on the rim and counted, so that one gross error squashes nothing.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line as TextLine;
use ratatui::widgets::canvas::{Canvas, Circle, Context, Line, Points};

use super::residuals::Residuals;
use super::state::ModelState;
use crate::screens::pane::{self, fitted};
use crate::screens::theme::Theme;

/// The least a plot takes.
const SMALLEST: (u16, u16) = (24, 5);
/// Whiskers drawn at most; of more, every n-th.
const MOST_WHISKERS: usize = 240;

/// One of the plots.
#[derive(Clone, Copy)]
enum Plot {
    /// Errors against an abscissa.
    Against(usize),
    /// Errors in the first direction against those in the second.
    BullsEye,
    /// Errors as whiskers where the target stood, seen from above.
    Whiskers,
    /// How often which error.
    Histogram,
}

/// Colours of what a plot shows.
#[derive(Clone, Copy)]
struct Inks {
    points: Color,
    floor: Color,
    axis: Color,
    outside: Color,
}

/// Draws as many plots as there is room for.
pub(crate) fn view(model: &ModelState, theme: &Theme, frame: &mut Frame, area: Rect) {
    let residuals = shown(model);
    let direction = residuals.and_then(|residuals| residuals.directions.get(model.direction));
    let scale = model.half_height_mm();
    let title = match direction {
        Some(direction) => format!("Residuals in {direction}, \u{b1}{scale:.3} mm {}", times(model)),
        None => "Residuals".to_owned(),
    };
    let inner =
        pane::open(frame, area, theme, &fitted(&title, usize::from(area.width.saturating_sub(4))), false);
    let Some(residuals) = residuals else { return };
    let plots = order(residuals);
    let cells = grid(inner, plots.len());
    let first = model.plots_scrolled.min(plots.len().saturating_sub(cells.len()));
    for (plot, cell) in plots.into_iter().skip(first).zip(cells) {
        draw(plot, residuals, model, theme, frame, cell);
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
    let floors = model.half_height_mm() / model.unit_mm();
    match model.standing.as_ref().and_then(|standing| standing.floor_mm) {
        Some(_) => format!("= {floors:.0} floors"),
        None => format!("= {floors:.0} typical errors"),
    }
}

/// The plots in the order in which they are shown: joints first, then bull's eye and whiskers, then everything else.
fn order(residuals: &Residuals) -> Vec<Plot> {
    let joints = residuals
        .against
        .iter()
        .take_while(|abscissa| abscissa.unit == "deg" || abscissa.unit == "mm")
        .count();
    let mut plots: Vec<Plot> = (0..joints).map(Plot::Against).collect();
    if residuals.directions.len() > 1 {
        plots.push(Plot::BullsEye);
    }
    if residuals.rows.iter().any(|row| row.position_mm.is_some()) {
        plots.push(Plot::Whiskers);
    }
    plots.push(Plot::Histogram);
    plots.extend((joints..residuals.against.len()).map(Plot::Against));
    plots
}

/// Divides the room into as many cells as are useful.
fn grid(area: Rect, plots: usize) -> Vec<Rect> {
    let columns = (area.width / SMALLEST.0).clamp(1, 3);
    let wanted = u16::try_from(plots.div_ceil(usize::from(columns))).unwrap_or(u16::MAX).max(1);
    let rows = (area.height / SMALLEST.1).clamp(1, wanted);
    let (width, height) = (area.width / columns, area.height / rows);
    (0..rows)
        .flat_map(|row| (0..columns).map(move |column| (row, column)))
        .map(|(row, column)| {
            let rect =
                Rect::new(area.x + column * width, area.y + row * height, width.saturating_sub(1), height);
            rect.intersection(area)
        })
        .collect()
}

fn draw(plot: Plot, residuals: &Residuals, model: &ModelState, theme: &Theme, frame: &mut Frame, area: Rect) {
    if area.height < 2 || area.width < 4 {
        return;
    }
    let colour = |style: Style| style.fg.unwrap_or(Color::Reset);
    let points = if model.preview.is_some() { theme.preview } else { theme.measured };
    let inks = Inks {
        points: colour(points),
        floor: colour(theme.good),
        axis: colour(theme.faint),
        outside: colour(theme.bad),
    };
    let head = Rect { height: 1, ..area };
    let body = Rect { y: area.y + 1, height: area.height - 1, ..area };
    let drawn = match plot {
        Plot::Against(abscissa) => against(abscissa, residuals, model, inks, frame, body),
        Plot::BullsEye => bulls_eye(residuals, model, inks, frame, body),
        Plot::Whiskers => whiskers(residuals, inks, frame, body),
        Plot::Histogram => histogram(residuals, model, inks, frame, body),
    };
    let count = if drawn.count > 0 { format!("{} off", drawn.count) } else { String::new() };
    let room = usize::from(area.width).saturating_sub(count.len() + 1);
    let title = fitted(&name(plot, residuals, drawn.range), room);
    frame.render_widget(TextLine::styled(title, theme.heading), head);
    frame.render_widget(TextLine::styled(count, theme.bad).right_aligned(), head);
}

/// What the title of a plot needs to know of its drawing.
#[derive(Default)]
struct Drawn {
    /// Errors beyond the scale.
    count: usize,
    /// What the abscissa spans, or the magnification.
    range: Option<(f64, f64)>,
}

fn name(plot: Plot, residuals: &Residuals, range: Option<(f64, f64)>) -> String {
    let axis = |place: usize| residuals.directions.get(place).map_or("", String::as_str);
    match (plot, range) {
        (Plot::Against(abscissa), Some((low, high))) => {
            residuals.against.get(abscissa).map_or_else(String::new, |what| {
                format!("{} {low:.0}\u{2026}{high:.0} {}", what.name, what.unit)
            })
        }
        (Plot::Against(abscissa), None) => {
            residuals.against.get(abscissa).map_or_else(String::new, |what| what.name.clone())
        }
        (Plot::BullsEye, _) => format!("{} over {}", axis(1), axis(0)),
        (Plot::Whiskers, Some((_, times))) => format!("from above, errors \u{d7}{times:.0}"),
        (Plot::Whiskers, None) => "from above".to_owned(),
        (Plot::Histogram, _) => "how often".to_owned(),
    }
}

fn against(
    abscissa: usize,
    residuals: &Residuals,
    model: &ModelState,
    inks: Inks,
    frame: &mut Frame,
    area: Rect,
) -> Drawn {
    let points = residuals.points(abscissa, model.direction);
    let Some((low, high)) = span(points.iter().map(|point| point.0)) else { return Drawn::default() };
    let half = model.half_height_mm();
    let (inside, rim): (Vec<_>, Vec<_>) = points.into_iter().partition(|point| point.1.abs() <= half);
    let rim: Vec<(f64, f64)> = rim.into_iter().map(|point| (point.0, point.1.clamp(-half, half))).collect();
    let margin = 0.02 * (high - low).max(1e-9);
    let x_bounds = [low - margin, high + margin];
    let canvas = Canvas::default().marker(Marker::Braille).x_bounds(x_bounds).y_bounds([-half, half]).paint(
        |context| {
            floor_band(context, model, x_bounds, inks);
            context.draw(&Points { coords: &inside, color: inks.points });
            context.layer();
            context.draw(&Points { coords: &rim, color: inks.outside });
        },
    );
    frame.render_widget(canvas, area);
    Drawn { count: rim.len(), range: Some((low, high)) }
}

/// The line of no error, and the floor above and below it.
fn floor_band(context: &mut Context, model: &ModelState, x: [f64; 2], inks: Inks) {
    context.draw(&Line { x1: x[0], y1: 0.0, x2: x[1], y2: 0.0, color: inks.axis });
    if let Some(floor) = model.standing.as_ref().and_then(|standing| standing.floor_mm) {
        for y in [-floor, floor] {
            let dots: Vec<(f64, f64)> =
                (0..24).map(|dot| (x[0] + (x[1] - x[0]) * f64::from(dot) / 23.0, y)).collect();
            context.draw(&Points { coords: &dots, color: inks.floor });
        }
    }
    context.layer();
}

fn bulls_eye(residuals: &Residuals, model: &ModelState, inks: Inks, frame: &mut Frame, area: Rect) -> Drawn {
    let half = model.half_height_mm();
    let wide = half * f64::from(area.width) / (2.0 * f64::from(area.height));
    let pair = |row: &super::residuals::ResidualRow| {
        let (first, second) =
            (row.error_mm.first().copied().flatten()?, row.error_mm.get(1).copied().flatten()?);
        (first.is_finite() && second.is_finite()).then_some((first, second))
    };
    let points: Vec<(f64, f64)> = residuals.rows.iter().filter_map(pair).collect();
    let (inside, rim): (Vec<_>, Vec<_>) =
        points.into_iter().partition(|point| point.0.abs() <= wide && point.1.abs() <= half);
    let rim: Vec<(f64, f64)> =
        rim.into_iter().map(|point| (point.0.clamp(-wide, wide), point.1.clamp(-half, half))).collect();
    let floor = model.standing.as_ref().and_then(|standing| standing.floor_mm);
    let canvas =
        Canvas::default().marker(Marker::Braille).x_bounds([-wide, wide]).y_bounds([-half, half]).paint(
            |context| {
                context.draw(&Line { x1: -wide, y1: 0.0, x2: wide, y2: 0.0, color: inks.axis });
                context.draw(&Line { x1: 0.0, y1: -half, x2: 0.0, y2: half, color: inks.axis });
                context.layer();
                context.draw(&Points { coords: &inside, color: inks.points });
                context.draw(&Points { coords: &rim, color: inks.outside });
                context.layer();
                if let Some(floor) = floor {
                    context.draw(&Circle { x: 0.0, y: 0.0, radius: 2.0 * floor, color: inks.floor });
                }
            },
        );
    frame.render_widget(canvas, area);
    Drawn { count: rim.len(), range: None }
}

fn whiskers(residuals: &Residuals, inks: Inks, frame: &mut Frame, area: Rect) -> Drawn {
    let placed: Vec<([f64; 3], [f64; 2])> = residuals
        .rows
        .iter()
        .filter_map(|row| {
            let error =
                |place: usize| row.error_mm.get(place).copied().flatten().filter(|error| error.is_finite());
            Some((row.position_mm?, [error(0)?, error(1)?]))
        })
        .collect();
    let xs = span(placed.iter().map(|(position, _)| position[0]).chain([0.0]));
    let ys = span(placed.iter().map(|(position, _)| position[1]).chain([0.0]));
    let (Some((left, right)), Some((below, above))) = (xs, ys) else { return Drawn::default() };
    // One scale both ways: a Braille dot is about square, two across and four down to a cell.
    let (across, up) = (2.0 * f64::from(area.width), 4.0 * f64::from(area.height));
    let dot = ((right - left) / across).max((above - below) / up).max(1e-9) * 1.08;
    let (middle_x, middle_y) = (f64::midpoint(left, right), f64::midpoint(below, above));
    let magnified = magnification(10.0 * dot / residuals.typical_mm().max(1e-12));
    let every = placed.len().div_ceil(MOST_WHISKERS).max(1);
    let canvas = Canvas::default()
        .marker(Marker::Braille)
        .x_bounds([middle_x - 0.5 * dot * across, middle_x + 0.5 * dot * across])
        .y_bounds([middle_y - 0.5 * dot * up, middle_y + 0.5 * dot * up])
        .paint(|context| {
            context.draw(&Circle { x: 0.0, y: 0.0, radius: 3.0 * dot, color: inks.axis });
            context.layer();
            for (position, error) in placed.iter().step_by(every) {
                let (x2, y2) = (position[0] + magnified * error[0], position[1] + magnified * error[1]);
                context.draw(&Line { x1: position[0], y1: position[1], x2, y2, color: inks.points });
            }
        });
    frame.render_widget(canvas, area);
    Drawn { count: 0, range: Some((0.0, magnified)) }
}

/// The round magnification below `wanted`: 1, 2 or 5 times a power of ten.
fn magnification(wanted: f64) -> f64 {
    if !wanted.is_finite() || wanted <= 0.0 {
        return 1.0;
    }
    let power = 10_f64.powf(wanted.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|step| step * power).find(|step| *step <= wanted).unwrap_or(power)
}

fn histogram(residuals: &Residuals, model: &ModelState, inks: Inks, frame: &mut Frame, area: Rect) -> Drawn {
    let half = model.half_height_mm();
    let bins = usize::from(area.width) * 2;
    let mut counts = vec![0_u32; bins];
    let mut outside = 0;
    for error in residuals.errors(model.direction) {
        let place = (error + half) / (2.0 * half) * bins as f64;
        if place >= 0.0 && place < bins as f64 {
            // In range as just checked.
            counts[(place as usize).min(bins - 1)] += 1;
        } else {
            outside += 1;
        }
    }
    let most = f64::from(counts.iter().copied().max().unwrap_or(0).max(1));
    let floor = model.standing.as_ref().and_then(|standing| standing.floor_mm);
    let canvas =
        Canvas::default().marker(Marker::Braille).x_bounds([-half, half]).y_bounds([0.0, most]).paint(
            |context| {
                for (bin, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
                    let x = -half + (bin as f64 + 0.5) * 2.0 * half / bins as f64;
                    context.draw(&Line { x1: x, y1: 0.0, x2: x, y2: f64::from(*count), color: inks.points });
                }
                context.layer();
                for x in floor.into_iter().flat_map(|floor| [-floor, floor]) {
                    context.draw(&Line { x1: x, y1: 0.0, x2: x, y2: most, color: inks.floor });
                }
            },
        );
    frame.render_widget(canvas, area);
    Drawn { count: outside, range: None }
}

/// Least and greatest of what is finite.
fn span(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.filter(|value| value.is_finite()).fold(None, |span, value| match span {
        None => Some((value, value)),
        Some((low, high)) => Some((f64::min(low, value), f64::max(high, value))),
    })
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
