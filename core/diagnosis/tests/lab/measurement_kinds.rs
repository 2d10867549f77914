//! Every kind of measurement a table can hold brings a wrong zero to light, alone.

use plumb_diagnosis::laboratory::{Comparison, Options};
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;
use plumb_report::diagnosis_sentence;

use super::made_up::{COLUMN_ARM, Xorshift, column_poses, column_tip, laboratory};

/// The hidden error of the elbow's zero, deg.
const HIDDEN: f64 = 0.4;

const KNOWN: &str = "base: {free: false}\ntargets: {p1: {free: false}}\nmeasured_from: world\n";

fn compare(model: &str, header: &str, rows: &[String]) -> Comparison {
    let table = format!("{header}\n{}\n", rows.join("\n"));
    let options = Options { holdout: Holdout::None, ..Options::default() };
    laboratory(model, &table, options).compare(&Progress::unwatched()).unwrap()
}

fn size(found: &Comparison, label: &str) -> (f64, f64) {
    let effect = found.effects.iter().find(|effect| effect.label == label).unwrap();
    assert!(!effect.held, "{label} is held");
    (effect.size, effect.se)
}

/// The elbow's zero comes out at what was hidden, within four standard errors and closely at that.
fn finds_the_elbow(found: &Comparison) {
    let (value, error) = size(found, "joint_zero(elbow)");
    assert!((value - HIDDEN).abs() < 4.0 * error + 1e-6, "{value} +- {error}");
    assert!(error < 0.08, "{value} +- {error}");
}

fn model(rest: &str) -> String {
    format!("{COLUMN_ARM}{KNOWN}free: [joint_zero(elbow)]\n{rest}")
}

fn truth(q: [f64; 3]) -> [f64; 3] {
    column_tip([q[0], q[1], q[2] + HIDDEN])
}

fn joints(q: [f64; 3]) -> String {
    format!("{:.6},{:.6},{:.6}", q[0], q[1], q[2])
}

const Q: &str = "q1_deg,q2_deg,q3_deg";

#[test]
fn positions_of_which_some_axes_are_missing() {
    let mut rng = Xorshift::seeded(2);
    let mut row = |(index, q): (usize, [f64; 3])| {
        let mut cells = truth(q).map(|part| format!("{:.5}", part + rng.noise(0.05)));
        cells[index % 3].clear();
        format!("{},{}", joints(q), cells.join(","))
    };
    let rows: Vec<String> = column_poses(30, 2).into_iter().enumerate().map(&mut row).collect();
    let found = compare(&model("noise: {p1_mm: 0.05}\n"), &format!("{Q},p1_x_mm,p1_y_mm,p1_z_mm"), &rows);
    finds_the_elbow(&found);
    assert!((0.04..0.12).contains(&found.rms_mm.fit), "{:?}", found.rms_mm);
}

#[test]
fn heights_over_a_plane_of_which_nobody_knows_how_it_lies() {
    let mut rng = Xorshift::seeded(3);
    let normal = [0.03, -0.02, (1.0_f64 - 0.0009 - 0.0004).sqrt()];
    let mut row = |q: [f64; 3]| {
        let tip = truth(q);
        let height: f64 = tip.iter().zip(normal).map(|(part, normal)| part * normal).sum::<f64>() - 12.0;
        format!("{},{:.5},table", joints(q), height + rng.noise(0.05))
    };
    let rows: Vec<String> = column_poses(60, 3).into_iter().map(&mut row).collect();
    let surfaces = "surfaces: {table: {plane: {normal: [0, 0, 1], offset_mm: 0}, free: true}}\n";
    finds_the_elbow(&compare(&model(surfaces), &format!("{Q},height_mm,on"), &rows));
}

#[test]
fn rows_left_out_are_not_asked_of_a_plane_that_nothing_else_determines() {
    let mut rng = Xorshift::seeded(7);
    let mut rows: Vec<String> = column_poses(60, 7)
        .into_iter()
        .map(|q| {
            let cells = truth(q).map(|part| format!("{:.5}", part + rng.noise(0.05)));
            format!("{},{},,", joints(q), cells.join(","))
        })
        .collect();
    // Heights in two corners: without the one, the plane under it is anybody's guess.
    for waist in [-60.0, 60.0] {
        for q in
            [[waist, 30.0, -60.0], [waist + 3.0, 30.0, -60.0], [waist, 33.0, -60.0], [waist, 30.0, -64.0]]
        {
            let height = truth(q)[2] - 12.0 + rng.noise(0.2);
            rows.push(format!("{},,,,{height:.5},table", joints(q)));
        }
    }
    let rest = "noise: {p1_mm: 0.05, height_mm: 0.2}
surfaces: {table: {plane: {normal: [0, 0, 1], offset_mm: 0}, free: true}}\n";
    let found = compare(&model(rest), &format!("{Q},p1_x_mm,p1_y_mm,p1_z_mm,height_mm,on"), &rows);
    finds_the_elbow(&found);
    let cv = found.rms_mm.cv.unwrap();
    assert!(cv < 2.0 * found.rms_mm.fit, "{:?}", found.rms_mm);
}

/// The elbow's command that brings the tip to where `miss` is zero, from a start, by bisection.
fn command(mut low: f64, mut high: f64, miss: impl Fn(f64) -> f64) -> f64 {
    assert!(miss(low) * miss(high) < 0.0, "{} .. {}", miss(low), miss(high));
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if miss(low) * miss(middle) <= 0.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

#[test]
fn moments_at_which_the_tip_lay_on_a_table_or_over_an_edge() {
    let mut rng = Xorshift::seeded(4);
    let mut rows = Vec::new();
    for _ in 0..20 {
        let (waist, shoulder) = (rng.between(-60.0, 60.0), rng.between(5.0, 25.0));
        let on_table = command(-130.0, -10.0, |elbow| truth([waist, shoulder, elbow])[2] - 250.0);
        rows.push(format!("{},table", joints([waist, shoulder, on_table + rng.noise(0.005)])));
        let (waist, shoulder) = (rng.between(-20.0, 20.0), rng.between(0.0, 30.0));
        let over_edge = command(-150.0, 0.0, |elbow| truth([waist, shoulder, elbow])[0] - 180.0);
        rows.push(format!("{},edge", joints([waist, shoulder, over_edge + rng.noise(0.005)])));
    }
    let surfaces = "surfaces:
  table: {plane: {normal: [0, 0, 1], offset_mm: 250}}
  edge: {line: {point_mm: [180, 0, 0], direction: [0, 1, 0]}}
";
    finds_the_elbow(&compare(&model(surfaces), &format!("{Q},on"), &rows));
}

#[test]
fn points_on_a_ball() {
    // The tip rides on a ball about the shoulder's side: its centre is free.
    let mut rng = Xorshift::seeded(5);
    let centre = [150.0, 60.0, 380.0];
    let away = |q: [f64; 3]| {
        let squares = truth(q).into_iter().zip(centre).map(|(part, centre)| (part - centre).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let mut rows = Vec::new();
    while rows.len() < 60 {
        let (waist, shoulder) = (rng.between(-60.0, 90.0), rng.between(-10.0, 100.0));
        let miss = |elbow: f64| away([waist, shoulder, elbow]) - 160.0;
        for (low, high) in [(-150.0, -100.0), (-100.0, -60.0), (-60.0, -20.0), (-20.0, 0.0)] {
            if miss(low) * miss(high) < 0.0 {
                let elbow = command(low, high, miss) + rng.noise(0.005);
                rows.push(format!("{},ball", joints([waist, shoulder, elbow])));
            }
        }
    }
    let surfaces = "surfaces: {ball: {sphere: {centre_mm: [148, 62, 381], radius_mm: 160}, free: true}}\n";
    finds_the_elbow(&compare(&model(surfaces), &format!("{Q},on"), &rows));
}

#[test]
fn tilts_of_the_last_link() {
    let mut rng = Xorshift::seeded(6);
    let mut row = |q: [f64; 3]| {
        let tilt = -(q[1] + q[2] + HIDDEN) + rng.noise(0.02);
        format!("{},{:.5},{:.5}", joints(q), rng.noise(0.02), tilt)
    };
    let rows: Vec<String> = column_poses(40, 6).into_iter().map(&mut row).collect();
    let level = "level: {after: elbow, rpy_deg: [-90, 0, 0]}\nnoise: {tilt_deg: 0.02}\n";
    finds_the_elbow(&compare(&model(level), &format!("{Q},tilt_x_deg,tilt_y_deg"), &rows));
    // A level cannot distinguish the shoulder's zero from the elbow's: it says so.
    let both = model(level).replace("joint_zero(elbow)", "joint_zero(shoulder), joint_zero(elbow)");
    let found = compare(&both, &format!("{Q},tilt_x_deg,tilt_y_deg"), &rows);
    let gauge = found.gauges.first().unwrap();
    assert!(format!("{gauge:?}").contains("joint_zero(shoulder)"), "{gauge:?}");
}

#[test]
fn tilts_of_several_links() {
    let mut rng = Xorshift::seeded(9);
    let mut row = |(index, q): (usize, [f64; 3])| {
        let (level, tilt) = match index % 2 {
            0 => ("arm", -q[1]),
            _ => ("hand", -(q[1] + q[2] + HIDDEN)),
        };
        format!("{},{level},{:.5},{:.5}", joints(q), rng.noise(0.02), tilt + rng.noise(0.02))
    };
    let rows: Vec<String> = column_poses(60, 9).into_iter().enumerate().map(&mut row).collect();
    let levels = "levels:\n  arm: {after: shoulder, rpy_deg: [-90, 0, 0]}\n  hand: {after: elbow, rpy_deg: [-90, 0, 0]}\nnoise: {tilt_deg: 0.02}\n";
    // With a level on each link the two zeros come apart.
    let both = model(levels).replace("joint_zero(elbow)", "joint_zero(shoulder), joint_zero(elbow)");
    let header = format!("{Q},level,tilt_x_deg,tilt_y_deg");
    finds_the_elbow(&compare(&both, &header, &rows));
}

#[test]
fn distances_to_two_nails() {
    let mut rng = Xorshift::seeded(7);
    let nails = [("left", [0.0, 500.0, 0.0]), ("right", [100.0, -450.0, 20.0])];
    let mut row = |(index, q): (usize, [f64; 3])| {
        let (name, nail) = nails[index % 2];
        let squares =
            truth(q).iter().zip(nail).map(|(part, nail): (&f64, f64)| (part - nail).powi(2)).sum::<f64>();
        format!("{},{:.5},{name}", joints(q), squares.sqrt() + rng.noise(0.05))
    };
    let rows: Vec<String> = column_poses(40, 7).into_iter().enumerate().map(&mut row).collect();
    let surfaces = "surfaces: {left: {point_mm: [0, 500, 0]}, right: {point_mm: [100, -450, 20]}}\n";
    finds_the_elbow(&compare(&model(surfaces), &format!("{Q},distance_mm,distance_to"), &rows));
}

/// Seen failing with a division by zero: an empty block of rows was asked what it says of a free surface.
#[test]
fn an_error_is_named_and_the_model_grown_by_distances_to_a_point_of_which_nobody_knows_where_it_is() {
    let mut rng = Xorshift::seeded(17);
    let nail = [60.0, 480.0, 20.0];
    let rows: Vec<String> = column_poses(120, 17)
        .into_iter()
        .map(|q| {
            let tip = column_tip([q[0], q[1], q[2] + 0.02 * q[2]]);
            let squares =
                tip.iter().zip(nail).map(|(part, nail): (&f64, f64)| (part - nail).powi(2)).sum::<f64>();
            format!("{},{:.5},nail", joints(q), squares.sqrt() + rng.noise(0.05))
        })
        .collect();
    let surfaces = "surfaces: {nail: {point_mm: [50, 490, 30], free: true}}\nnoise: {distance_mm: 0.05}\n";
    let table = format!("{Q},distance_mm,distance_to\n{}\n", rows.join("\n"));
    let growth = laboratory(&model(surfaces), &table, Options::default())
        .grow_with_corrections(&Progress::unwatched())
        .unwrap();
    let added: Vec<&str> = growth.steps.iter().map(|step| step.label.as_str()).collect();
    assert_eq!(added, ["joint_gain(elbow)"], "{}", diagnosis_sentence(&growth.diagnosis));
    assert!(
        (growth.steps[0].added.size - 0.02).abs() < 4.0 * growth.steps[0].added.se,
        "{:?}",
        growth.steps[0]
    );
}

/// On a draw wire that was re-set twice while an arm walked through its poses, thirteen waves of the joints were taken in one after another.
#[test]
fn a_wire_that_was_re_set_on_the_way_is_taken_in_before_waves_that_imitate_it() {
    let mut rng = Xorshift::seeded(23);
    let nail = [60.0, 480.0, 20.0];
    // The arm walks a smooth way, so that what jumps in the order of the rows jumps along every joint as well.
    let poses = (0..600).map(|index| {
        let turn = f64::from(index) * std::f64::consts::TAU / 600.0;
        [100.0 * turn.sin(), 40.0 + 50.0 * (1.5 * turn).sin(), -65.0 + 50.0 * (2.3 * turn).sin()]
    });
    let row = |(index, q): (usize, [f64; 3])| {
        let squares = column_tip(q)
            .iter()
            .zip(nail)
            .map(|(part, nail): (&f64, f64)| (part - nail).powi(2))
            .sum::<f64>();
        let reset = if (150..410).contains(&index) { 3.0 } else { 0.0 };
        format!("{},{:.5},nail", joints(q), squares.sqrt() + reset + rng.noise(0.1))
    };
    let rows: Vec<String> = poses.enumerate().map(row).collect();
    let surfaces = "surfaces: {nail: {point_mm: [50, 490, 30], free: true}}\n";
    let table = format!("{Q},distance_mm,distance_to\n{}\n", rows.join("\n"));
    let options = Options { holdout: Holdout::Random { fraction: 0.3, seed: 1 }, ..Options::default() };
    let growth =
        laboratory(&format!("{COLUMN_ARM}{KNOWN}free: [joint_zero(*)]\n{surfaces}"), &table, options)
            .grow_with_corrections(&Progress::unwatched())
            .unwrap();
    let added: Vec<&str> = growth.steps.iter().map(|step| step.label.as_str()).collect();
    assert!(
        growth.steps[0].label.starts_with("reading_reset")
            || growth.steps[0].may_be.iter().any(|one| one.starts_with("reading_reset")),
        "{added:?}"
    );
    assert!(!added.iter().any(|label| label.starts_with("joint_harmonic")), "{added:?}");
    assert!(growth.diagnosis.rms_mm.fit < 0.15, "{}", diagnosis_sentence(&growth.diagnosis));
}

/// The column arm as a theodolite sees it: where the base is, mm, and how far it is turned about z, deg.
const STATION: [f64; 4] = [900.0, -1400.0, -250.0, 130.0];

/// Azimuth and elevation of the tip, deg, by plain trigonometry.
fn sighted(q: [f64; 3]) -> [f64; 2] {
    let [x, y, z] = column_tip(q);
    let (sine, cosine) = STATION[3].to_radians().sin_cos();
    let [x, y, z] = [STATION[0] + cosine * x - sine * y, STATION[1] + sine * x + cosine * y, STATION[2] + z];
    let far = (x * x + y * y + z * z).sqrt();
    // The quadrant by the sign of y: an arc cosine knows only half of the circle.
    let azimuth = (x / x.hypot(y)).acos().to_degrees().copysign(y);
    [azimuth, (z / far).asin().to_degrees()]
}

/// Rows of directions in which the joints truly are where `truly` says.
fn directions(seed: u64, count: usize, truly: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<String> {
    let mut rng = Xorshift::seeded(seed);
    let mut row = |q: [f64; 3]| {
        let [azimuth, elevation] = sighted(truly(q));
        // Instruments count whole turns from 0.
        let azimuth = (azimuth + rng.noise(0.003)).rem_euclid(360.0);
        format!("{},{azimuth:.5},{:.5}", joints(q), elevation + rng.noise(0.003))
    };
    column_poses(count, seed).into_iter().map(&mut row).collect()
}

const SIGHTED: &str = "q1_deg,q2_deg,q3_deg,p1_azimuth_deg,p1_elevation_deg";

/// Nobody said where the base is: everything of it is free.
const ANYWHERE: &str = "base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0], free: true}
targets: {p1: {free: false}}
noise: {azimuth_deg: 0.003, elevation_deg: 0.003}
";

#[test]
fn directions_from_a_base_of_which_nobody_knows_where_it_is() {
    let rows = directions(31, 60, |q| [q[0], q[1], q[2] + HIDDEN]);
    let found = compare(&format!("{COLUMN_ARM}{ANYWHERE}free: [joint_zero(elbow)]\n"), SIGHTED, &rows);
    finds_the_elbow(&found);
    // Degrees where nothing but angles was read: that of both circles together.
    assert!((0.003..0.006).contains(&found.rms_mm.fit), "{:?}", found.rms_mm);
}

#[test]
fn an_error_is_named_with_its_size_by_directions_alone() {
    let hidden = 0.01;
    let rows = directions(32, 120, |q| [q[0], q[1], q[2] * (1.0 + hidden)]);
    let table = format!("{SIGHTED}\n{}\n", rows.join("\n"));
    let model = format!("{COLUMN_ARM}{ANYWHERE}free: [joint_zero(shoulder), joint_zero(elbow)]\n");
    let diagnosis = laboratory(&model, &table, Options::default()).diagnose(&Progress::unwatched()).unwrap();
    let named = diagnosis.named.as_ref();
    let named = named.unwrap();
    let effect = (named.effect.effect.as_str(), named.effect.site.as_str());
    assert_eq!(effect, ("joint_gain", "elbow"), "{}", diagnosis_sentence(&diagnosis));
    assert!((named.size - hidden).abs() < 3.0 * named.se, "{named:?}");
}

#[test]
fn one_pointer_on_marks_of_which_only_a_distance_is_known() {
    // Each mark is reached by both bends of the elbow and nothing else is known but how far apart two marks are.
    let (mut rng, mut rows) = (Xorshift::seeded(8), Vec::new());
    let mut marks = Vec::new();
    for mark in 0..6 {
        let (waist, radius, height) =
            (rng.between(-120.0, 120.0), rng.between(180.0, 300.0), rng.between(250.0, 420.0));
        let (r, z) = (radius, height - 300.0);
        let bend = ((r * r + z * z - 200.0_f64.powi(2) - 150.0_f64.powi(2)) / (2.0 * 200.0 * 150.0)).acos();
        for side in [1.0, -1.0] {
            let elbow = side * bend;
            let shoulder = z.atan2(r) - (150.0 * elbow.sin()).atan2(200.0 + 150.0 * elbow.cos());
            for _ in 0..3 {
                let q =
                    [waist, shoulder.to_degrees(), elbow.to_degrees() - HIDDEN].map(|q| q + rng.noise(0.005));
                rows.push(format!("{},mark{mark}", joints(q)));
            }
        }
        let angle = waist.to_radians();
        marks.push([radius * angle.cos(), radius * angle.sin(), height]);
    }
    let apart = |a: usize, b: usize| {
        marks[a].iter().zip(marks[b]).map(|(one, other)| (one - other).powi(2)).sum::<f64>().sqrt()
    };
    let touch = format!(
        "touch: {{p: p1, distances: [{{between: [mark0, mark1], mm: {:.4}}}, {{between: [mark2, mark3], mm: {:.4}}}]}}\n",
        apart(0, 1),
        apart(2, 3)
    );
    finds_the_elbow(&compare(&model(&touch), &format!("{Q},touch"), &rows));
}

/// A point as an instrument placed askew somewhere reads it.
fn seen([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (sine, cosine) = 35.0_f64.to_radians().sin_cos();
    let (x, y) = (cosine * x - sine * y, sine * x + cosine * y);
    let (sine, cosine) = 80.0_f64.to_radians().sin_cos();
    [x + 1500.0, cosine * y - sine * z - 700.0, sine * y + cosine * z + 250.0]
}

#[test]
fn an_instrument_may_stand_anywhere_and_askew() {
    let mut rng = Xorshift::seeded(9);
    let mut row = |q: [f64; 3]| {
        let cells = seen(truth(q)).map(|part| format!("{:.5}", part + rng.noise(0.05)));
        format!("{},{}", joints(q), cells.join(","))
    };
    let rows: Vec<String> = column_poses(40, 9).into_iter().map(&mut row).collect();
    let model = format!(
        "{COLUMN_ARM}base: {{free: true}}\ntargets: {{p1: {{free: false}}}}\nfree: [joint_zero(elbow)]\nmeasured_from: instrument\n"
    );
    let found = compare(&model, &format!("{Q},p1_x_mm,p1_y_mm,p1_z_mm"), &rows);
    finds_the_elbow(&found);
    assert!(found.rms_mm.fit < 0.12, "{:?}", found.rms_mm);
}

#[test]
fn readings_count_for_as_much_as_their_declared_sigma_allows() {
    // A third of the rows is off by 0.5 mm and says so.
    let mut rng = Xorshift::seeded(10);
    let mut row = |(index, q): (usize, [f64; 3])| {
        let sigma = if index % 3 == 0 { 0.5 } else { 0.01 };
        let cells = truth(q).map(|part| format!("{:.5}", part + rng.noise(sigma)));
        format!("{},{},{sigma},{sigma},{sigma}", joints(q), cells.join(","))
    };
    let rows: Vec<String> = column_poses(60, 10).into_iter().enumerate().map(&mut row).collect();
    let header = format!("{Q},p1_x_mm,p1_y_mm,p1_z_mm,std_x_mm,std_y_mm,std_z_mm");
    let found = compare(&model(""), &header, &rows);
    let (value, error) = size(&found, "joint_zero(elbow)");
    assert!((value - HIDDEN).abs() < 4.0 * error && error < 0.002, "{value} +- {error}");
    assert!(found.outliers.is_empty(), "{:?}", found.outliers);
}
