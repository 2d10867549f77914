//! The fleet's pages, as HTML. Everything that comes from a cell comes as text, never as markup.

use std::fmt::Write as _;

use plumb_central::{CellState, CellSummary, CellValues, ControlLimits, FEWEST_VALUES, Quantity, compare};

use super::chart::{self, Range, moment};
use super::print::{DIFFERENT_SIGMAS, cell_values, number};
use super::series::SeriesPoint;
use super::words::{Due, doing, due, in_order, is_silent, minute, summary};
use crate::web::escaped;

/// All cells: who waits comes first, then who runs, then the others by name.
pub(super) fn cells(cells: &[CellState], today: &str) -> String {
    let waiting = cells.iter().filter(|cell| cell.waits_for.is_some()).count();
    let mut body = format!("<p>{}.</p>", summary(cells));
    if cells.is_empty() {
        body.push_str("<p>No cell has shipped anything yet: <code>plumb ship --to ...</code> beside each cell does.</p>");
    } else {
        let heads = [
            "cell",
            "state",
            "what it does",
            "since, UTC",
            "last passed",
            "queued",
            "calibration due",
            "arm",
            "host",
        ];
        let heads: String = heads.iter().map(|head| format!("<th scope=\"col\">{head}</th>")).collect();
        let _ = write!(body, "<table class=\"cells\"><thead><tr>{heads}</tr></thead><tbody>");
        for cell in in_order(cells) {
            body.push_str(&cell_row(cell, today));
        }
        body.push_str("</tbody></table>");
    }
    let title = if waiting > 0 { format!("({waiting}) plumb fleet") } else { "plumb fleet".to_owned() };
    page(&title, "cells", true, &body)
}

fn cell_row(cell: &CellState, today: &str) -> String {
    let class = if cell.waits_for.is_some() { " class=\"waits\"" } else { "" };
    let since = minute(cell.ended.as_deref().unwrap_or(&cell.started));
    let does = doing(cell);
    let does_class = if is_silent(cell) { " class=\"does silent\"" } else { " class=\"does\"" };
    let due_class = match due(cell.due.as_deref(), today) {
        Due::Later => "",
        Due::Soon => " class=\"soon\"",
        Due::Over => " class=\"over\"",
    };
    let due_text = match (&cell.due, &cell.due_instrument) {
        (Some(day), Some(instrument)) => format!("{day} ({instrument})"),
        _ => String::new(),
    };
    let mut row = format!(
        "<tr{class} data-row tabindex=\"0\" id=\"{}-{}\">",
        escaped(&cell.record),
        escaped(&cell.cell)
    );
    let mut field = |name: &str, class: &str, text: &str| {
        let _ = write!(row, "<td data-name=\"{name}\"{class}>{}</td>", escaped(text));
    };
    field("cell", " class=\"time\"", &cell.cell);
    field("state", &format!(" class=\"state {}\"", escaped(&cell.state)), &cell.state.replace('_', " "));
    field("does", does_class, &does);
    field("since", " class=\"time\"", &since);
    field("last passed", " class=\"time\"", &cell.last_passed.as_deref().map(minute).unwrap_or_default());
    field("queued", "", &if cell.queued > 0 { cell.queued.to_string() } else { String::new() });
    field("due", due_class, &due_text);
    field("arm", "", cell.arm.as_deref().unwrap_or_default());
    field("host", "", &cell.host);
    row.push_str("</tr>\n");
    row
}

/// Everything of which there is a trend.
pub(super) fn quantities(quantities: &[Quantity]) -> String {
    let mut body = String::from(
        "<p>What corrections and arms' models hold, over all cells. Choose one to see it over time, machine beside machine.</p>",
    );
    if quantities.is_empty() {
        body.push_str("<p>No cell has shipped a correction or a model with effects yet.</p>");
        return page("plumb fleet: trends", "trends", false, &body);
    }
    body.push_str("<table><thead><tr><th scope=\"col\">what</th><th scope=\"col\">arm</th><th class=\"number\" scope=\"col\">cells</th><th class=\"number\" scope=\"col\">values</th></tr></thead><tbody>");
    for one in quantities {
        let key = if one.is_effect { "effect" } else { "correction" };
        let arm =
            if one.arm.is_empty() { String::new() } else { format!("&amp;arm={}", in_address(&one.arm)) };
        let _ = write!(
            body,
            "<tr><td><a data-row href=\"trend?{key}={}{arm}\">{}</a> <span class=\"small\">{key}</span></td><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td></tr>",
            in_address(&one.name),
            escaped(&one.name),
            escaped(&one.arm),
            one.cells,
            one.values
        );
    }
    body.push_str("</tbody></table>");
    page("plumb fleet: trends", "trends", false, &body)
}

/// One quantity over time and machines.
pub(super) fn trend(name: &str, arm: Option<&str>, points: &[SeriesPoint]) -> String {
    let of_arm = arm.map(|arm| format!(", arm {}", escaped(arm))).unwrap_or_default();
    let mut body = format!("<h2>{}{of_arm}</h2>", escaped(name));
    if arm.is_some() {
        let _ =
            write!(body, "<p><a href=\"trend?{}={}\">with every arm</a></p>", key_of(name), in_address(name));
    }
    if points.is_empty() {
        body.push_str("<p>No cell has shipped a value of it.</p>");
    }
    for quantity in points.chunk_by(|one, other| one.what == other.what) {
        body.push_str(&one_quantity(quantity));
    }
    page(&format!("{name}: plumb fleet"), "trends", false, &body)
}

/// A correction has a point, an effect brackets or nothing.
fn key_of(name: &str) -> &'static str {
    if name.contains('(') || !name.contains('.') { "effect" } else { "correction" }
}

fn one_quantity(points: &[SeriesPoint]) -> String {
    let Some(first) = points.first() else { return String::new() };
    let cells: Vec<&[SeriesPoint]> = points.chunk_by(|one, other| one.key() == other.key()).collect();
    let values = cell_values(&cells);
    let summaries = compare(&values);
    let over = Range::of(points.iter().map(|point| point.value));
    let times = Range::of(points.iter().filter_map(|point| moment(&point.time)));
    let unit = if first.unit.is_empty() { String::new() } else { format!(", {}", escaped(&first.unit)) };
    let mut text = format!("<h2>{}{unit}</h2>", escaped(&first.what.replace('_', " ")));
    if values.len() > 1 {
        let _ = write!(
            text,
            "<figure class=\"wide\"><figcaption>Machine beside machine: every value, and the mean of each</figcaption>{}</figure>",
            chart::beside(&values, over, &escaped(&first.unit))
        );
        text.push_str(&summary_table(&summaries));
    }
    text.push_str("<h2>Over time</h2><div class=\"charts\">");
    for (cell, summary) in values.iter().zip(&summaries) {
        text.push_str(&cell_chart(cell, summary, over, times, &first.unit));
    }
    text.push_str("</div>");
    text
}

fn cell_chart(cell: &CellValues, summary: &CellSummary, over: Range, times: Range, unit: &str) -> String {
    let limits = summary.limits;
    let words = match limits {
        Some(ControlLimits { lower, upper, .. }) => {
            format!("control limits {} to {}, {} outside", number(lower), number(upper), summary.outside)
        }
        None => format!(
            "no control limits: they need {FEWEST_VALUES} values that differ, here are {}",
            summary.count
        ),
    };
    format!(
        "<figure><figcaption>{}</figcaption>{}<span class=\"small\">{words}</span></figure>",
        escaped(&cell.cell),
        chart::trend(cell, limits, over, times, unit)
    )
}

fn summary_table(summaries: &[CellSummary]) -> String {
    let heads = ["values", "mean", "deviation", "newest", "outside", "from the others, sigmas"];
    let heads: String =
        heads.iter().map(|head| format!("<th class=\"number\" scope=\"col\">{head}</th>")).collect();
    let mut text = format!(
        "<div class=\"wide\"><table><thead><tr><th scope=\"col\">cell</th>{heads}</tr></thead><tbody>"
    );
    for cell in summaries {
        let optional = |value: Option<f64>| value.map_or_else(|| "not known".to_owned(), number);
        let different = cell.from_others.is_some_and(|sigmas| sigmas.abs() > DIFFERENT_SIGMAS);
        let class = if different { " different" } else { "" };
        let from_others =
            cell.from_others.map_or_else(|| "not known".to_owned(), |sigmas| format!("{sigmas:+.1}"));
        let _ = write!(text, "<tr data-row tabindex=\"0\"><td>{}</td>", escaped(&cell.cell));
        let numbers = [
            cell.count.to_string(),
            number(cell.mean),
            optional(cell.deviation),
            number(cell.last),
            cell.outside.to_string(),
        ];
        for number in numbers {
            let _ = write!(text, "<td class=\"number\">{number}</td>");
        }
        let _ = write!(text, "<td class=\"number{class}\">{from_others}</td></tr>");
    }
    text.push_str("</tbody></table></div><p class=\"small\">Sigmas: the mean of a cell less the median of all cells' means, in standard deviations within cells.</p>");
    text
}

/// Something went wrong, as a page.
pub(super) fn trouble(title: &str, reason: &str) -> String {
    page(title, "", true, &format!("<h2>{}</h2><p>{}</p>", escaped(title), escaped(reason)))
}

/// Text as a part of an address (RFC 3986, unreserved characters stay).
fn in_address(text: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~".contains(&byte);
    text.bytes()
        .map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") })
        .collect()
}

fn page(title: &str, here: &str, live: bool, body: &str) -> String {
    let link = |to: &str, name: &str| {
        let current = if here == name { " aria-current=\"page\"" } else { "" };
        format!("<a href=\"{to}\"{current}>{name}</a>")
    };
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <title>{}</title><link rel=\"icon\" href=\"data:,\"><link rel=\"stylesheet\" href=\"fleet.css\"><script src=\"fleet.js\" defer></script></head>\n\
         <body data-live=\"{}\"><header><h1>plumb fleet</h1><nav aria-label=\"Pages\">{}{}</nav><p id=\"connection\" role=\"status\" class=\"small\"></p></header>\n\
         <main>{body}</main>\n<footer>Read only: prompts are answered on each cell's own page, or at the cell. <kbd>j</kbd> and <kbd>k</kbd>, or the arrows, go from row to row.</footer></body></html>\n",
        escaped(title),
        if live { "yes" } else { "no" },
        link("./", "cells"),
        link("trends", "trends")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_cell_says_is_text_and_not_markup() {
        let quantity = Quantity {
            name: "<script>(a b&c)".to_owned(),
            is_effect: true,
            arm: "\"x\"".to_owned(),
            cells: 2,
            values: 9,
        };
        let text = quantities(&[quantity]);
        assert!(!text.contains("<script>(") && text.contains("&lt;script&gt;"), "{text}");
        assert!(text.contains("trend?effect=%3Cscript%3E%28a%20b%26c%29&amp;arm=%22x%22\""), "{text}");
        assert!(trouble("<b>", "<i>").contains("&lt;b&gt;"));
    }
}
