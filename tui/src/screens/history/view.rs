//! Draws the History screen.

use plumb_cell::{give_or_take, with_decimals};
use plumb_record::{RunEnd, RunState, RunSummary};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::canvas::{Canvas, Circle, Line as Stroke};
use ratatui::widgets::{Paragraph, Wrap};

use super::state::{HistoryState, OpenedRun};
use super::trend::{Trend, TrendPoint};
use crate::screens::hits::Hit;
use crate::screens::pane::{self, fitted, folded};
use crate::screens::state::State;
use crate::screens::theme::Theme;
use plumb_report::run_words::ended_in_words;

/// Draws the page.
pub(crate) fn view(state: &State, frame: &mut Frame, area: Rect) {
    let Some(history) = &state.history else { return };
    let theme = &state.theme;
    if let Some(opened) = &history.opened {
        in_full(opened, theme, frame, area);
        return;
    }
    if area.width < 64 {
        list(state, history, frame, area);
        return;
    }
    let [left, right] = Layout::horizontal([Constraint::Percentage(46), Constraint::Fill(1)]).areas(area);
    list(state, history, frame, left);
    let [above, below] = Layout::vertical([Constraint::Max(11), Constraint::Fill(1)]).areas(right);
    in_short(history, &state.record_option, theme, frame, above);
    trend(history, theme, frame, below);
}

/// The runs, one a row.
fn list(state: &State, history: &HistoryState, frame: &mut Frame, area: Rect) {
    let theme = &state.theme;
    let shown = history.shown();
    let all = history.runs.as_ref().map_or(0, Vec::len);
    let count = match history.filter.is_empty() {
        true => all.to_string(),
        false => format!("{} of {all}", shown.len()),
    };
    let title = match history.whose() {
        Some(whose) => format!("Runs ({count}) of {whose}, UTC"),
        None => format!("Runs ({count}), times in UTC"),
    };
    let inner = pane::open(frame, area, theme, &title, true);
    let writes = history.filtering || !history.filter.is_empty();
    let [top, rows] =
        Layout::vertical([Constraint::Length(u16::from(writes)), Constraint::Fill(1)]).areas(inner);
    let cursor = if history.filtering { "\u{2588}" } else { "" };
    frame.render_widget(
        Line::from(vec![
            Span::styled("filter: ", theme.faint),
            Span::styled(format!("{}{cursor}", history.filter), theme.heading),
        ]),
        top,
    );
    if shown.is_empty() {
        let text = match (&history.problem, &history.runs) {
            (Some(problem), _) => problem.clone(),
            (None, None) => "Reading the record \u{2026}".to_owned(),
            (None, Some(runs)) if runs.is_empty() => {
                "No runs yet. The first one will be listed here.".to_owned()
            }
            (None, Some(_)) => "No run holds these words. / changes them.".to_owned(),
        };
        let style = if history.problem.is_some() { theme.bad } else { theme.faint };
        frame.render_widget(Paragraph::new(text).style(style).wrap(Wrap { trim: true }), rows);
        return;
    }
    let room = usize::from(rows.height);
    let first = history.chosen.saturating_sub(room / 2).min(shown.len().saturating_sub(room));
    let names_cells = history.cells().len() > 1;
    for ((index, run), row) in shown.iter().enumerate().skip(first).zip(rows.rows()) {
        frame.render_widget(
            run_line(run, names_cells, index == history.chosen, theme, usize::from(rows.width)),
            row,
        );
        state.hits.note(row, Hit::Run(index));
    }
}

/// A run in one row, with its cell where the record holds those of several.
fn run_line(run: &RunSummary, names_cell: bool, chosen: bool, theme: &Theme, width: usize) -> Line<'static> {
    let (sign, style) = look(run.state, theme);
    let name = match names_cell {
        true => format!("{} {}", run.cell, run.procedure),
        false => run.procedure.clone(),
    };
    let text = format!(
        "{:>4} {} {} {}",
        run.run.0,
        day(&run.started),
        clock(&run.started),
        fitted(&name, width.saturating_sub(19))
    );
    let text = format!("{:<width$}", fitted(&text, width.saturating_sub(2)), width = width.saturating_sub(2));
    Line::from(vec![
        Span::styled(format!("{sign} "), style),
        Span::styled(text, if chosen { theme.chosen } else { theme.text }),
    ])
}

/// Month and day of a time.
fn day(time: &str) -> &str {
    time.get(5..10).unwrap_or("")
}

/// Hours and minutes of a time.
fn clock(time: &str) -> &str {
    time.get(11..16).unwrap_or("")
}

fn look(state: RunState, theme: &Theme) -> (&'static str, Style) {
    match state {
        RunState::Running => ("\u{25b8}", theme.focus),
        RunState::Ended(RunEnd::Passed) => ("\u{2713}", theme.good),
        RunState::Ended(RunEnd::Failed | RunEnd::Error) => ("\u{2717}", theme.bad),
        RunState::Ended(RunEnd::Aborted) => ("\u{25a0}", theme.warning),
        RunState::Ended(RunEnd::NeedsOperator) => ("?", theme.warning),
    }
}

/// The chosen run in a few lines.
fn in_short(history: &HistoryState, record_option: &str, theme: &Theme, frame: &mut Frame, area: Rect) {
    let run = history.run();
    let title = run.map_or_else(|| "Run".to_owned(), |run| format!("Run {} \u{b7} Enter opens", run.run.0));
    let inner = pane::open(frame, area, theme, &title, false);
    let Some(run) = run else { return };
    let (sign, style) = look(run.state, theme);
    let mut lines = vec![
        Line::styled(run.title.clone(), theme.heading),
        Line::from(vec![
            Span::styled(format!("{sign} {}", ended_in_words(run)), style),
            Span::raw(format!(" \u{b7} {} \u{b7} by {}", run.cell, run.operator)),
        ]),
        Line::raw(format!("{} {} UTC", run.started.get(..10).unwrap_or(""), clock(&run.started))),
    ];
    if let Some(message) = &run.message {
        lines.push(Line::raw(message.clone()));
    }
    if run.state == RunState::Running {
        lines.push(Line::styled(
            format!("plumb run --resume {}{record_option} takes it up, unless it is open now", run.run.0),
            theme.faint,
        ));
    }
    let found: Vec<Line> =
        history.trends.iter().flat_map(|trend| found_by(trend, run.run.0)).map(Line::raw).collect();
    lines.extend(found);
    frame.render_widget(Paragraph::new(lines).wrap(Wrap { trim: true }), inner);
}

/// What a run put in force of one quantity.
fn found_by(trend: &Trend, run: i64) -> Option<String> {
    let point = trend.points.iter().rev().find(|point| point.run == Some(run))?;
    let around = give_or_take(point.uncertainty, &trend.unit);
    let newest = trend.points.last().is_some_and(|newest| newest == point);
    let now = if newest { "in force" } else { "replaced since" };
    Some(format!("{} {:.4} {} ({around}), {now}", trend.name, point.value, trend.unit))
}

/// One run with all the record holds of it, over the whole page.
fn in_full(opened: &OpenedRun, theme: &Theme, frame: &mut Frame, area: Rect) {
    let title = format!("Run {} \u{b7} Up, Down and PgUp, PgDn scroll \u{b7} Enter closes", opened.run);
    let inner = pane::open(frame, area, theme, &title, true);
    if opened.lines.is_empty() {
        frame.render_widget(Line::styled("Reading the record \u{2026}", theme.faint), inner);
        return;
    }
    let width = usize::from(inner.width);
    let lines: Vec<Line> = opened
        .lines
        .iter()
        .skip(opened.scrolled)
        .take(usize::from(inner.height))
        .flat_map(|line| {
            let style = if line.starts_with(' ') { theme.text } else { theme.heading };
            folded(line, width).into_iter().map(move |part| Line::styled(part, style))
        })
        .collect();
    frame.render_widget(Paragraph::new(lines), inner);
}

/// One corrected quantity over time: every value that was in force, with its uncertainty.
fn trend(history: &HistoryState, theme: &Theme, frame: &mut Frame, area: Rect) {
    let Some(trend) = history.trends.get(history.trend) else {
        let inner = pane::open(frame, area, theme, "Corrections over time", false);
        let text = "No correction was ever put in force.";
        frame.render_widget(Paragraph::new(text).style(theme.faint).wrap(Wrap { trim: true }), inner);
        return;
    };
    // Two cells may well call their arms alike.
    let several = history.trends.iter().any(|other| other.cell != trend.cell);
    let of_cell = if several { format!(", {}", trend.cell) } else { String::new() };
    let (name, unit) = (&trend.name, &trend.unit);
    let title = format!("{name}{of_cell}, {unit} ({} of {})", history.trend + 1, history.trends.len());
    let inner =
        pane::open(frame, area, theme, &fitted(&title, usize::from(area.width.saturating_sub(4))), false);
    let Some(scale) = Scale::of(&trend.points) else { return };
    let [left, plot] = Layout::horizontal([Constraint::Length(9), Constraint::Fill(1)]).areas(inner);
    let [plot, dates] = Layout::vertical([Constraint::Fill(1), Constraint::Length(1)]).areas(plot);
    if plot.height < 2 || plot.width < 8 {
        return;
    }
    for (value, row) in [(scale.high, plot.top()), (scale.low, plot.bottom().saturating_sub(1))] {
        let row_area = Rect { y: row, height: 1, ..left };
        frame.render_widget(Line::styled(format!("{:>8} ", with_decimals(value, 3)), theme.faint), row_area);
    }
    let chosen = history.run().map(|run| run.run.0);
    draw(trend, &scale, chosen, theme, frame, plot);
    let (first, last) = (trend.points.first(), trend.points.last());
    let date = |point: Option<&TrendPoint>| {
        point.map_or_else(String::new, |point| format!("{} {}", day(&point.time), clock(&point.time)))
    };
    frame.render_widget(Line::styled(date(first), theme.faint), dates);
    if trend.points.len() > 1 && dates.width > 24 {
        frame.render_widget(Line::styled(date(last), theme.faint).right_aligned(), dates);
    }
}

/// What the axes of a trend span.
struct Scale {
    from: f64,
    to: f64,
    low: f64,
    high: f64,
}

/// What is shown above and below at least, deg or mm: ten times the last digit that is at the axis, so that its ends differ.
const LEAST_AIR: f64 = 0.01;

impl Scale {
    fn of(points: &[TrendPoint]) -> Option<Self> {
        let ends = |value: fn(&TrendPoint, f64) -> f64| {
            let values = points.iter().flat_map(move |point| [value(point, -1.0), value(point, 1.0)]);
            values.filter(|value| value.is_finite()).fold(None, |span: Option<(f64, f64)>, value| {
                Some(span.map_or((value, value), |(low, high)| (low.min(value), high.max(value))))
            })
        };
        let (from, to) = ends(|point, _| point.seconds)?;
        let (low, high) = ends(|point, sign| point.value + sign * point.uncertainty.unwrap_or(0.0))?;
        // A single moment or a value that never changed still gets an axis.
        let wide = 0.04 * (to - from).max(60.0);
        let air = (0.12 * (high - low)).max(LEAST_AIR);
        Some(Self { from: from - wide, to: to + wide, low: low - air, high: high + air })
    }
}

fn draw(trend: &Trend, scale: &Scale, chosen: Option<i64>, theme: &Theme, frame: &mut Frame, area: Rect) {
    let colour = |style: Style| style.fg.unwrap_or(Color::Reset);
    let (line, dot, marked) = (colour(theme.faint), colour(theme.measured), colour(theme.focus));
    let radius = 1.5 * (scale.to - scale.from) / (2.0 * f64::from(area.width));
    let canvas = Canvas::default()
        .marker(Marker::Braille)
        .x_bounds([scale.from, scale.to])
        .y_bounds([scale.low, scale.high])
        .paint(|context| {
            // What was in force stayed so until the next value came.
            for (index, point) in trend.points.iter().enumerate() {
                let next = trend.points.get(index + 1);
                let until = next.map_or(scale.to, |next| next.seconds);
                let after = next.map_or(point.value, |next| next.value);
                context.draw(&Stroke {
                    x1: point.seconds,
                    y1: point.value,
                    x2: until,
                    y2: point.value,
                    color: line,
                });
                context.draw(&Stroke { x1: until, y1: point.value, x2: until, y2: after, color: line });
            }
            context.layer();
            for point in &trend.points {
                let color = if point.run.is_some() && point.run == chosen { marked } else { dot };
                let around = point.uncertainty.unwrap_or(0.0);
                let (low, high) = (point.value - around, point.value + around);
                context.draw(&Stroke { x1: point.seconds, y1: low, x2: point.seconds, y2: high, color });
                context.draw(&Circle { x: point.seconds, y: point.value, radius, color });
            }
        });
    frame.render_widget(canvas, area);
}
