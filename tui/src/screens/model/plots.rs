//! The plots of the Model screen: first the chosen candidate's own plot and the error in space, then the residuals along each joint's own motion, as a bull's
//! eye with the noise's ring, as a histogram, against moments of gravity, sides of approach, order and every other condition. All share one scale tied to the
//! noise floor.

use plumb_calibration::measurement::ReadingUnit;
use plumb_diagnosis::laboratory::{EffectPlot, Series};
use plumb_report::plot::reach_of;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line as TextLine, Span};
use ratatui::widgets::canvas::{Canvas, Line};

use super::arm_view::{self, Scene};
use super::chart::{self, Chart, Look, Parts};
use super::plane::span;
use super::residuals::{AXES, PLANES, Residuals, Subject, varies};
use super::state::ModelState;
use crate::screens::hits::Hits;
use crate::screens::pane::{self, columns, fitted};
use crate::screens::theme::Theme;

/// The least a plot takes, in columns and rows.
const SMALLEST: (u16, u16) = (26, 7);

/// Rows of the pane from which the own plot and the error in space get nearly half of them.
const ROOM_FOR_BOTH: u16 = 18;

/// The own plot's curve may take this much more than the common scale.
const AIR_OVER_CURVE: f64 = 1.15;

/// One of the plots.
#[derive(Clone, Copy)]
enum Plot<'a> {
    /// The chosen candidate's own.
    Own(&'a EffectPlot),
    /// The error in space, on a drawing of the arm.
    Space,
    /// Errors against something.
    Against(&'a Series),
    /// Errors in a plane, one axis over the other.
    BullsEye,
    /// How many rows of which size.
    Histogram,
}

/// What all plots share.
struct Sheet<'a> {
    residuals: &'a Residuals,
    arm_mm: &'a [[f64; 3]],
    plane: [usize; 2],
    /// The unit of the table's readings.
    unit: ReadingUnit,
    /// Half the height of a plot, in `unit`.
    half: f64,
    floor: Option<f64>,
    floor_of_a_point: Option<f64>,
    look: Look,
}

impl Sheet<'_> {
    /// The height of plots of sizes: the error of a point is larger than that of a reading by what makes a point of readings.
    fn half_of_a_point(&self) -> f64 {
        let ratio = match (self.floor_of_a_point, self.floor) {
            (Some(point), Some(reading)) if reading > 0.0 => point / reading,
            _ => 3.0_f64.sqrt(),
        };
        ratio * self.half
    }
}

/// Draws as many plots as there is room for.
pub(crate) fn view(model: &ModelState, theme: &Theme, hits: &Hits, frame: &mut Frame, area: Rect) {
    let residuals = shown(model);
    let plots = residuals.map_or_else(Vec::new, |residuals| order(residuals, model.own_plot()));
    let room = area.height.saturating_sub(2);
    let above =
        usize::from(if room >= ROOM_FOR_BOTH { above_width(area.width.saturating_sub(2)) } else { 0 });
    let (first, others) = plots.split_at(above.min(plots.len()));
    let inner = Rect { x: area.x + 1, y: area.y + 1, width: area.width.saturating_sub(2), height: room };
    let high = if first.is_empty() { 0 } else { inner.height * 9 / 20 };
    let [top, rest] = Layout::vertical([Constraint::Length(high), Constraint::Fill(1)]).areas(inner);
    let cells = grid(rest, others.len());
    let scrolled = model.plots_scrolled.min(others.len().saturating_sub(cells.len()));
    let width = usize::from(area.width.saturating_sub(4));
    pane::open(frame, area, theme, &title(model, (others.len(), cells.len(), scrolled), width), false);
    let Some(residuals) = residuals else { return };
    let sheet = sheet(model, residuals, theme);
    let across = Layout::horizontal((0..first.len()).map(|_| Constraint::Fill(1))).spacing(1).split(top);
    for (plot, cell) in first.iter().zip(across.iter()) {
        draw(*plot, &sheet, theme, hits, frame, *cell);
    }
    for (plot, cell) in others.iter().skip(scrolled).zip(cells) {
        draw(*plot, &sheet, theme, hits, frame, cell);
    }
}

/// The chosen candidate's own plot alone.
pub(super) fn own(model: &ModelState, theme: &Theme, hits: &Hits, frame: &mut Frame, area: Rect) {
    if let (Some(residuals), Some(plot)) = (shown(model), model.own_plot()) {
        draw(Plot::Own(plot), &sheet(model, residuals, theme), theme, hits, frame, area);
    }
}

fn sheet<'a>(model: &'a ModelState, residuals: &'a Residuals, theme: &Theme) -> Sheet<'a> {
    let colour = |style: Style| style.fg.unwrap_or(Color::Reset);
    let summary = model.summary.as_ref();
    Sheet {
        residuals,
        arm_mm: summary.map_or(&[][..], |summary| summary.arm_mm.as_slice()),
        plane: PLANES.get(model.plane).copied().unwrap_or([0, 1]),
        unit: model.reading_unit(),
        half: model.half_height_mm(),
        floor: model.floor_mm(),
        floor_of_a_point: summary.and_then(|summary| summary.floor_of_a_point_mm),
        look: Look {
            points: colour(if model.preview.is_some() { theme.preview } else { theme.measured }),
            curve: colour(theme.machine),
            floor: colour(theme.good),
            axis: colour(theme.faint),
            outside: colour(theme.bad),
            mark: theme.warning,
            pointed: model.pointed,
        },
    }
}

/// The residuals of the preview while there is one, else of the model as it is.
fn shown(model: &ModelState) -> Option<&Residuals> {
    match &model.preview {
        Some(preview) => Some(&preview.residuals),
        None => model.summary.as_ref().map(|summary| &summary.residuals),
    }
}

/// The scale, and which of the plots are shown where not all are: the longest that fits.
fn title(model: &ModelState, (plots, shown, scrolled): (usize, usize, usize), width: usize) -> String {
    let times = model.half_height_mm() / model.unit_mm();
    let scale = match model.floor_mm() {
        Some(_) => format!("{times:.0} \u{d7} noise"),
        None => format!("{times:.0} typical errors"),
    };
    let (first, last) = (scrolled + 1, (scrolled + shown).min(plots));
    let (half, unit) = (model.half_height_mm(), model.reading_unit());
    let (long, short) = match plots > shown {
        true if shown > 1 => (
            format!(" \u{b7} {first}\u{2013}{last} of {plots}, PgDn"),
            format!(" \u{b7} {first}\u{2013}{last}/{plots} PgDn"),
        ),
        true => (format!(" \u{b7} {first} of {plots}, PgDn"), format!(" \u{b7} {first}/{plots} PgDn")),
        false => (String::new(), String::new()),
    };
    let full = format!("Error, \u{b1}{half:.3} {unit} = {scale}{long}");
    match columns(&full) <= width {
        true => full,
        false => fitted(&format!("\u{b1}{half:.2} {unit}{short}"), width),
    }
}

/// How many plots are above the others, side by side.
fn above_width(width: u16) -> u16 {
    if width > 2 * SMALLEST.0 { 2 } else { 1 }
}

/// The plots in the order in which they are shown: the chosen candidate's own, the error in space, joints, bull's eye and histogram, moments of gravity, sides
/// of approach, then order, time, temperature and the rest.
fn order<'a>(residuals: &'a Residuals, own: Option<&'a EffectPlot>) -> Vec<Plot<'a>> {
    let mut series: Vec<&Series> =
        residuals.series.iter().filter(|series| varies(series, &residuals.series)).collect();
    series.sort_by_key(|series| Subject::of(series));
    let (joints, others): (Vec<&Series>, Vec<&Series>) =
        series.into_iter().partition(|series| Subject::of(series) == Subject::Joint);
    let in_space = residuals.rows.iter().any(|row| row.vector_mm != [0.0; 3]);
    let mut plots: Vec<Plot> = own.map(Plot::Own).into_iter().collect();
    plots.extend(in_space.then_some(Plot::Space));
    plots.extend(joints.into_iter().map(Plot::Against));
    plots.extend(in_space.then_some(Plot::BullsEye));
    plots.push(Plot::Histogram);
    plots.extend(others.into_iter().map(Plot::Against));
    plots
}

/// Divides the room into as many cells as are useful.
fn grid(area: Rect, plots: usize) -> Vec<Rect> {
    if plots == 0 || area.height == 0 {
        return Vec::new();
    }
    let columns = (area.width / SMALLEST.0).clamp(1, 4);
    let requested = u16::try_from(plots.div_ceil(usize::from(columns))).unwrap_or(u16::MAX).max(1);
    let rows = (area.height / SMALLEST.1).clamp(1, requested);
    let lines = Layout::vertical((0..rows).map(|_| Constraint::Fill(1))).split(area);
    let across = Layout::horizontal((0..columns).map(|_| Constraint::Fill(1))).spacing(1);
    lines.iter().flat_map(|line| across.split(*line).to_vec()).collect()
}

fn draw(plot: Plot, sheet: &Sheet, theme: &Theme, hits: &Hits, frame: &mut Frame, area: Rect) {
    match plot {
        Plot::Own(own) => own_chart(own, sheet, theme, hits, frame, area),
        Plot::Space => {
            let (residuals, arm_mm, plane) = (sheet.residuals, sheet.arm_mm, sheet.plane);
            arm_view::view(&Scene { residuals, arm_mm, plane }, sheet.look, theme, hits, frame, area);
        }
        Plot::Against(series) => against(series, sheet, theme, hits, frame, area),
        Plot::BullsEye => bulls_eye(sheet, theme, hits, frame, area),
        Plot::Histogram => histogram(sheet, theme, frame, area),
    }
}

fn own_chart(plot: &EffectPlot, sheet: &Sheet, theme: &Theme, hits: &Hits, frame: &mut Frame, area: Rect) {
    let abscissas = plot.points.iter().map(|point| point.0).chain(plot.curve.iter().map(|point| point.0));
    let Some((left, right)) = span(abscissas) else { return };
    let highest = plot.curve.iter().map(|point| point.1.abs()).fold(0.0, f64::max);
    let half = sheet.half.max(AIR_OVER_CURVE * highest);
    let added = if plot.added { ", in the model" } else { "" };
    let chart = Chart {
        heading: format!("{}{added}", plot.effect),
        // The heading says what `it` is, and only a joint has a motion.
        title: plot.up.title().replace("left without it, along the motion of ", "left along "),
        across: plot.across.title(),
        x: Some([left, right]),
        y: [-half, half],
        points: &plot.points,
        curve: &plot.curve,
        floor: sheet.floor,
    };
    chart::draw(&chart, sheet.look, theme, hits, frame, area);
}

fn against(series: &Series, sheet: &Sheet, theme: &Theme, hits: &Hits, frame: &mut Frame, area: Rect) {
    let Some((left, right)) = span(series.points.iter().map(|point| point.0)) else { return };
    let (y, floor) = match series.of_size {
        // Orientations have a scale of their own, with its numbers at the axis.
        _ if series.in_deg => ([0.0, reach_of(series.points.iter().map(|point| point.1), None)], None),
        true => ([0.0, sheet.half_of_a_point()], sheet.floor_of_a_point),
        false => ([-sheet.half, sheet.half], sheet.floor),
    };
    let unit = if series.unit.is_empty() { String::new() } else { format!(", {}", series.unit) };
    let points: Vec<(f64, f64, usize)> = series.points.iter().collect();
    let chart = Chart {
        heading: String::new(),
        title: series.shows.replace("residual along the motion of ", "error along "),
        across: format!("{}{unit}", series.against),
        x: Some([left, right]),
        y,
        points: &points,
        curve: &[],
        floor,
    };
    chart::draw(&chart, sheet.look, theme, hits, frame, area);
}

fn bulls_eye(sheet: &Sheet, theme: &Theme, hits: &Hits, frame: &mut Frame, area: Rect) {
    let axis = |index: usize| sheet.plane.get(index).and_then(|axis| AXES.get(*axis)).copied().unwrap_or("");
    let points: Vec<(f64, f64, usize)> = sheet.residuals.in_plane(sheet.plane).collect();
    let chart = Chart {
        heading: String::new(),
        title: format!("error along {}, mm", axis(1)),
        across: format!("error along {}, mm", axis(0)),
        x: None,
        y: [-sheet.half, sheet.half],
        points: &points,
        curve: &[],
        floor: sheet.floor,
    };
    chart::draw(&chart, sheet.look, theme, hits, frame, area);
}

fn histogram(sheet: &Sheet, theme: &Theme, frame: &mut Frame, area: Rect) {
    if area.height < 3 || area.width < 8 {
        return;
    }
    let parts = Parts::of(area, false);
    let largest = sheet.half_of_a_point();
    let bins = usize::from(parts.canvas.width) * 2;
    let mut counts = vec![0_u32; bins];
    let mut outside = 0;
    for row in &sheet.residuals.rows {
        // A row without such a reading is none of them.
        let Some(size) = row.size else { continue };
        let index = size / largest * bins as f64;
        // A size is never negative; what is not finite fails the comparison.
        match counts.get_mut(index as usize) {
            Some(count) if index.is_finite() => *count += 1,
            _ => outside += 1,
        }
    }
    let most = f64::from(counts.iter().copied().max().unwrap_or(0).max(1));
    let look = sheet.look;
    let canvas =
        Canvas::default().marker(Marker::Braille).x_bounds([0.0, largest]).y_bounds([0.0, most]).paint(
            |context| {
                for (bin, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
                    let x = (bin as f64 + 0.5) * largest / bins as f64;
                    let bar = Line { x1: x, y1: 0.0, x2: x, y2: f64::from(*count), color: look.points };
                    context.draw(&bar);
                }
                context.layer();
                if let Some(x) = sheet.floor_of_a_point {
                    context.draw(&Line { x1: x, y1: 0.0, x2: x, y2: most, color: look.floor });
                }
            },
        );
    frame.render_widget(canvas, parts.canvas);
    let count = if outside > 0 { format!("{outside} off") } else { String::new() };
    let title = fitted("rows by size", usize::from(area.width).saturating_sub(count.len() + 1));
    frame.render_widget(Span::styled(title, theme.heading), parts.head);
    frame.render_widget(TextLine::from(Span::styled(count, theme.bad)).right_aligned(), parts.head);
    if parts.gutter.width > 0 && parts.gutter.height > 0 {
        let top = Rect { height: 1, ..parts.gutter };
        frame.render_widget(Span::styled(format!("{most:>6.0} "), theme.faint), top);
    }
    let below = Rect { x: parts.canvas.x, width: parts.canvas.width, ..parts.foot };
    chart::across(&format!("error of a row, {}", sheet.unit), [0.0, largest], theme, frame, below);
}
