//! Writing a measurement table: every column the reader knows, with units in the header.

use std::fmt::Write as _;

use super::orientation::quaternion;
use super::scalar::SCALARS;
use super::{Covariate, CovariateValues, Names, Table};

/// One column: its header, and its cells.
struct Column<'t> {
    header: String,
    cell: Box<dyn Fn(usize) -> String + 't>,
}

impl<'t> Column<'t> {
    fn new(header: impl Into<String>, cell: impl Fn(usize) -> String + 't) -> Self {
        Self { header: header.into(), cell: Box::new(cell) }
    }
}

/// The table as CSV; a number that was not measured is an empty cell.
pub fn table_text(table: &Table) -> String {
    let mut columns = coordinates(table);
    columns.extend(positions(table));
    columns.extend(orientations(table));
    columns.extend(profiles(table));
    columns.extend(numbers(table));
    columns.extend(words(table));
    columns.extend(
        table
            .covariates
            .iter()
            .map(|covariate| Column::new(word(&covariate.name), move |row| covariate_cell(covariate, row))),
    );
    let headers: Vec<&str> = columns.iter().map(|column| column.header.as_str()).collect();
    let mut text = headers.join(",") + "\n";
    for row in 0..table.len() {
        let cells: Vec<String> = columns.iter().map(|column| (column.cell)(row)).collect();
        // Writing to a text cannot fail.
        let _ = writeln!(text, "{}", cells.join(","));
    }
    text
}

fn number(value: f64) -> String {
    if value.is_finite() { format!("{value}") } else { String::new() }
}

/// A word as a cell: quoted where it holds what separates cells.
fn word(text: &str) -> String {
    match text.contains([',', '"', ';', '\n']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}

/// Joint coordinates, and the sides they arrived from.
fn coordinates(table: &Table) -> Vec<Column<'_>> {
    // Sides are written where they were logged: a column of zeros would say that they were, and were not known.
    let sides = if table.approach.is_some() { table.joints } else { 0 };
    (0..table.joints)
        .map(|joint| coordinate(table, joint))
        .chain((0..sides).map(|joint| {
            Column::new(format!("approach_q{}", joint + 1), move |row| {
                table.approach_of(row, joint).to_string()
            })
        }))
        .collect()
}

/// The column of one joint: degrees, or mm of a slide.
fn coordinate(table: &Table, joint: usize) -> Column<'_> {
    let slides = table.coordinate_columns.get(joint).is_some_and(|(_, is_length)| *is_length);
    Column::new(format!("q{}_{}", joint + 1, if slides { "mm" } else { "deg" }), move |row| {
        let q = table.q_of(row).get(joint).copied().unwrap_or(f64::NAN);
        number(if slides { q } else { q.to_degrees() })
    })
}

/// One part of a column of several numbers; empty where it was not measured.
fn part<const N: usize>(rows: &[[f64; N]], row: usize, axis: usize) -> f64 {
    rows.get(row).and_then(|parts| parts.get(axis)).copied().unwrap_or(f64::NAN)
}

/// Positions of targets with their sigmas, and tilts.
fn positions(table: &Table) -> Vec<Column<'_>> {
    let mut columns = Vec::new();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        for position in &table.positions {
            let header = format!("{}_{name}_mm", position.target);
            columns.push(Column::new(header, move |row| number(part(&position.xyz, row, axis))));
        }
        if let Some(std) = &table.std {
            columns.push(Column::new(format!("std_{name}_mm"), move |row| number(part(std, row, axis))));
        }
        // A level gives no heading: of tilts there are two.
        if let Some(tilt) = table.tilt.as_ref().filter(|_| axis < 2) {
            let header = format!("tilt_{name}_deg");
            columns.push(Column::new(header, move |row| number(part(tilt, row, axis).to_degrees())));
        }
    }
    columns
}

/// Where a board was seen, and orientations, as quaternions.
fn orientations(table: &Table) -> Vec<Column<'_>> {
    let mut columns = Vec::new();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        if let Some(board) = &table.board {
            columns.push(Column::new(format!("board_{name}_mm"), move |row| number(part(board, row, axis))));
        }
    }
    for known in &table.orientations {
        // Whatever form they were read in: a quaternion needs no unit and no branch.
        for (part, name) in ["qw", "qx", "qy", "qz"].into_iter().enumerate() {
            columns.push(Column::new(format!("{}_{name}", known.body.name()), move |row| {
                let rotation = known.rotations.get(row).copied().flatten();
                rotation.map_or_else(String::new, |rotation| number(quaternion(&rotation)[part]))
            }));
        }
    }
    columns
}

/// Points of profiles.
fn profiles(table: &Table) -> Vec<Column<'_>> {
    let mut columns = Vec::new();
    for known in &table.profiles {
        for (part, name) in ["x", "z"].into_iter().enumerate() {
            let cell = move |row: usize| {
                number(known.xz.get(row).and_then(|point| point.get(part)).copied().unwrap_or(f64::NAN))
            };
            columns.push(Column::new(format!("{}_{name}_mm", known.name()), cell));
        }
    }
    columns
}

/// Other numbers, and what the arm's own sensor did.
fn numbers(table: &Table) -> Vec<Column<'_>> {
    let read = SCALARS.iter().flat_map(|scalar| table.scalars.iter().filter(|one| one.scalar == *scalar));
    let mut columns: Vec<Column<'_>> = read
        .map(|column| {
            Column::new(column.header(), move |row| {
                number(column.scalar.shown(column.values.get(row).copied().unwrap_or(f64::NAN)))
            })
        })
        .collect();
    let known =
        [("time_s", &table.time), ("temperature_c", &table.temperature), ("payload_kg", &table.payload)];
    let there = known.into_iter().filter_map(|(header, values)| Some((header, values.as_ref()?)));
    columns.extend(there.map(|(header, values)| {
        Column::new(header, move |row| number(values.get(row).copied().unwrap_or(f64::NAN)))
    }));
    if let Some(signal) = &table.signal {
        columns.push(Column::new("signal", move |row| match signal.get(row).copied().flatten() {
            Some(true) => "on".to_owned(),
            Some(false) => "off".to_owned(),
            None => String::new(),
        }));
    }
    columns
}

/// Names of surfaces, levels, places, sessions and returns.
fn words(table: &Table) -> Vec<Column<'_>> {
    let known: [(&str, &Names); 7] = [
        ("on", &table.on),
        ("level", &table.level),
        ("board", &table.board_seen),
        ("distance_to", &table.distance_to),
        ("touch", &table.touch),
        ("session", &table.session),
        ("repeat", &table.repeat),
    ];
    let there = known.into_iter().filter(|(_, names)| !names.names.is_empty());
    there.map(|(header, names)| Column::new(header, move |row| word(names.name(row).unwrap_or("")))).collect()
}

fn covariate_cell(covariate: &Covariate, row: usize) -> String {
    match &covariate.values {
        CovariateValues::Numeric(values) => number(values.get(row).copied().unwrap_or(f64::NAN)),
        CovariateValues::Categorical { levels, of_row } => {
            let level = of_row.get(row).copied().flatten().and_then(|level| levels.get(usize::from(level)));
            level.map_or_else(String::new, |level| word(level))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_that_is_written_reads_as_it_was() {
        let text = "q1_deg,q2_mm,p1_x_mm,p1_y_mm,p1_z_mm,std_x_mm,std_y_mm,std_z_mm,distance_mm,distance_to,time_s,temperature_c,\
                    payload_kg,session,approach_q1,approach_q2,repeat,humidity,fixture\n\
                    10,20,1,2,,0.1,0.1,0.1,500.25,anchor,5,21.5,0.5,a,1,-1,r1,40,left\n\
                    -30.5,25.125,1.5,2.5,3.5,0.1,0.1,0.2,,,6,22,0.5,b,0,1,,41,right\n";
        let table = Table::parse("table.csv", text).unwrap();
        let written = table_text(&table);
        let again = Table::parse("again.csv", &written).unwrap();
        assert_eq!(table_text(&again), written);
        let cells = |text: &str| text.lines().map(|line| line.split(',').count()).collect::<Vec<_>>();
        assert_eq!(cells(&written), cells(text));
        assert_eq!(again.q_of(1).to_vec(), table.q_of(1).to_vec());
        assert!(written.contains("500.25") && written.contains("left") && written.contains("approach_q2"));
        assert!(again.positions[0].xyz[0][2].is_nan());
    }
}
