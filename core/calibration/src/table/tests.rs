//! Reading of tables: units, marks and separators, and what is refused with its place.

mod columns;

use super::scalar::{DISTANCE, HEIGHT};
use super::*;

fn read(text: &str) -> Table {
    Table::parse("t.csv", text).unwrap()
}

fn refused(text: &str) -> String {
    Table::parse("t.csv", text).unwrap_err().to_string()
}

#[test]
fn headers_say_the_units_and_inside_are_radians_and_millimetres() {
    let table = read(
        "q1_deg,q2_rad,q3_mm,p1_x_m,p1_y_in,p1_z_mm,tilt_x_deg,height_in,distance_m\n180,0.5,7,0.1,2,3,-90,1,0.25\n",
    );
    assert!((table.q_of(0)[0] - std::f64::consts::PI).abs() < 1e-15);
    assert_eq!(table.q_of(0)[1..], [0.5, 7.0]);
    assert_eq!(table.positions[0].xyz[0], [100.0, 50.8, 3.0]);
    assert!((table.tilt.as_ref().unwrap()[0][0] + std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    assert_eq!((table.scalar(&HEIGHT).unwrap()[0], table.scalar(&DISTANCE).unwrap()[0]), (25.4, 250.0));
    let in_length: Vec<bool> = table.coordinate_columns.iter().map(|(_, length)| *length).collect();
    assert_eq!(in_length, [false, false, true]);
}

#[test]
fn joints_are_ordered_by_their_numbers_and_targets_by_their_names_whatever_the_columns_order() {
    let table = read("p2_x_mm,q2_deg,p1_x_mm,q1_deg\n20,2,10,1\n");
    let degrees: Vec<f64> = table.q_of(0).iter().map(|q| q.to_degrees()).collect();
    assert!((degrees[0] - 1.0).abs() < 1e-12 && (degrees[1] - 2.0).abs() < 1e-12);
    let x = |target: &str| table.positions.iter().find(|known| known.target == target).unwrap().xyz[0][0];
    assert_eq!((x("p1"), x("p2")), (10.0, 20.0));
    assert!(table.positions[0].xyz[0][1].is_nan(), "what was not measured is not a number");
}

#[test]
fn separators_decimal_commas_line_ends_and_a_byte_order_mark_are_understood() {
    let plain = read("q1_deg,p1_x_mm\n1.5,2.25\n");
    for text in [
        "q1_deg;p1_x_mm\n1,5;2,25\n",
        "q1_deg\tp1_x_mm\n1,5\t2,25\n",
        "q1_deg;p1_x_mm\r\n1.5;2.25\r\n",
        "\u{feff}q1_deg , p1_x_mm\n 1.5 ,2.25\n\n",
        "# of the cell a\n# run 3\nq1_deg,p1_x_mm\n1.5,2.25\n",
    ] {
        let other = read(text);
        assert_eq!((&other.q, other.positions[0].xyz[0][0]), (&plain.q, 2.25), "{text:?}");
    }
    assert_eq!(read("# of the cell a\n# run 3\nq1_deg\n1\n").comments, ["of the cell a", "run 3"]);
}

#[test]
fn rows_are_counted_from_the_header_whatever_ends_a_line() {
    for end in ["\n", "\r\n"] {
        let rows = |third: &str| ["# run 3", "q1_deg,p1_x_mm", "1,2", third, "5,6", ""].join(end);
        assert_eq!(read(&rows("3,4")).lines, [3, 4, 5], "{end:?}");
        let wrong = Table::parse("t.csv", &rows("3,word")).unwrap_err().to_string();
        assert!(wrong.contains("line 4, column 2"), "{end:?}: {wrong}");
    }
}

#[test]
fn utf_16_is_read_in_either_order() {
    let text = "q1_deg,wer\n1,Zo\u{eb}\n";
    let little: Vec<u8> =
        [0xff, 0xfe].into_iter().chain(text.encode_utf16().flat_map(u16::to_le_bytes)).collect();
    let big: Vec<u8> =
        [0xfe, 0xff].into_iter().chain(text.encode_utf16().flat_map(u16::to_be_bytes)).collect();
    let folder = tempfile::tempdir().unwrap();
    for bytes in [little, big, text.as_bytes().to_vec()] {
        let file = folder.path().join("t.csv");
        std::fs::write(&file, bytes).unwrap();
        assert_eq!(Table::read(&file).unwrap().covariates[0].levels(), ["Zo\u{eb}"]);
    }
}

#[test]
fn conditions_names_and_sides_are_kept_row_by_row() {
    let table = read(
        "q1_deg,q2_deg,approach_q2,time_s,temperature_c,payload_kg,session,repeat,on,signal,touch\n\
         1,2,-1,30,21.5,0,am,a,table,on,\n3,4,1,10,,2,pm,b,,,s1\n5,6,,20,22,2,am,a,table,off,\n",
    );
    assert_eq!(table.len(), 3);
    assert_eq!([0, 1, 2].map(|row| table.approach_of(row, 1)), [-1, 1, 0]);
    assert_eq!(table.approach_of(0, 0), 0, "not logged");
    assert_eq!(table.order(), [1, 2, 0], "by time");
    assert!(table.temperature.as_ref().unwrap()[1].is_nan());
    assert_eq!(table.session.names, ["am", "pm"]);
    assert_eq!(table.returns(), [vec![0, 2]], "one visit to b is no return");
    assert_eq!([0, 1, 2].map(|row| table.came_on(row)), [Some(true), None, Some(false)]);
    assert_eq!((table.on.name(0), table.on.name(1), table.touch.name(1)), (Some("table"), None, Some("s1")));
    assert_eq!(table.lines, [2, 3, 4]);
}

#[test]
fn an_unknown_column_is_a_covariate_and_one_nearly_known_is_pointed_out() {
    let table = read("q1_deg,humidity,temprature_c\n1,40,20\n2,45,21\n");
    let names: Vec<&str> = table.covariates.iter().map(|covariate| covariate.name.as_str()).collect();
    assert_eq!(names, ["humidity", "temprature_c"]);
    assert_eq!(table.warnings.len(), 1);
    assert!(table.warnings[0].contains("was `temperature_c` meant?"), "{:?}", table.warnings);
}

#[test]
fn what_cannot_be_a_table_is_refused_with_its_place_and_what_would_be_right() {
    for (text, parts) in [
        ("", ["the file is empty", "name the columns"]),
        ("q1_deg,p1_x_mm\n", ["no rows below the header", "t.csv"]),
        ("1,2\n3,4\n", ["line 1 holds numbers where names belong", "q1_deg"]),
        ("a,b\n1,2\n", ["no joint columns", "p1_x_mm"]),
        ("q1_deg,q3_deg\n1,2\n", ["joint columns go up to q3", "q2 is missing"]),
        ("q1_deg,q1_deg\n1,2\n", ["column 2 (`q1_deg`)", "twice"]),
        ("q1_deg,q1_rad\n1,2\n", ["column 2 (`q1_rad`)", "in another unit"]),
        ("q1,p1_x_mm\n1,2\n", ["column 1 (`q1`)", "q1_deg, q1_rad"]),
        ("q1_deg,approach_q2\n1,1\n", ["there is no q2", "1 joints"]),
        ("q1_deg,p1_x_mm\n1,x\n", ["line 2, column 2 (`p1_x_mm`)", "`x`"]),
        ("q1_deg,p1_x_mm\n,2\n", ["line 2, column 1 (`q1_deg`)", "every joint needs"]),
        ("q1_deg,p1_x_mm\n1,2,3\n", ["line 2: 3 cells", "decimal commas"]),
        ("q1_deg,p1_x_mm\n1.5;2.5\n", ["line 2: 1 cell ", "semicolons"]),
        ("q1_deg,approach_q1\n1,2\n", ["2 is no way of arriving", "1 is one where the coordinate grew"]),
        ("q1_deg,p1_x_mm,std_x_mm\n1,2,0\n", ["a sigma of 0", "above zero"]),
        ("q1_deg,payload_kg\n1,-2\n", ["a load of -2 kg", "line 2"]),
        ("q1_deg,distance_mm\n1,-2\n", ["a distance of -2", "line 2"]),
        ("q1_deg,p1_x_mm\n1,1e12\n", ["too large to be meant", "line 2"]),
        ("q1_deg,on,signal\n1,table,up\n", ["`up` is nothing a sensor does", "`off`"]),
    ] {
        let message = refused(text);
        assert!(parts.iter().all(|part| message.contains(part)), "{text:?}: {message}");
    }
    let wide: Vec<String> = (0..1001).map(|column| format!("c{column}")).collect();
    assert!(refused(&format!("{}\n", wide.join(","))).contains("at most 1000"));
    assert!(refused(&format!("q1_deg\n{}\n", "1".repeat(100_001))).contains("line 2 is longer"));
}
