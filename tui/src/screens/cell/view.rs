//! Draws the Cell screen.

use plumb_cell::event::{DeviceState, NamedValue};
use plumb_cell::with_decimals;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use super::state::Device;
use super::trace::Trace;
use super::words::state_word;
use super::{CellState, plan_view, side_view};
use crate::screens::pane;
use crate::screens::state::State;
use crate::screens::theme::Theme;

/// Draws the page.
pub(crate) fn view(state: &State, frame: &mut Frame, area: Rect) {
    let (lists, drawing) = if area.width >= 70 {
        let [lists, drawing] =
            Layout::horizontal([Constraint::Percentage(52), Constraint::Fill(1)]).areas(area);
        (lists, Some(drawing))
    } else {
        (area, None)
    };
    let cell = &state.cell;
    let message = cell.devices.iter().filter(|device| !device.message.is_empty()).count();
    let devices = rows((cell.devices.len() + message).max(1));
    let joints = rows(cell.devices.iter().map(|device| device.joints.len()).sum::<usize>().max(1));
    let moving =
        if cell.is_moving() { "Joints, the last 30 s \u{b7} moving" } else { "Joints, the last 30 s" };
    let [top, middle, bottom] =
        Layout::vertical([Constraint::Max(devices), Constraint::Max(joints), Constraint::Fill(1)])
            .areas(lists);
    list(frame, top, &state.theme, "Devices", device_lines(cell, &state.theme, usize::from(top.width)));
    list(frame, middle, &state.theme, moving, joint_lines(cell, &state.theme, usize::from(middle.width)));
    let room = usize::from(bottom.height.saturating_sub(2));
    list(
        frame,
        bottom,
        &state.theme,
        "Signals",
        signal_lines(cell, &state.theme, room, usize::from(bottom.width)),
    );
    if let Some(area) = drawing {
        views(state, frame, area, false);
    }
}

/// The arm from the side and, where the cell has a target, from above: one over the other, or `beside` each other.
pub(crate) fn views(state: &State, frame: &mut Frame, area: Rect, beside: bool) {
    let (cell, theme) = (&state.cell, &state.theme);
    let above = if cell.target.is_some() { Constraint::Fill(1) } else { Constraint::Length(0) };
    let halves = [above, Constraint::Fill(1)];
    let [plan, side] =
        if beside { Layout::horizontal(halves).areas(area) } else { Layout::vertical(halves).areas(area) };
    if !plan.is_empty() {
        let inner = pane::open(frame, plan, theme, "Arm from above", false);
        plan_view(cell, theme, frame, inner);
    }
    let inner = pane::open(frame, side, theme, "Arm from the side", false);
    side_view(cell, theme, frame, inner);
}

/// Rows of a pane with `lines` lines in it.
fn rows(lines: usize) -> u16 {
    u16::try_from(lines.saturating_add(2)).unwrap_or(u16::MAX)
}

fn list(frame: &mut Frame, area: Rect, theme: &Theme, title: &str, lines: Vec<Line<'static>>) {
    if area.is_empty() {
        return;
    }
    let inner = pane::open(frame, area, theme, title, false);
    let lines = if lines.is_empty() { vec![Line::styled("nothing yet", theme.faint)] } else { lines };
    frame.render_widget(Paragraph::new(pane::marked(lines, usize::from(inner.width))), inner);
}

fn device_lines(cell: &CellState, theme: &Theme, width: usize) -> Vec<Line<'static>> {
    cell.devices
        .iter()
        .flat_map(|device| {
            let (sign, style) = state_look(device.state, theme);
            let row = Line::from(vec![
                Span::styled(format!("{sign} "), style),
                Span::styled(format!("{:<9} ", device.name), theme.heading),
                Span::styled(format!("{:<12} ", state_word(device.state)), style),
                Span::styled(device.plugin.clone(), theme.faint),
            ]);
            let message = (!device.message.is_empty()).then(|| {
                let text = pane::fitted(&device.message, width.saturating_sub(6));
                Line::styled(
                    format!("    {text}"),
                    if device.state == DeviceState::Lost { theme.bad } else { theme.faint },
                )
            });
            [Some(row), message].into_iter().flatten()
        })
        .collect()
}

fn joint_lines(cell: &CellState, theme: &Theme, width: usize) -> Vec<Line<'static>> {
    let robots: Vec<&Device> = cell.devices.iter().filter(|device| !device.joints.is_empty()).collect();
    let many = robots.len() > 1;
    let line = |robot: &Device, (joint, trace): (&NamedValue, &Trace)| {
        let name = if many { format!("{} {}", robot.name, joint.name) } else { joint.name.clone() };
        let mut line = joint_line(&name, joint, theme, width.saturating_sub(2));
        let room = width.saturating_sub(line.width() + 5).min(60);
        line.push_span(Span::styled(format!("  {}", trace.drawn(cell.now_ns, room)), theme.measured));
        line
    };
    robots
        .iter()
        .flat_map(|robot| robot.joints.iter().zip(&robot.joint_traces).map(|joint| line(robot, joint)))
        .collect()
}

/// One joint: its name, its value, its unit.
pub(crate) fn joint_line(name: &str, joint: &NamedValue, theme: &Theme, width: usize) -> Line<'static> {
    // In a narrow pane the name gives way, not the unit.
    let names = NAMES.min(width.saturating_sub(NUMBERS + 1 + pane::columns(&joint.unit)));
    Line::from(vec![
        Span::styled(format!("{:<names$}", pane::fitted(name, names)), theme.text),
        Span::styled(format!("{:>NUMBERS$}", with_decimals(joint.value, 3)), theme.heading),
        Span::styled(format!(" {}", joint.unit), theme.faint),
    ])
}

/// Columns of the names of joints where there is room.
const NAMES: usize = 14;
/// Columns of their values.
const NUMBERS: usize = 10;

/// The level of every signal, then the newest changes.
fn signal_lines(cell: &CellState, theme: &Theme, room: usize, width: usize) -> Vec<Line<'static>> {
    let levels =
        cell.devices.iter().flat_map(|device| device.signals.iter().map(move |signal| (device, signal)));
    let mut lines: Vec<Line<'static>> = levels
        .map(|(device, signal)| {
            let (sign, word, style) = level_look(signal.on, theme);
            let changes =
                format!("{:>3} change{}", signal.changes, if signal.changes == 1 { " " } else { "s" });
            let mut line = Line::from(vec![
                Span::styled(format!("{sign} "), style),
                Span::styled(format!("{:<12}", format!("{} {}", device.name, signal.name)), theme.heading),
                Span::styled(format!("{word:<4}"), style),
                Span::styled(changes, theme.faint),
            ]);
            let room = width.saturating_sub(line.width() + 4).min(60);
            line.push_span(Span::styled(
                format!("  {}", signal.trace.drawn(cell.now_ns, room)),
                theme.measured,
            ));
            line
        })
        .collect();
    let room = room.saturating_sub(lines.len());
    lines.extend(cell.edges.iter().rev().take(room).map(|edge| {
        let (_, word, style) = level_look(edge.on, theme);
        Line::from(vec![
            Span::styled(format!("{:>10.3} s  ", seconds(edge.time_ns)), theme.faint),
            Span::styled(format!("{} {} ", edge.device, edge.signal), theme.text),
            Span::styled(format!("goes {word}"), style),
        ])
    }));
    lines
}

fn seconds(nanoseconds: u64) -> f64 {
    std::time::Duration::from_nanos(nanoseconds).as_secs_f64()
}

fn level_look(on: bool, theme: &Theme) -> (&'static str, &'static str, Style) {
    if on { ("\u{25a0}", "on", theme.good) } else { ("\u{25a1}", "off", theme.text) }
}

fn state_look(state: DeviceState, theme: &Theme) -> (&'static str, Style) {
    match state {
        DeviceState::Unconfigured => ("\u{25cc}", theme.faint),
        DeviceState::Inactive => ("\u{25cb}", theme.text),
        DeviceState::Active => ("\u{25cf}", theme.good),
        DeviceState::Finalized => ("\u{b7}", theme.faint),
        DeviceState::Lost => ("\u{2717}", theme.bad),
    }
}
