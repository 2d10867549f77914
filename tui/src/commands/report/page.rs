//! A report as a page of HTML that needs no other file.

use super::words::Grid;

const STYLE: &str = "body{font:15px/1.5 sans-serif;max-width:64em;margin:2em auto;padding:0 1em;color:#222}\
h1{font-size:1.5em}h2{font-size:1.1em;margin-top:1.6em;border-bottom:1px solid #999}\
table{border-collapse:collapse;margin:.6em 0}td,th{padding:.15em .9em .15em 0;text-align:right;font-variant-numeric:tabular-nums}\
td:first-child,th:first-child{text-align:left}th{border-bottom:1px solid #bbb}svg{max-width:100%;height:auto}.faint{color:#666}@media print{body{margin:0}}";

/// What a page is made of.
pub(super) struct Page {
    pub(super) title: String,
    pub(super) lines: Vec<String>,
    pub(super) grids: Vec<Grid>,
    pub(super) drawing: Option<String>,
    pub(super) budget: Option<(Grid, String)>,
    pub(super) notes: Vec<String>,
}

/// Text within tags of HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

fn table(grid: &Grid) -> String {
    let cells = |row: &[String], tag: &str| -> String {
        row.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect()
    };
    let rows: String = grid.rows.iter().map(|row| format!("<tr>{}</tr>\n", cells(row, "td"))).collect();
    let title = match grid.title {
        "" => String::new(),
        title => format!("<h2>{}</h2>\n", escaped(title)),
    };
    format!("{title}<table>\n<tr>{}</tr>\n{rows}</table>\n", cells(&grid.head, "th"))
}

impl Page {
    /// The page.
    pub(super) fn html(&self) -> String {
        let paragraphs: String =
            self.lines.iter().map(|line| format!("<p>{}</p>\n", escaped(line))).collect();
        let mut body = format!("<h1>{}</h1>\n{paragraphs}", escaped(&self.title));
        if let Some((first, others)) = self.grids.split_first() {
            body.push_str(&table(first));
            body.push_str(self.drawing.as_deref().unwrap_or_default());
            body.extend(others.iter().map(table));
        }
        if let Some((grid, sentence)) = &self.budget {
            body.push_str(&table(grid));
            body.push_str(&format!("<p class=\"faint\">{}</p>\n", escaped(sentence)));
        }
        if !self.notes.is_empty() {
            let notes: String =
                self.notes.iter().map(|note| format!("<li>{}</li>\n", escaped(note))).collect();
            body.push_str(&format!("<h2>Notes</h2>\n<ul>\n{notes}</ul>\n"));
        }
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{}</title><style>{STYLE}</style></head>\n<body>\n{body}</body></html>\n",
            escaped(&self.title)
        )
    }
}
