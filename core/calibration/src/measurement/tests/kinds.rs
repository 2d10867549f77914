//! Each kind's own words: what it is, whose noise it has, what it lacks, and predictions worked out by hand on a flat arm.

use crate::arm_model::Model;
use crate::fit::ResidualModel;
use crate::measurement::{Measurand, NoiseSource, Observations, ReadingUnit, kinds, unused_distances};
use crate::table::Table;

/// Two links in the plane, 400 and 300 mm, x ahead and y to the left.
const FLAT: &str = "
arm: flat
convention: distal
joints:
  - {name: shoulder, a_mm: 400}
  - {name: elbow, a_mm: 300}
base: {free: false}
targets: {p1: {free: false}, p2: {xyz_mm: [0, 0, 50], free: false}}
surfaces:
  table: {plane: {normal: [0, 0, 1], offset_mm: -20}}
  ball: {sphere: {centre_mm: [700, 30, 40], radius_mm: 10}}
  nail: {point_mm: [730, 0, 40]}
  edge: {line: {point_mm: [690, 0, 0], direction: [0, 1, 0], light: right}}
levels: {plate: {after: elbow}, foot: {after: base}}
measured_from: world
";

fn observed(more: &str, table: &str) -> Result<Observations, String> {
    let model = Model::parse("m.yaml", &format!("{FLAT}{more}")).unwrap_or_else(|error| panic!("{error}"));
    let table = Table::parse("t.csv", table).unwrap();
    Observations::new(&model, &table).map_err(|error| error.to_string())
}

/// What is predicted in the first row, stretched out along x.
fn predicted(columns: &str, cells: &str) -> Vec<f64> {
    let model = Model::parse("m.yaml", FLAT).unwrap();
    let table = Table::parse("t.csv", &format!("q1_deg,q2_deg,{columns}\n0,0,{cells}\n")).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
    let residuals = problem.residuals(&problem.start());
    observations.equations().iter().zip(residuals).map(|(equation, left)| equation.measured - left).collect()
}

fn close(found: &[f64], expected: &[f64], what: &str) {
    let same = found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9);
    assert!(same, "{what}: {found:?} instead of {expected:?}");
}

#[test]
fn every_kind_predicts_what_the_flat_arm_has() {
    close(&predicted("p1_x_mm,p1_y_mm,p1_z_mm", "1,1,1"), &[700.0, 0.0, 0.0], "position");
    close(&predicted("p2_z_mm", "1"), &[50.0], "one coordinate of another target");
    close(&predicted("height_mm,on", "1,table"), &[20.0], "20 mm over the table");
    close(&predicted("height_mm", "1"), &[20.0], "over the first plane where none is named");
    // (0, 30, 40) is 50 long, and the ball's surface is 10 nearer.
    close(&predicted("height_mm,on", "1,ball"), &[40.0], "over a ball");
    close(&predicted("on", "ball"), &[40.0], "on a ball: as far as that off it");
    close(&predicted("on", "nail"), &[50.0], "on a point: as far off it");
    close(&predicted("distance_mm,distance_to", "1,nail"), &[50.0], "from a point");
    close(&predicted("distance_mm,distance_to", "1,ball"), &[50.0], "from the middle of a ball");
    // To the left of an edge along y is -x: 10 mm beyond it is -10 left.
    close(&predicted("on", "edge"), &[-10.0], "at an edge, without a sensor");
    close(&predicted("tilt_x_deg,tilt_y_deg,level", "1,1,plate"), &[0.0, 0.0], "level");
    close(&predicted("touch", "a"), &[700.0, 0.0, 0.0], "a place that is not placed yet lies at the origin");
    let turned = predicted("p1_rx_rad,p1_ry_rad,p1_rz_rad", "0,0,-0.5");
    close(&turned, &[0.0, 0.0, 0.5], "measured half a radian behind");
}

#[test]
fn units_instruments_and_readings_are_those_of_the_kind() {
    let radians = ["orientation", "tilt", "direction", "board_rotation"];
    for kind in kinds() {
        assert_eq!(kind.is_length(), !radians.contains(&kind.name()), "{}", kind.name());
        let turns = ["orientation", "board_rotation"].contains(&kind.name());
        assert_eq!(kind.is_orientation(), turns, "{}", kind.name());
        assert_eq!(kind.is_trigger(), ["trigger", "edge"].contains(&kind.name()), "{}", kind.name());
        assert_eq!(kind.columns().is_empty(), kind.name() == "stripe", "{}", kind.name());
        let shared = if kind.name() == "edge" { "trigger" } else { kind.name() };
        assert_eq!(kind.instrument(), shared, "an edge is met by the sensor that triggers");
    }
}

#[test]
fn every_kind_names_the_columns_it_reads() {
    let columns: Vec<(&str, &str)> = kinds().iter().map(|kind| (kind.name(), kind.columns())).collect();
    let expected = [
        ("position", "p1_x_mm ..."),
        ("orientation", "p1_qw ... (or p1_rx_rad ...)"),
        ("touch", "touch"),
        ("height", "height_mm"),
        ("trigger", "on"),
        ("edge", "on"),
        ("tilt", "tilt_x_deg"),
        ("distance", "distance_mm"),
        ("direction", "p1_azimuth_deg ..."),
        ("stripe", ""),
        ("board", "board_x_mm ..."),
        ("board_rotation", "board_qw ... (or board_rx_rad ...)"),
        ("profile", "profile_x_mm, profile_z_mm"),
    ];
    assert!(expected.iter().all(|one| columns.contains(one)), "{columns:?}");
}

/// Keys of the noise of a table's readings, with sigma, unit and who says so.
fn noise(more: &str, table: &str) -> Vec<(String, f64, ReadingUnit, NoiseSource)> {
    let model = Model::parse("m.yaml", &format!("{FLAT}{more}")).unwrap();
    let table = Table::parse("t.csv", table).unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let all = observations.noise(&model).into_iter();
    all.map(|one| (one.reading, one.sigma, one.unit, one.source)).collect()
}

#[test]
fn readings_of_one_key_have_one_noise_in_its_own_unit() {
    let table = "q1_deg,q2_deg,p1_x_mm,p2_x_mm,height_mm,on,tilt_x_deg,level,distance_mm,distance_to,touch,p1_rx_rad,p1_ry_rad,p1_rz_rad\n\
                 0,0,1,2,3,table,4,plate,5,nail,a,0,0,0\n";
    let declared = "noise: {p1_mm: 0.1, p2_mm: 0.2, height_mm: 0.3, tilt_deg: 0.4, distance_mm: 0.5, touch_mm: 0.6, p1_deg: 0.7}\n";
    let found = noise(declared, table);
    let expected = [
        ("p1_mm", 0.1, ReadingUnit::Mm),
        ("p2_mm", 0.2, ReadingUnit::Mm),
        ("p1_deg", 0.7, ReadingUnit::Deg),
        ("touch_mm", 0.6, ReadingUnit::Mm),
        ("height_mm", 0.3, ReadingUnit::Mm),
        ("tilt_deg", 0.4, ReadingUnit::Deg),
        ("distance_mm", 0.5, ReadingUnit::Mm),
    ];
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for ((key, sigma, unit, source), (name, value, its)) in found.into_iter().zip(expected) {
        assert!(key == name && (sigma - value).abs() < 1e-12 && unit == its, "{key} {sigma} {unit:?}");
        assert_eq!(source, NoiseSource::Declared, "{key}");
    }
    assert!(noise("", table).iter().all(|(.., source)| *source == NoiseSource::Unknown));
    // A row's own sigma is apart from rows that have none; the root of the mean square is shown.
    let own = "q1_deg,q2_deg,p1_x_mm,std_x_mm\n0,0,1,0.3\n0,5,1,0.4\n0,9,1,\n";
    let found = noise("", own);
    assert_eq!((found.len(), found[0].3, found[1].3), (2, NoiseSource::Declared, NoiseSource::Unknown));
    assert!((found[0].1 - 0.125_f64.sqrt()).abs() < 1e-12, "{found:?}");
}

#[test]
fn triggers_share_the_noise_of_heights_and_what_nobody_declared_counts_as_one() {
    let table = "q1_deg,q2_deg,on\n0,0,table\n0,5,edge\n";
    let observations = observed("noise: {on_mm: 0.3}\n", table).unwrap();
    let sigmas: Vec<f64> = observations.equations().iter().map(|equation| equation.sigma).collect();
    assert_eq!((sigmas, observations.declared), (vec![0.3, 0.3], true));
    let bare = observed("", table).unwrap();
    assert!(bare.equations().iter().all(|equation| equation.sigma == 1.0 && !equation.is_declared));
    assert!(!bare.declared);
}

#[test]
fn what_a_fit_showed_of_an_undeclared_noise_weighs_the_readings_and_the_declared_stays() {
    let mut model = Model::parse("m.yaml", &format!("{FLAT}noise: {{p1_mm: 0.1}}\n")).unwrap();
    model.noise.estimated =
        vec![("p1_mm".to_owned(), 9.0), ("p2_mm".to_owned(), 0.25), ("touch_mm".to_owned(), 0.5)];
    model.touch = Some(crate::arm_model::Touch {
        target: "p1".to_owned(),
        distances: vec![crate::arm_model::TouchDistance {
            between: ["a".to_owned(), "b".to_owned()],
            length: 5.0,
        }],
    });
    let table = Table::parse("t.csv", "q1_deg,q2_deg,p1_x_mm,p2_x_mm,touch\n0,0,1,2,a\n0,1,,,b\n").unwrap();
    let observations = Observations::new(&model, &table).unwrap();
    let sigmas: Vec<f64> = observations.of_row(0).iter().map(|equation| equation.sigma).collect();
    assert_eq!(sigmas, [0.1, 0.25, 0.5, 0.5, 0.5]);
    assert_eq!(observations.noise(&model)[1].source, NoiseSource::Estimated);
    // A known distance was measured ten times as well as a touch.
    assert_eq!(observations.place_distances.len(), 1);
    let known = observations.place_distances[0];
    assert_eq!((known.first, known.second, known.length), (0, 1, 5.0));
    assert!((known.sigma - 0.05).abs() < 1e-12);
}

#[test]
fn a_known_distance_is_unused_where_rows_touch_places_but_not_both_its_ends() {
    let distance = |one: &str, other: &str| crate::arm_model::TouchDistance {
        between: [one.to_owned(), other.to_owned()],
        length: 5.0,
    };
    let mut model = Model::parse("m.yaml", FLAT).unwrap();
    let distances = vec![distance("left", "right"), distance("left", "rihgt"), distance("lfet", "far")];
    model.touch = Some(crate::arm_model::Touch { target: "p1".to_owned(), distances });
    let table = |rows: &str| Table::parse("t.csv", &format!("q1_deg,q2_deg,p1_x_mm,touch\n{rows}")).unwrap();
    assert_eq!(
        unused_distances(&model, &table("0,0,1,left\n0,1,,right\n")),
        [
            "the known distance of 5 mm between `left` and `rihgt` is not used: no row touches `rihgt`; did you mean `right`?",
            "the known distance of 5 mm between `lfet` and `far` is not used: no row touches `lfet`; did you mean `left`?",
        ]
    );
    assert_eq!(
        unused_distances(&model, &table("0,0,1,\n")),
        [""; 0],
        "nothing was touched, nothing is missed"
    );
    model.touch = None;
    assert_eq!(unused_distances(&model, &table("0,0,1,left\n")), [""; 0]);
}

#[test]
fn rows_have_their_own_equations_and_none_beyond_the_last() {
    let observations = observed("", "q1_deg,q2_deg,p1_x_mm,p1_y_mm\n0,0,1,2\n0,1,,\n0,2,3,\n").unwrap();
    assert_eq!(observations.rows(), 3);
    assert_eq!([0, 1, 2, 3].map(|row| observations.range(row).len()), [2, 0, 1, 0]);
    assert_eq!(observations.of_row(2)[0].measured, 3.0);
    assert_eq!(
        (observations.of_row(2)[0].measurand.axis(), observations.of_row(2)[0].measurand.is_length()),
        (0, true)
    );
    let none = Observations::without_readings(4);
    assert_eq!((none.rows(), none.range(3), none.equations().len()), (4, 0..0, 0));
}

#[test]
fn what_a_row_refers_to_and_the_model_lacks_is_named() {
    for (table, part) in [
        ("q1_deg,p1_x_mm\n0,1\n", "the table has 1 joints (q1 ... q1) and the arm flat has 2"),
        ("q1_deg,q2_mm,p1_x_mm\n0,0,1\n", "joint `elbow` of the arm flat turns: give it as"),
        ("q1_deg,q2_deg,p3_x_mm\n0,0,1\n", "measures a target the model does not have; add `p3`"),
        ("q1_deg,q2_deg,p3_qw,p3_qx,p3_qy,p3_qz\n0,0,1,0,0,0\n", "add `p3` under `targets:`"),
        (
            "q1_deg,q2_deg,on\n0,0,tabel\n",
            "line 2: `tabel` in column `on` is not in the model's `surfaces:`; did you mean `table`?",
        ),
        ("q1_deg,q2_deg,distance_mm,distance_to\n0,0,5,nial\n", "`nial` in column `distance_to`"),
        ("q1_deg,q2_deg,distance_mm\n0,0,5\n", "line 2: a distance needs `distance_to`, the name of a point"),
        (
            "q1_deg,q2_deg,tilt_x_deg\n0,0,5\n",
            "line 2: say in column `level` which of the model's levels it is: plate, foot",
        ),
        (
            "q1_deg,q2_deg,tilt_x_deg,level\n0,0,5,plat\n",
            "line 2: `plat` in column `level` is not in the model's `levels:`; did you mean `plate`?",
        ),
        ("q1_deg,q2_deg,board_x_mm\n0,0,5\n", "of a board that a camera on the hand sees"),
        ("q1_deg,q2_deg\n0,0\n", "nothing was measured; the table needs p1_x_mm ..."),
        ("q1_deg,q2_deg,X\n0,0,5\n", "--columns X=p1_x_mm"),
    ] {
        let message = observed("", table).unwrap_err();
        assert!(message.contains(part), "{table}: {message}");
    }
}

#[test]
fn what_the_model_has_not_got_at_all_is_said_in_other_words() {
    let bare = "arm: bare\nconvention: distal\njoints: [{name: one, a_mm: 400}]\n";
    let message = |more: &str, table: &str| {
        let model = Model::parse("m.yaml", &format!("{bare}{more}")).unwrap();
        let table = Table::parse("t.csv", table).unwrap();
        Observations::new(&model, &table).unwrap_err().to_string()
    };
    let point = "targets: {p1: {}}\n";
    assert!(
        message(point, "q1_deg,height_mm\n0,5\n")
            .contains("column `height_mm` needs a plane in the model's `surfaces:`")
    );
    assert!(
        message(point, "q1_deg,tilt_x_deg\n0,5\n").contains("columns `tilt_*` need `level:` in the model")
    );
    let nail = "surfaces: {nail: {point_mm: [0, 0, 0]}}\n";
    let turned = "targets: {p2: {}}\n";
    assert!(message(turned, "q1_deg,touch\n0,a\n").contains("column `touch` needs a target p1 in the model"));
    let no_target = message(nail, "q1_deg,on\n0,nail\n");
    assert!(no_target.contains("column `on` needs a target p1 in the model"), "{no_target}");
    let slide = "arm: s\nconvention: distal\njoints: [{name: x, slides: true}]\ntargets: {p1: {}}\n";
    let model = Model::parse("m.yaml", slide).unwrap();
    let table = Table::parse("t.csv", "q1_deg,p1_x_mm\n0,5\n").unwrap();
    let wrong = Observations::new(&model, &table).unwrap_err().to_string();
    assert!(
        wrong.contains("column `q1_deg`: joint `x` of the arm s slides: give it as")
            && wrong.contains("q1_mm"),
        "{wrong}"
    );
}

#[test]
fn an_edge_is_seen_where_the_hand_looks_and_earlier_from_higher_up() {
    // The flat arm's z points up, so the sensor has to be turned over: a shoulder that turns the hand's z down.
    let text = FLAT
        .replace("{name: elbow, a_mm: 300}", "{name: elbow, a_mm: 300, alpha_deg: 180}")
        .replace("offset_mm: -20", "offset_mm: 0");
    let sensor =
        "sensor: {working_mm: 8, peak_mm: 5, spot_mm: 3, hysteresis_percent: 40, dark_percent: 20}\n";
    let at = |more: &str, signal: &str| {
        let model = Model::parse("m.yaml", &format!("{text}{more}")).unwrap();
        let table = Table::parse("t.csv", &format!("q1_deg,q2_deg,on,signal\n0,0,edge,{signal}\n")).unwrap();
        let observations = Observations::new(&model, &table).unwrap();
        let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
        -problem.residuals(&problem.start())[0]
    };
    // Straight down, p1 in the table: half of the spot is light where it lets go, so the middle is over the edge.
    assert!((at(sensor, "off") + 10.0).abs() < 1e-6, "{}", at(sensor, "off"));
    // It comes on when the whole spot is light, a radius on the right: 1.5 mm less is left of the edge.
    assert!((at(sensor, "on") - (-10.0 + 1.5)).abs() < 1e-2, "{}", at(sensor, "on"));
    assert!(
        (at(sensor, "") - at(sensor, "off")).abs() < 1e-12,
        "at an edge it goes off where that is not logged"
    );
    assert!((at("", "off") + 10.0).abs() < 1e-9, "without a sensor p1 itself meets it");
    let over = |signal: &str| {
        let model = Model::parse("m.yaml", &format!("{text}{sensor}")).unwrap();
        let table = Table::parse("t.csv", &format!("q1_deg,q2_deg,on,signal\n0,0,table,{signal}\n")).unwrap();
        let observations = Observations::new(&model, &table).unwrap();
        let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
        -problem.residuals(&problem.start())[0]
    };
    assert!(over("on").abs() < 1e-12 && over("").abs() < 1e-12, "over a table it comes on");
    // It lets go where light has fallen to 60 %: (d/5)^2 exp(2 - 2 d/5) against that of 8 mm.
    let light = |d: f64| (d / 5.0).powi(2) * (2.0 - 2.0 * d / 5.0).exp();
    let higher = -over("off");
    assert!((light(8.0 + higher) / light(8.0) - 0.6).abs() < 1e-6 && higher > 1.0, "{higher}");
}

#[test]
fn a_spirit_level_reads_how_its_frame_leans() {
    // A wrist that turns about the world's x and y: roll 10 degrees about x lifts y, so the level's y points up by 10 degrees.
    let text = "
arm: leaning
convention: distal
joints: [{name: one, a_mm: 100}]
base: {rpy_deg: [10, 0, 0], free: false}
targets: {p1: {}}
level: {after: base}
measured_from: world
";
    let read = |text: &str| {
        let model = Model::parse("m.yaml", text).unwrap();
        let table = Table::parse("t.csv", "q1_deg,tilt_x_deg,tilt_y_deg\n0,0,0\n").unwrap();
        let observations = Observations::new(&model, &table).unwrap();
        let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
        let left = problem.residuals(&problem.start());
        [-left[0].to_degrees(), -left[1].to_degrees()]
    };
    close(&read(text), &[10.0, 0.0], "rolled");
    close(&read(&text.replace("[10, 0, 0]", "[0, 10, 0]")), &[0.0, 10.0], "pitched");
    close(&read(&text.replace("[10, 0, 0]", "[0, 0, 35]")), &[0.0, 0.0], "a heading shows on no level");
    // A level that is itself turned by a quarter about x reads as much more.
    let over = read(&text.replace("level: {after: base}", "level: {after: base, rpy_deg: [90, 0, 0]}"));
    assert!((over[0] - 100.0).abs() < 1e-9, "{over:?}");
}

#[test]
fn a_measurand_is_the_same_as_one_of_its_kind_thing_and_component() {
    let kind = |name: &str| *kinds().iter().find(|kind| kind.name() == name).unwrap();
    let one = Measurand { kind: kind("position"), index: 1, component: 2 };
    assert_eq!(one, one);
    for other in [
        Measurand { kind: kind("height"), ..one },
        Measurand { index: 2, ..one },
        Measurand { component: 0, ..one },
    ] {
        assert_ne!(one, other);
    }
    assert_eq!(kind("profile").name(), "profile");
}
