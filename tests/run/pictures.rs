//! Pictures from a folder that hold no stripe, or cannot be read: through the whole program, each with its sentence and without a point.

use std::fs;

use crate::lab::Lab;

const SIZE: usize = 96;

/// A cell whose sensor looks at pictures of a folder.
fn cell(pictures: &[(&str, Vec<u8>)]) -> Lab {
    let lab = Lab::of("light-stripe");
    fs::create_dir(lab.path("pictures")).unwrap();
    for (name, bytes) in pictures {
        fs::write(lab.path("pictures").join(name), bytes).unwrap();
    }
    let stripe = "{plugin: light-stripe, config: {frames: {folder: pictures}, threshold: {fixed: 60}}}";
    let looks = "[{id: look, do: {measure: {sensor: stripe}}, on_error: abort}, {id: again, do: {measure: {sensor: stripe}}, on_error: abort}]";
    lab.write("pictures.yaml", &format!("cell: pictures\ntitle: Pictures\ndevices: {{stripe: {stripe}}}\nprocedures: [look.yaml, look-twice.yaml]\n"));
    lab.write("look.yaml", "procedure: look\ntitle: Look\nsteps: [{id: look, do: {measure: {sensor: stripe}}, on_error: abort}]\n");
    lab.write("look-twice.yaml", &format!("procedure: look-twice\ntitle: Look twice\nsteps: {looks}\n"));
    lab
}

fn pgm(width: usize, lit: impl Fn(usize, usize) -> bool) -> Vec<u8> {
    let mut bytes = format!("P5\n{width} {SIZE}\n255\n").into_bytes();
    for row in 0..SIZE {
        bytes.extend((0..width).map(|column| if lit(row, column) { 200 } else { 5 }));
    }
    bytes
}

/// What the sensor has made of a picture: its rows with a point, and the fault.
fn seen(picture: Vec<u8>) -> (f64, f64) {
    let lab = cell(&[("a.pgm", picture)]);
    let output = lab.plumb(&["run", "pictures.yaml", "look", "--headless", "--json"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let value = |name: &str| {
        let events = output.out();
        let mut values = events.lines().filter_map(|line| {
            let event: serde_json::Value = serde_json::from_str(line).unwrap();
            let values = event["values"].as_array()?.clone();
            values.iter().find(|value| value["name"] == name)?["value"].as_f64()
        });
        values.next().unwrap_or(f64::NAN)
    };
    (value("rows"), value("fault"))
}

#[test]
fn pictures_without_one_stripe_give_a_fault_and_no_point() {
    let near = |column: usize, middle: usize| column.abs_diff(middle) <= 1;
    let cases: [(&str, Vec<u8>, f64); 5] = [
        ("empty", pgm(SIZE, |_, _| false), 1.0),
        ("all white", pgm(SIZE, |_, _| true), 2.0),
        ("two of one height", pgm(SIZE, |_, column| near(column, 20) || near(column, 60)), 5.0),
        ("lying flat", pgm(SIZE, |row, column| near(row, 40) && column > 5), 4.0),
        ("short", pgm(SIZE, |row, column| row < 5 && near(column, 20)), 3.0),
    ];
    for (name, picture, fault) in cases {
        assert_eq!(seen(picture), (0.0, fault), "{name}");
    }
    // Broken, its tallest piece is the stripe; what is joined to it is cut off.
    let broken = pgm(SIZE, |row, column| near(column, 20) && !(40..44).contains(&row));
    assert_eq!(seen(broken), (52.0, 0.0));
    let spur =
        pgm(SIZE, |row, column| near(column, 20) || ((50..52).contains(&row) && (20..60).contains(&column)));
    assert_eq!(seen(spur), (96.0, 0.0));
}

#[test]
fn pictures_that_cannot_be_used_end_an_unattended_run_with_what_is_wrong() {
    let stripe = pgm(SIZE, |_, column| column.abs_diff(20) <= 1);
    let cut = stripe[..stripe.len() - 100].to_vec();
    let other = pgm(SIZE + 8, |_, column| column.abs_diff(20) <= 1);
    let cases = [
        (vec![("a.pgm", cut)], "a.pgm: it is cut short"),
        (
            vec![("a.pgm", stripe.clone()), ("b.pgm", other)],
            "b.pgm: its size is 104 x 96; the pictures before it have 96 x 96",
        ),
        (vec![("a.png", b"\x89PNG\r\n\x1a\n".to_vec())], "a.png: "),
        (Vec::new(), "holds no pictures"),
    ];
    for (pictures, sentence) in cases {
        let lab = cell(&pictures);
        let output = lab.plumb(&["run", "pictures.yaml", "look-twice", "--headless"]);
        assert!(
            output.code() == 2 && output.all().contains(sentence),
            "{sentence}: {} {}",
            output.code(),
            output.all()
        );
    }
}
