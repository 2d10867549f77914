//! The same measurements in other units and as spreadsheets write them: the same fit.

use plumb_diagnosis::laboratory::Options;
use plumb_estimation::Progress;

use super::made_up::{TWO_LINKS, Xorshift, laboratory, two_links_tip};

/// Values of one table: shoulder and elbow in degrees, x and y in mm.
fn measured() -> Vec<[f64; 4]> {
    let mut rng = Xorshift::seeded(11);
    let mut row = || {
        let (shoulder, elbow) = (rng.between(-100.0, 100.0), rng.between(-100.0, 100.0));
        let (x, y) = two_links_tip(shoulder + 0.3, elbow - 0.2);
        [shoulder, elbow, x + rng.noise(0.02), y + rng.noise(0.02)]
    };
    (0..30).map(|_| row()).collect()
}

fn fitted(table: &str) -> Vec<f64> {
    let model = TWO_LINKS.replace("free: []", "free: [joint_zero(*)]");
    let found = laboratory(&model, table, Options::default()).compare(&Progress::unwatched()).unwrap();
    let mut numbers: Vec<f64> = found.effects.iter().map(|effect| effect.size).collect();
    numbers.push(found.rms_mm.fit);
    numbers
}

/// A table with this header, scale per column, separator, decimal mark and line end.
fn written(header: [&str; 4], scales: [f64; 4], separator: &str, mark: &str, end: &str) -> String {
    let mut text = header.join(separator) + end;
    for row in measured() {
        let cells: Vec<String> = row
            .iter()
            .zip(scales)
            .map(|(value, scale)| format!("{:.9}", value * scale).replace('.', mark))
            .collect();
        text.push_str(&(cells.join(separator) + end));
    }
    text
}

#[test]
fn units_and_dialects_change_nothing() {
    let plain = ["q1_deg", "q2_deg", "p1_x_mm", "p1_y_mm"];
    let ones = [1.0; 4];
    let expected = fitted(&written(plain, ones, ",", ".", "\n"));
    assert!((expected[0] - 0.3).abs() < 0.02 && (expected[1] + 0.2).abs() < 0.02, "{expected:?}");
    let radian = 1.0_f64.to_radians();
    let others = [
        written(
            ["q1_rad", "q2_rad", "p1_x_m", "p1_y_in"],
            [radian, radian, 1e-3, 1.0 / 25.4],
            ",",
            ".",
            "\n",
        ),
        format!("\u{feff}{}", written(plain, ones, ";", ",", "\r\n")),
        written(plain, ones, "\t", ".", "\r\n"),
        format!("{}\n;;;\n\n", written(plain, ones, ";", ",", "\n").trim_end()),
    ];
    for table in others {
        let found = fitted(&table);
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found - expected).abs() < 1e-6, "{found} for {expected} in {}", &table[..60]);
        }
    }
}
