//! Every column in every unit, what its cells may hold, and helpers of tables in memory.

use crate::table::header::{Meaning, is_in_length, near_miss, parse};
use crate::table::number::{self, DecimalMark};
use crate::table::orientation::{Body, OrientationForm};
use crate::table::scalar::{DISTANCE, HEIGHT};
use crate::table::{CovariateValues, Stretch, Table, table_text};

fn read(text: &str) -> Table {
    Table::parse("t.csv", text).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(text: &str) -> String {
    Table::parse("t.csv", text).unwrap_err().to_string()
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;

#[test]
fn every_header_means_its_quantity_in_inner_units() {
    let rotation = |body, form, part, scale| Meaning::Turn { body, form, part, scale };
    let (quaternion, vector) = (OrientationForm::Quaternion, OrientationForm::RotationVector);
    for (name, meaning) in [
        ("q1_deg", Meaning::Coordinate { joint: 0, scale: DEGREE }),
        ("q12_m", Meaning::Coordinate { joint: 11, scale: 1000.0 }),
        ("q2_in", Meaning::Coordinate { joint: 1, scale: 25.4 }),
        ("p1_x_mm", Meaning::Position { target: 0, axis: 0, scale: 1.0 }),
        ("p3_z_m", Meaning::Position { target: 2, axis: 2, scale: 1000.0 }),
        ("p2_qz", rotation(Body::Target(1), quaternion, 3, 1.0)),
        ("p2_ry_deg", rotation(Body::Target(1), vector, 1, DEGREE)),
        ("board_qw", rotation(Body::Board, quaternion, 0, 1.0)),
        ("board_rz_rad", rotation(Body::Board, vector, 2, 1.0)),
        ("rvec_x_rad", rotation(Body::Board, vector, 0, 1.0)),
        ("flange_qy", rotation(Body::Flange, quaternion, 2, 1.0)),
        ("board_y_m", Meaning::Board { axis: 1, scale: 1000.0 }),
        ("tvec_z_mm", Meaning::Board { axis: 2, scale: 1.0 }),
        ("flange_x_in", Meaning::Flange { axis: 0, scale: 25.4 }),
        ("std_x_mm", Meaning::Std { axis: 0, scale: 1.0 }),
        ("height_m", Meaning::Scalar { scalar: &HEIGHT, target: None, scale: 1000.0 }),
        ("distance_in", Meaning::Scalar { scalar: &DISTANCE, target: None, scale: 25.4 }),
        ("tilt_x_deg", Meaning::Tilt { axis: 0, scale: DEGREE }),
        ("approach_q3", Meaning::Approach { joint: 2 }),
        ("on", Meaning::On),
        ("signal", Meaning::Signal),
        ("distance_to", Meaning::DistanceTo),
        ("touch", Meaning::Touch),
        ("level", Meaning::Level),
        ("time_s", Meaning::Time),
        ("temperature_c", Meaning::Temperature),
        ("payload_kg", Meaning::Payload),
        ("session", Meaning::Session),
        ("repeat", Meaning::Repeat),
        ("humidity", Meaning::Covariate),
        ("q0_deg", Meaning::Covariate),
        ("qx_deg", Meaning::Covariate),
        ("q1_current_a", Meaning::Covariate),
        ("p1_mass_kg", Meaning::Covariate),
        ("board_name", Meaning::Covariate),
        ("rvec_w_rad", Meaning::Covariate),
        ("tvec", Meaning::Covariate),
        ("tilt_z_deg", Meaning::Covariate),
        ("std_w_mm", Meaning::Covariate),
        ("approach_speed", Meaning::Covariate),
    ] {
        assert_eq!(parse(name), Ok(meaning), "{name}");
    }
}

#[test]
fn a_quantity_in_no_unit_or_the_wrong_one_is_refused_with_its_units() {
    for (name, part) in [
        ("q1_kg", "`q1_kg` has no unit a joint can have; units are deg, rad (mm, m, in if it slides)"),
        ("p1_x_deg", "`p1_x_deg` has no unit this quantity can have; units are mm, m, in"),
        ("tilt_x_mm", "units are deg, rad"),
        ("tilt_y", "the unit is missing: write tilt_y_deg, tilt_y_rad"),
        ("std_x", "the unit is missing: write std_x_mm, std_x_m, std_x_in"),
        ("height", "the unit is missing: write height_mm"),
        ("distance", "the unit is missing: write distance_mm"),
        ("board_x", "the unit is missing: write board_x_mm"),
        ("flange_y", "the unit is missing: write flange_y_mm"),
        ("flange_rx", "write flange_rx_rad or flange_rx_deg"),
        ("rvec_x", "write rvec_x_rad or rvec_x_deg"),
        ("time", "write time_s"),
        ("temperature", "write temperature_c"),
        ("payload", "write payload_kg"),
    ] {
        let message = parse(name).unwrap_err();
        assert!(message.contains(part), "{name}: {message}");
    }
}

#[test]
fn columns_that_say_the_same_share_a_slot_and_no_others_do() {
    let all = [
        "q1_deg",
        "q2_deg",
        "p1_x_mm",
        "p1_y_mm",
        "p2_x_mm",
        "p1_qw",
        "p1_qx",
        "p2_qw",
        "p1_rx_rad",
        "board_qw",
        "board_rx_rad",
        "flange_qw",
        "flange_rx_rad",
        "board_x_mm",
        "board_y_mm",
        "flange_x_mm",
        "std_x_mm",
        "std_y_mm",
        "height_mm",
        "distance_mm",
        "tilt_x_deg",
        "tilt_y_deg",
        "approach_q1",
        "approach_q2",
        "on",
        "signal",
        "distance_to",
        "touch",
        "level",
        "time_s",
        "temperature_c",
        "payload_kg",
        "session",
        "repeat",
    ];
    let slots: Vec<_> = all.map(|name| parse(name).unwrap().slot().unwrap()).to_vec();
    for (one, first) in slots.iter().enumerate() {
        for (other, second) in slots.iter().enumerate() {
            assert_eq!(first == second, one == other, "{} and {}", all[one], all[other]);
        }
    }
    for (one, other) in
        [("q1_deg", "q1_rad"), ("p1_x_mm", "p1_x_m"), ("height_mm", "height_in"), ("tvec_x_mm", "board_x_m")]
    {
        assert_eq!(parse(one).unwrap().slot(), parse(other).unwrap().slot(), "{one} and {other}");
    }
    assert_eq!(Meaning::Covariate.slot(), None);
}

#[test]
fn lengths_and_slips_of_the_pen_are_recognized() {
    assert!(is_in_length("q2_mm") && is_in_length("x_in") && !is_in_length("q2_deg") && !is_in_length("mm"));
    assert_eq!(near_miss("Temprature_c", 2).as_deref(), Some("temperature_c"));
    assert_eq!(near_miss("approch_q2", 2).as_deref(), Some("approach_q2"));
    assert_eq!(near_miss("om", 2), None, "two letters are too few to be a slip");
}

#[test]
fn cells_become_numbers_by_the_tables_own_mark() {
    let point = |text: &str| number::parse(text, DecimalMark::Point);
    assert_eq!((point(" 1e3 "), point("-0.5"), point("+2")), (Ok(1000.0), Ok(-0.5), Ok(2.0)));
    assert!(point("1.2.3").unwrap_err().contains("is not a number"));
    assert_eq!(number::parse("1.5", DecimalMark::Comma), Ok(1.5), "points are read in either");
    assert!(number::parse("1,5,0", DecimalMark::Comma).unwrap_err().contains("is not a number"));
}

#[test]
fn every_kind_of_column_is_stored_in_its_place() {
    let table = read(
        "q1_deg,q2_mm,p1_y_mm,p2_z_m,std_y_mm,height_mm,on,tilt_y_deg,level,distance_mm,distance_to,board_y_m,approach_q1,approach_q2,payload_kg\n\
         90,5,1,0.002,0.1,3,table,4,foot,6,nail,0.007,-1,1,0.5\n45,,,,,,,,,,,,,,\n"
            .replace("45,,", "45,6,")
            .as_str(),
    );
    assert!((table.q_of(0)[0] - 90.0 * DEGREE).abs() < 1e-15 && table.q_of(0)[1] == 5.0);
    let nan = |row: [f64; 3]| row.map(|part| if part.is_nan() { -1.0 } else { part });
    assert_eq!(nan(table.positions[0].xyz[0]), [-1.0, 1.0, -1.0]);
    assert_eq!(nan(table.positions[1].xyz[0]), [-1.0, -1.0, 2.0]);
    assert_eq!(nan(table.std.as_ref().unwrap()[0]), [-1.0, 0.1, -1.0]);
    assert_eq!(nan(table.board.as_ref().unwrap()[0]), [-1.0, 7.0, -1.0]);
    assert!((table.tilt.as_ref().unwrap()[0][1] - 4.0 * DEGREE).abs() < 1e-15);
    assert_eq!((table.scalar(&HEIGHT).unwrap()[0], table.scalar(&DISTANCE).unwrap()[0]), (3.0, 6.0));
    assert_eq!(
        (table.on.name(0), table.level.name(0), table.distance_to.name(0)),
        (Some("table"), Some("foot"), Some("nail"))
    );
    assert_eq!([0, 1].map(|joint| table.approach_of(0, joint)), [-1, 1]);
    assert_eq!(table.payload.as_ref().unwrap()[0], 0.5);
    // The second row measured nothing.
    assert!(nan(table.positions[0].xyz[1]) == [-1.0; 3] && table.scalar(&HEIGHT).unwrap()[1].is_nan());
    assert_eq!((table.on.name(1), table.approach_of(1, 0), table.q_of(2).len()), (None, 0, 0));
    let again = read(&table_text(&table));
    assert_eq!(table_text(&again), table_text(&table), "written and read it is the same");
    assert_eq!((again.level.name(0), again.approach_of(0, 1)), (Some("foot"), 1));
    assert!((again.board.unwrap()[0][1] - 7.0).abs() < 1e-12);
}

#[test]
fn values_from_both_sides_of_what_can_be() {
    for (text, good) in [
        ("q1_deg,p1_x_mm\n1,1e9\n", true),
        ("q1_deg,p1_x_mm\n1,-1.1e9\n", false),
        ("q1_deg,p1_x_mm\n1e12,1\n", false),
        ("q1_deg,payload_kg\n1,0\n", true),
        ("q1_deg,distance_mm\n1,0\n", true),
        ("q1_deg,p1_x_mm,std_x_mm\n1,1,1e-9\n", true),
        ("q1_deg,approach_q1\n1,-1\n", true),
        ("q1_deg,approach_q1\n1,0.5\n", false),
        ("q1_deg,height_mm\n1,-5\n", true),
        ("q1_deg,on,signal\n1,table,\n", true),
    ] {
        assert_eq!(Table::parse("t.csv", text).is_ok(), good, "{text}");
    }
    let wide = |count: usize| {
        let names: Vec<String> = (1..count).map(|column| format!("c{column}")).collect();
        format!("q1_deg,{}\n{}\n", names.join(","), vec!["1"; count].join(","))
    };
    assert!(Table::parse("t.csv", &wide(1000)).is_ok() && Table::parse("t.csv", &wide(1001)).is_err());
    let long = |length: usize| format!("q1_deg,note\n1,{}\n", "x".repeat(length - 2));
    assert!(Table::parse("t.csv", &long(100_000)).is_ok() && Table::parse("t.csv", &long(100_001)).is_err());
}

#[test]
fn all_headers_that_cannot_be_read_are_reported_at_once() {
    let message = refused("q1,p1_x,time\n1,2,3\n");
    assert!(message.contains("3 columns of line 1 cannot be read"), "{message}");
    for part in ["column 1 (`q1`)", "column 2 (`p1_x`)", "column 3 (`time`)"] {
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn of_rows_of_a_wrong_length_it_is_said_what_may_have_gone_wrong() {
    let longer = refused("q1_deg,p1_x_mm\n1,2,x\n");
    assert!(longer.contains("give every row one cell a column"), "words are no decimals: {longer}");
    let shorter = refused("q1_deg,p1_x_mm\n1\n");
    assert!(shorter.contains("line 2: 1 cell where the header has 2; give every row one cell"), "{shorter}");
    let commas = refused("q1_deg,p1_x_mm\n1,-5,2,5\n");
    assert!(commas.contains("if the commas are decimal commas"), "{commas}");
    let semicolons = refused("q1_deg;p1_x_mm\n1;2;3\n");
    assert!(semicolons.contains("give every row one cell a column"), "{semicolons}");
}

#[test]
fn a_column_left_out_is_nothing_and_many_words_are_warned_of() {
    let rows: String = (0..14).map(|row| format!("{row},w{row},{row}\n")).collect();
    let table = read(&format!("q1_deg,note,load\n{rows}"));
    assert!(
        table.warnings.iter().any(|warning| warning.contains("`note` holds more than 12 different words")),
        "{:?}",
        table.warnings
    );
    assert!(matches!(&table.covariates[1].values, CovariateValues::Numeric(values) if values.len() == 14));
    let steps = read(&format!("q1_deg,step,load\n{rows}"));
    assert_eq!(
        steps.warnings,
        [] as [String; 0],
        "the column that names the step of each row is plumb's own"
    );
    let likely = read("q1_deg,X [mm]\n1,2\n");
    assert!(likely.warnings[0].contains("was `p1_x_mm` meant?"), "{:?}", likely.warnings);
}

#[test]
fn a_word_that_holds_a_separator_is_quoted_when_it_is_written() {
    let table = read("q1_deg,on,fixture\n1,\"a, b\",\"say \"\"so\"\"\"\n");
    let text = table_text(&table);
    assert!(text.contains("\"a, b\"") && text.contains("\"say \"\"so\"\"\""), "{text}");
    let again = read(&text);
    assert_eq!(
        (again.on.name(0), again.covariates[0].levels()),
        (Some("a, b"), &["say \"so\"".to_owned()][..])
    );
}

#[test]
fn what_a_table_saw_is_known_by_its_columns() {
    let plain = read("q1_deg,p1_x_mm\n1,2\n");
    assert!(!plain.sees_a_board() && !plain.is_of_stripes() && !plain.is_empty());
    assert!(read("q1_deg,board_x_mm\n1,2\n").sees_a_board());
    let turned = read("q1_deg,board_rx_rad,board_ry_rad,board_rz_rad\n1,0,0,1\n");
    assert!(
        turned.sees_a_board()
            && turned.rotation_of(Body::Board, 0).is_some()
            && turned.rotation_of(Body::Target(0), 0).is_none()
    );
    assert!(turned.orientations_of("board").is_none(), "a board is no target");
    let mut seen = plain.clone();
    seen.stretches = vec![Stretch::new(0, 0, vec![[0.0; 2]; 3], 1.0)];
    seen.speed = Some(vec![0.25]);
    assert!(seen.is_of_stripes());
    assert_eq!(
        (seen.speed_of(0).to_vec(), seen.speed_of(1).len(), plain.speed_of(0).len()),
        (vec![0.25], 0, 0)
    );
    let bodies = read("q1_deg,p2_qw,p2_qx,p2_qy,p2_qz\n1,1,0,0,0\n");
    assert!(bodies.orientations_of("p2").is_some() && bodies.orientations_of("p1").is_none());
    assert_eq!(plain.positions[0].empty().xyz.len(), 0);
}

#[test]
fn a_row_that_is_noted_has_what_it_lies_on_and_nothing_else() {
    let mut table = Table::default();
    table.note(Some("table"), None);
    table.note(None, Some("nail"));
    assert_eq!((table.on.name(0), table.on.name(1)), (Some("table"), None));
    assert_eq!((table.distance_to.name(0), table.distance_to.name(1)), (None, Some("nail")));
    assert!(
        table.touch.of_row == [None, None]
            && table.session.of_row == [None, None]
            && table.repeat.of_row == [None, None]
    );
}

#[test]
fn speeds_are_those_of_the_row_and_none_where_none_were_logged() {
    let table = Table { joints: 2, speed: Some(vec![1.0, 2.0, 3.0, 4.0]), ..Table::default() };
    assert_eq!((table.speed_of(0), table.speed_of(1)), (&[1.0, 2.0][..], &[3.0, 4.0][..]));
    assert!(table.speed_of(2).is_empty() && Table::default().speed_of(0).is_empty());
}

#[test]
fn a_board_is_seen_in_rows_with_a_place_or_an_orientation_of_it() {
    let table =
        Table::parse("t.csv", "q1_deg,board_x_mm,board_y_mm,board_z_mm\n0,1,2,3\n1,,,\n2,,5,\n").unwrap();
    assert_eq!([0, 1, 2, 3].map(|row| table.sees_a_board_in(row)), [true, false, true, false]);
    let turned =
        Table::parse("t.csv", "q1_deg,board_rx_rad,board_ry_rad,board_rz_rad\n0,0.1,0,0\n1,,,\n").unwrap();
    assert_eq!([0, 1].map(|row| turned.sees_a_board_in(row)), [true, false]);
    let none = Table::parse("t.csv", "q1_deg,p1_x_mm\n0,1\n").unwrap();
    assert!(!none.sees_a_board_in(0) && !none.sees_a_board());
}

#[test]
fn the_numbers_of_a_quaternion_and_of_a_rotation_vector_have_slots_of_their_own() {
    for body in [Body::Target(1), Body::Flange, Body::Board] {
        let slot = |form, part| Meaning::Turn { body, form, part, scale: 1.0 }.slot();
        let quaternion = (0..4).map(|part| slot(OrientationForm::Quaternion, part));
        let vector = (0..3).map(|part| slot(OrientationForm::RotationVector, part));
        let mut all: Vec<_> = quaternion.chain(vector).collect();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 7, "{body:?}");
    }
}
