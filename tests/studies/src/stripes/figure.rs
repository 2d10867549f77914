//! The study as a picture: the direction-dependent error of every world, on paper, with zeros and rig adjusted, and with what was named added.

use plotters::prelude::*;

use super::outcome::Outcome;
use plumb::commands::stripe::study_world::Hidden;

/// Of one rig's chart.
const SIZE: (u32, u32) = (900, 420);

/// Agin's worst errors appeared to be on the order of +-5 mm.
const AGIN_MM: f64 = 10.0;

/// What is asked of the paper's camera, and of a modern one.
const ASKED_MM: [f64; 2] = [1.0, 0.3];

/// A state of a world: its name, its colour, its error.
type State = (&'static str, RGBColor, fn(&Outcome) -> f64);

/// In the order they come about.
const STATES: [State; 3] = [
    ("arm and rig as drawn", RGBColor(150, 150, 150), |one| one.on_paper_mm),
    ("zeros and rig adjusted", RGBColor(190, 80, 0), |one| one.classical_mm),
    ("what the lab named added", RGBColor(0, 90, 160), |one| one.added_mm),
];

/// The picture as one SVG document.
///
/// # Errors
/// What the drawing library reports, in its words.
pub(super) fn svg(outcomes: &[Outcome]) -> Result<String, String> {
    let mut document = String::new();
    draw(outcomes, &mut document).map_err(|error| error.to_string())?;
    Ok(document)
}

fn draw(outcomes: &[Outcome], document: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let mut rigs: Vec<&str> = outcomes.iter().map(|one| one.rig.as_str()).collect();
    rigs.sort_unstable();
    rigs.dedup();
    let (width, height) = SIZE;
    let area =
        SVGBackend::with_string(document, (width, height * rigs.len().max(1) as u32)).into_drawing_area();
    area.fill(&WHITE)?;
    for (rig, part) in rigs.iter().zip(area.split_evenly((rigs.len().max(1), 1))) {
        let of: Vec<&Outcome> = outcomes.iter().filter(|one| one.rig == *rig).collect();
        draw_rig(rig, &of, &part)?;
    }
    area.present()?;
    Ok(())
}

/// The worlds of one rig.
fn draw_rig(
    rig: &str,
    outcomes: &[&Outcome],
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
) -> Result<(), Box<dyn std::error::Error>> {
    let studied: Vec<Hidden> =
        Hidden::ALL.into_iter().filter(|hidden| outcomes.iter().any(|one| one.hidden == *hidden)).collect();
    let across = studied.len() as f64;
    let mut chart = ChartBuilder::on(area)
        .caption(
            format!("{rig}: what makes the direction-dependent error, world by world"),
            ("sans-serif", 18),
        )
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..across, (0.02..30.0).log_scale())?;
    let named = |at: &f64| {
        let index = at.floor();
        let middle = (at - index - 0.5).abs() < 1e-6;
        studied.get(index as usize).filter(|_| middle).map_or_else(String::new, |one| one.name().to_owned())
    };
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(WHITE)
        .x_labels(2 * studied.len() + 1)
        .x_label_formatter(&named)
        .y_desc("farthest apexes of 12 approaches, mm")
        .draw()?;
    let asked = ASKED_MM.map(|level| (level, RGBColor(0, 130, 60)));
    for (level, colour) in asked.into_iter().chain([(AGIN_MM, RGBColor(90, 90, 90))]) {
        chart.draw_series(LineSeries::new([(0.0, level), (across, level)], colour.stroke_width(1)))?;
    }
    for (state, (name, colour, error)) in STATES.into_iter().enumerate() {
        let points = studied.iter().enumerate().flat_map(|(index, hidden)| {
            let of: Vec<&Outcome> = outcomes.iter().copied().filter(|one| one.hidden == *hidden).collect();
            let count = of.len() as f64;
            let begin = index as f64 + 0.14 + 0.26 * state as f64;
            of.into_iter()
                .enumerate()
                .map(move |(at, one)| (begin + 0.2 * (at as f64 + 0.5) / count, error(one).max(0.021)))
                .collect::<Vec<_>>()
        });
        chart
            .draw_series(points.map(|point| Circle::new(point, 4, colour.filled())))?
            .label(name)
            .legend(move |(x, y)| Circle::new((x + 9, y), 4, colour.filled()));
    }
    chart.configure_series_labels().background_style(WHITE).border_style(BLACK).draw()?;
    Ok(())
}
