//! Rows that a procedure writes: every reading that a model file takes, by the one table of kinds.

use plumb_calibration::table::RowColumn;
use serde_json::json;

use crate::lab::Lab;
use crate::schema::{problems, schema};

/// A procedure that writes one row with these columns, in the place of the one that measures the tip.
fn with_row(columns: &str) -> Lab {
    let lab = Lab::of("scara");
    lab.write(
        "procedures/measure-tip.yaml",
        &format!(
            "procedure: measure-tip\ntitle: One row\nsteps:\n  - {{id: row, do: {{row: {{robot: arm, {columns}}}}}}}\n"
        ),
    );
    lab
}

#[test]
fn a_row_takes_every_reading_of_a_model_file_and_the_table_holds_it() {
    let readings = [
        "p1_azimuth_deg: 31.5",
        "p1_elevation_deg: -4.25",
        "p12_x_m: 0.125",
        "height_mm: 3",
        "distance_mm: 120",
        "tilt_x_deg: 0.5",
        "p1_rx_rad: 0.25",
        "board_x_mm: 7",
        "profile_x_mm: 1",
        "profile_z_mm: 80",
    ];
    let lab = with_row(&readings.join(", "));
    let checked = lab.plumb(&["check", "cell.yaml"]);
    assert_eq!(checked.code(), 0, "{}", checked.all());
    let run = lab.plumb(&["run", "cell.yaml", "measure-tip", "--answers", "answers.yaml"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let table = lab.plumb(&["show", "--table"]).out();
    for reading in readings {
        let (column, value) = reading.split_once(": ").unwrap();
        let mut lines = table.lines().filter(|line| !line.starts_with('#'));
        let index = lines.next().unwrap().split(',').position(|header| header == column);
        let cell = index.and_then(|index| lines.next()?.split(',').nth(index).map(str::to_owned));
        let cell = cell.unwrap_or_else(|| panic!("{column} is not in\n{table}"));
        assert!(
            (cell.parse::<f64>().unwrap() - value.parse::<f64>().unwrap()).abs() < 1e-9,
            "{column}: {cell}"
        );
    }
}

#[test]
fn a_column_that_no_kind_reads_is_refused_with_what_comes_near_or_the_unit_that_is_missing() {
    let refused = |columns: &str| {
        let checked = with_row(columns).plumb(&["check", "cell.yaml"]);
        assert_eq!(checked.code(), 2, "{}", checked.all());
        checked.all()
    };
    let slip = refused("p1_azimut_deg: 3");
    assert!(
        slip.contains("a row has no column `p1_azimut_deg`") && slip.contains("`p1_azimuth_deg`"),
        "{slip}"
    );
    let bare = refused("p1_elevation: 3");
    assert!(bare.contains("the unit is missing: write p1_elevation_deg, p1_elevation_rad"), "{bare}");
    let where_it_was = refused("q1_deg: 3, height_mm: 2");
    assert!(where_it_was.contains("a row has no column `q1_deg`"), "{where_it_was}");
    assert!(refused("payload_kg: 2").contains("this row measures nothing"));
}

#[test]
fn the_schema_of_procedures_lets_a_row_have_every_column_that_is_read() {
    let lab = Lab::of("scara");
    let validator = schema(&lab, "procedure");
    let of = |column: &str| {
        let value = if matches!(RowColumn::of(column), Ok(Some(RowColumn::Word))) {
            json!("table")
        } else {
            json!(1)
        };
        let row = json!({"robot": "arm", column: value});
        problems(
            &validator,
            &json!({"procedure": "one", "title": "One", "steps": [{"id": "row", "do": {"row": row}}]}),
        )
    };
    for column in RowColumn::headers() {
        assert_eq!(of(&column), [""; 0], "{column}");
    }
    assert!(!of("p1_azimut_deg").is_empty() && !of("q1_deg").is_empty());
}
