//! Tables of a report, for text and for a page alike.

use plumb_standards::Budget;

/// A table: a heading a column, the cells of each row.
pub(super) struct Grid {
    pub(super) title: &'static str,
    pub(super) head: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
}

impl Grid {
    /// A table of these columns.
    pub(super) fn new(title: &'static str, head: &[&str]) -> Self {
        Self { title, head: head.iter().map(|&one| one.to_owned()).collect(), rows: Vec::new() }
    }

    /// The table as text: the first column to the left, the others to the right.
    pub(super) fn text(&self) -> String {
        let widths: Vec<usize> = (0..self.head.len())
            .map(|column| {
                let cells = self.rows.iter().chain([&self.head]).filter_map(|row| row.get(column));
                cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
            })
            .collect();
        let mut text = String::new();
        if !self.title.is_empty() {
            text.push_str(&format!("\n{}\n", self.title));
        }
        for row in [&self.head].into_iter().chain(&self.rows) {
            let cells = row.iter().zip(&widths).enumerate().map(|(column, (cell, width))| match column {
                0 => format!("{cell:<width$}"),
                _ => format!("{cell:>width$}"),
            });
            let line: Vec<String> = cells.collect();
            text.push_str(&format!("  {}\n", line.join("  ").trim_end()));
        }
        text
    }
}

/// A number with so many decimals; without a minus before zeros.
pub(super) fn number(value: f64, digits: u8) -> String {
    let text = format!("{value:.digits$}", digits = usize::from(digits));
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|letter| "0.".contains(letter)) => rest.to_owned(),
        _ => text,
    }
}

/// A number, or a dash where there is none.
pub(super) fn or_dash(value: Option<f64>, digits: u8) -> String {
    value.map_or_else(|| "-".to_owned(), |value| number(value, digits))
}

/// A commanded position, as short as it can be.
pub(super) fn position(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    format!("{}", rounded + 0.0)
}

/// What an uncertainty is made of.
pub(super) fn budget_grid(budget: &Budget, digits: u8) -> Grid {
    let unit = budget.unit.name();
    let mut grid = Grid::new("Uncertainty budget", &["contribution", unit, "fraction of the variance"]);
    let percent = |fraction: f64| format!("{:.1} %", 100.0 * fraction);
    for one in &budget.components {
        grid.rows.push(vec![one.name.clone(), number(one.standard, digits), percent(one.fraction)]);
    }
    let fraction = budget.covariances / budget.combined.powi(2);
    if fraction.abs() > 1e-3 {
        grid.rows.push(vec!["covariances between these".to_owned(), String::new(), percent(fraction)]);
    }
    grid.rows.push(vec![
        "combined standard uncertainty".to_owned(),
        number(budget.combined, digits),
        String::new(),
    ]);
    grid.rows.push(vec![
        format!("expanded uncertainty (k = {})", budget.k),
        number(budget.expanded, digits),
        String::new(),
    ]);
    grid
}

/// Of which position a budget is, and how it was made.
pub(super) fn budget_sentence(budget: &Budget, digits: u8) -> String {
    let commanded: Vec<String> = budget.commanded.iter().map(|value| position(*value)).collect();
    let [least, greatest] = budget.over_positions.map(|value| number(value, digits));
    format!(
        "After the {} of one positioning that the model predicts, where it is least certain: line {}, joints {}. Over all positions the combined standard uncertainty is {least} to {greatest} {}. \
         The contributions of effects follow from the covariance of the fit to this table.",
        budget.guide,
        budget.line,
        commanded.join(", "),
        budget.unit.name()
    )
}
