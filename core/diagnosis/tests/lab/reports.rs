//! Templates to start from and reports to hand on.

use plumb_calibration::arm_model::Model;
use plumb_calibration::measurement::{ReadingUnit, RmsError};
use plumb_calibration::table::Table;
use plumb_calibration::template::{Template, robots};
use plumb_diagnosis::laboratory::Options;
use plumb_diagnosis::report::{Chapter, StepKind};
use plumb_estimation::Progress;
use plumb_report::diagnosis_sentence;
use plumb_report::model_report::html;

use super::made_up::{COLUMN_ARM, Xorshift, column_poses, column_tip, laboratory};

#[test]
fn a_template_of_every_robot_reads_and_its_table_has_a_column_for_every_joint() {
    for robot in robots().chain(["6"]) {
        let template = Template::of(robot).unwrap();
        let model = Model::parse("model.yaml", &template.model).unwrap();
        assert!(
            Table::parse("table.csv", &template.table).unwrap_err().to_string().contains("no rows below")
        );
        let cells: Vec<String> = template
            .table
            .lines()
            .next()
            .unwrap()
            .split(',')
            .map(|name| if name.starts_with('q') { "1".to_owned() } else { String::new() })
            .collect();
        let table = Table::parse("table.csv", &format!("{}{}\n", template.table, cells.join(","))).unwrap();
        assert_eq!(table.joints, model.chain.len(), "{robot}");
        assert!(table.covariates.is_empty() && table.warnings.is_empty(), "{robot}: {:?}", table.warnings);
    }
    let message = Template::of("pumma560").unwrap_err().to_string();
    assert!(
        message.contains("did you mean `puma560`?") && message.contains("a number of joints"),
        "{message}"
    );
    assert!(Template::of("0").unwrap_err().to_string().contains("from 1 to 12"));
}

#[test]
fn a_report_is_one_page_that_gives_the_story_and_needs_no_other_file() {
    let mut rng = Xorshift::seeded(51);
    let mut table = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for q in column_poses(60, 51) {
        let [x, y, z] = column_tip([q[0], q[1], q[2] * 1.006]).map(|part| part + rng.noise(0.02));
        table.push_str(&format!("{:.5},{:.5},{:.5},{x:.5},{y:.5},{z:.5}\n", q[0], q[1], q[2]));
    }
    let model = format!(
        "{COLUMN_ARM}targets: {{p1: {{}}}}\nfree: [joint_zero(*)]\neffects: [joint_gain(elbow)]\nnoise: {{p1_mm: 0.02}}\n"
    );
    let chapter = |number, did: &str| Chapter {
        number,
        did: did.to_owned(),
        rms: Some(RmsError { value: 0.1, unit: ReadingUnit::Mm }),
    };
    let story = vec![chapter(0, "the model <as> written"), chapter(1, "add joint_gain(elbow)")];
    let report =
        laboratory(&model, &table, Options::default()).report(story, &Progress::unwatched()).unwrap();
    assert_eq!(report.error_steps.len(), 2);
    assert!(report.error_steps[1].fit_mm2 < 0.2 * report.error_steps[0].fit_mm2, "{:?}", report.error_steps);
    assert!(report.moved.iter().any(|moved| moved.contains("joint_zero(")), "{:?}", report.moved);
    assert_eq!(report.error_steps[0].kind, StepKind::Start);
    assert_eq!(report.error_steps[1].kind, StepKind::Mechanism);
    let page = html(&report);
    for part in [
        "<!DOCTYPE html>",
        "The story so far",
        "add joint_gain(elbow)",
        "</svg>",
        &diagnosis_sentence(&report.diagnosis),
    ] {
        assert!(page.contains(part), "`{part}` is missing");
    }
    assert!(page.contains("the model &lt;as&gt; written"));
    for outside in ["src=", "<script", "@import", "url(h"] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert_eq!(
        page.matches("href=").count(),
        page.matches("href=\"#line-").count(),
        "links stay on the page"
    );
    answers_in_order(&page);
    points_lead_to_rows(&page);
    let gain = report.plots.iter().find(|plot| plot.effect == "joint_gain(elbow)").unwrap();
    assert!(gain.added && gain.rms_mm[1] < 0.2 * gain.rms_mm[0], "{:?}", gain.rms_mm);
    assert!(page.contains("class=\"curve\""), "the fitted curve is drawn over the points");
    assert!(
        page.contains("left without it, along")
            && page.contains("the motion of elbow, mm")
            && page.contains("elbow, deg"),
        "both axes are named"
    );
}

/// The sections are in the order of the questions.
fn answers_in_order(page: &str) {
    let headings = [
        "How large the error is",
        "How much of it could be explained",
        "Where it is",
        "Which effect could explain what is left",
        "How sure that is",
        "What adding effects did: the fall of the error",
        "What is left, against everything on record",
        "Every row",
    ];
    let offsets: Vec<usize> = headings
        .iter()
        .map(|heading| {
            page.find(&format!("<h2>{heading}")).unwrap_or_else(|| panic!("`{heading}` is missing"))
        })
        .collect();
    assert!(offsets.is_sorted(), "{offsets:?}");
}

/// Every point leads to a row that is on the page, each of the table's.
fn points_lead_to_rows(page: &str) {
    let targets: Vec<&str> =
        page.split("href=\"#").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert!(targets.len() > 300, "{}", targets.len());
    for target in targets {
        assert!(page.contains(&format!("id=\"{target}\"")), "{target} leads nowhere");
    }
    assert_eq!(page.matches("<tr id=\"line-").count(), 60);
}

#[test]
fn the_fall_of_a_report_is_solid_for_mechanisms_and_hatched_from_the_first_correction_on() {
    let mut rng = Xorshift::seeded(52);
    let mut table = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for q in column_poses(60, 52) {
        let [x, y, z] = column_tip([q[0], q[1], q[2] * 1.006]).map(|part| part + rng.noise(0.02));
        table.push_str(&format!("{:.5},{:.5},{:.5},{x:.5},{y:.5},{z:.5}\n", q[0], q[1], q[2]));
    }
    let model = format!(
        "{COLUMN_ARM}targets: {{p1: {{}}}}\nfree: [joint_zero(*)]\neffects: [joint_gain(elbow), \"joint_harmonic(shoulder, 2)\"]\nnoise: {{p1_mm: 0.02}}\n"
    );
    let laboratory = laboratory(&model, &table, Options::default());
    let mut report = laboratory.report(Vec::new(), &Progress::unwatched()).unwrap();
    assert_eq!(html(&report).matches("class=\"correction\"").count(), 0);
    let noise = report.comparison.floor_of_a_point_mm.unwrap();
    assert!((noise - 0.02 * 3.0_f64.sqrt()).abs() < 1e-9, "a point's error in space, as the bars: {noise}");
    report.error_steps[2].kind = StepKind::Correction;
    let page = html(&report);
    assert_eq!(page.matches("class=\"mechanism\"").count(), 2);
    assert_eq!(page.matches("class=\"correction\"").count(), 1);
    assert!(page.contains("noise of a point 0.0346 mm"));
}
