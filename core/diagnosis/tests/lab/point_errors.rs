//! The error is reported by measured point: a row that reads three targets holds three errors, not one long one.

use plumb_diagnosis::laboratory::{Comparison, Options};
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;

use super::made_up::{TWO_LINKS, laboratory, two_links_tip};

/// The two-link arm reads the same point under three names, with errors of 1, 2 and 3 mm along x, y and z. Nothing is fitted, nothing held out.
fn compare(targets: usize, joints_free: &str) -> Comparison {
    let names = ["p1", "p2", "p3"].map(|name| format!("{name}: {{xyz_mm: [0, 0, 0], free: false}}"));
    let model = TWO_LINKS
        .replace("p1: {xyz_mm: [0, 0, 0], free: false}", &names[..targets].join(", "))
        .replace("free: []", &format!("free: [{joints_free}]"));
    let columns: Vec<String> =
        (1..=targets).map(|target| format!("p{target}_x_mm,p{target}_y_mm,p{target}_z_mm")).collect();
    let mut table = format!("q1_deg,q2_deg,{}\n", columns.join(","));
    for row in 0..20 {
        let (shoulder, elbow) = (f64::from(row) * 15.0 - 150.0, f64::from(row * 7 % 20) * 10.0 - 95.0);
        let (x, y) = two_links_tip(shoulder, elbow);
        let read = [[x + 1.0, y, 0.0], [x, y + 2.0, 0.0], [x, y, 3.0]];
        let cells: Vec<String> = read.iter().take(targets).flatten().map(f64::to_string).collect();
        table.push_str(&format!("{shoulder},{elbow},{}\n", cells.join(",")));
    }
    let options = Options { holdout: Holdout::None, ..Options::default() };
    laboratory(&model, &table, options).compare(&Progress::unwatched()).unwrap()
}

#[test]
fn the_error_of_several_targets_is_that_of_one_target_not_of_the_row() {
    // Nothing is fitted but a joint's zero, which three balanced targets hardly move: three errors of 1, 2 and 3 mm a row.
    for (targets, squares, mean, max) in [(2, 5.0 / 2.0, 1.5, 2.0), (3, 14.0 / 3.0, 2.0, 3.0)] {
        let found = compare(targets, "joint_zero(elbow)");
        let fit = found.error_mm.fit;
        assert_eq!(fit.points, 20 * targets);
        assert!((found.rms_mm.fit - f64::sqrt(squares)).abs() < 0.05, "{targets}: {:?}", found.rms_mm);
        assert!((fit.rms - found.rms_mm.fit).abs() < 1e-12);
        assert!((fit.mean - mean).abs() < 0.05, "{fit:?}");
        assert!((fit.max - max).abs() < 0.2 && fit.percentile_95 <= fit.max, "{fit:?}");
        assert!((found.largest_mm - fit.max).abs() < 1e-12);
        let cv = found.error_mm.cv.unwrap();
        assert!((cv.rms - f64::sqrt(squares)).abs() < 0.1 && cv.points == 20 * targets, "{cv:?}");
        assert!((found.rms_mm.cv.unwrap() - cv.rms).abs() < 1e-12);
        assert!(found.rows.iter().all(|row| (row.size.unwrap() - f64::sqrt(squares)).abs() < 0.3));
    }
}
