//! `plumb report iso9283`.

use std::error::Error;

use nalgebra::{Matrix3, Rotation3, Vector3};
use plumb_calibration::arm_model::Model;
use plumb_calibration::fit::rigid;
use plumb_calibration::prediction::{Pose, bodies};
use plumb_calibration::table::{Body, Table};
use plumb_report::figure::{Curve, Figure, svg};
use plumb_standards::{AtPose, Budget, Iso9283, PoseRun, Predicted, Question, Unit, budget, iso_9283};
use serde::Serialize;

use super::arguments::Iso9283Arguments;
use super::page::Page;
use super::words::{Grid, budget_grid, budget_sentence, number, or_dash};

/// The report with its budget, as JSON has it.
#[derive(Serialize)]
struct WithBudget<'a> {
    #[serde(flatten)]
    report: &'a Iso9283,
    #[serde(skip_serializing_if = "Option::is_none")]
    budget: Option<&'a Budget>,
}

/// Reads, computes, prints.
///
/// # Errors
/// A file that cannot be read, or a table without returns to poses.
pub(super) fn run(arguments: &Iso9283Arguments) -> Result<String, Box<dyn Error>> {
    let (table, model) = arguments.table.open()?;
    let target = arguments.target.as_deref();
    let mut run = PoseRun::of(&table, target, None)?;
    if let Some(model) = &model {
        let predicted = predicted(model, &table, &run.target)?;
        run = PoseRun::of(&table, target, Some(&predicted))?;
    }
    let report = iso_9283(&run);
    let rows: Vec<usize> =
        run.poses.iter().filter_map(|pose| pose.visits.first()).map(|visit| visit.row).collect();
    let question = Question { reading: &run.target, unit: Unit::Mm, rows: &rows };
    let budget = model.as_ref().map(|model| budget(model, &table, &question)).transpose()?;
    let digits = arguments.table.digits;
    let text = text(&report, budget.as_ref(), digits);
    let with_budget = WithBudget { report: &report, budget: budget.as_ref() };
    arguments.table.give(&with_budget, text, || page(&report, &run, budget.as_ref(), &table.source, digits))
}

/// Where a model has the target in each row, and how it is turned there; a base and a turn on the flange that are free are placed by the rows.
fn predicted(model: &Model, table: &Table, target: &str) -> Result<Predicted, Box<dyn Error>> {
    if table.joints != model.chain.len() {
        return Err(format!(
            "{} has {} joint columns and {} has {} joints",
            table.source,
            table.joints,
            model.arm,
            model.chain.len()
        )
        .into());
    }
    let poses: Vec<Pose> = (0..table.len())
        .map(|row| Pose {
            q: table.q_of(row).to_vec(),
            approach: (0..table.joints).map(|joint| table.approach_of(row, joint)).collect(),
            payload: table
                .payload
                .as_ref()
                .and_then(|loads| loads.get(row))
                .copied()
                .filter(|load| load.is_finite())
                .unwrap_or(0.0),
        })
        .collect();
    let found = bodies(model, Some(target), &poses)?;
    let predicted: Vec<Vector3<f64>> = found.iter().map(|body| body.translation.vector).collect();
    let rotations: Vec<Rotation3<f64>> = found.iter().map(|body| body.rotation).collect();
    if !model.base.free {
        return Ok(Predicted {
            points: predicted,
            rotations: with_rotation_on_flange(model, table, target, rotations),
        });
    }
    let read = table.positions.iter().find(|columns| columns.target == target);
    let whole: Vec<(Vector3<f64>, Vector3<f64>)> = predicted
        .iter()
        .zip(read.into_iter().flat_map(|columns| &columns.xyz))
        .filter(|(_, xyz)| xyz.iter().all(|part| part.is_finite()))
        .map(|(point, xyz)| (*point, Vector3::from(*xyz)))
        .collect();
    let (from, to): (Vec<Vector3<f64>>, Vec<Vector3<f64>>) = whole.into_iter().unzip();
    let placed = rigid(&from, &to).ok_or_else(|| {
        format!("{}: the model's base is free, and fewer than three whole points were read to place it by: give commanded_x_mm ..., or a model with `base: {{free: false}}`", table.source)
    })?;
    let rotations = rotations.iter().map(|rotation| placed.rotation * rotation).collect();
    Ok(Predicted {
        points: predicted.iter().map(|point| placed.rotation * point + placed.translation.vector).collect(),
        rotations: with_rotation_on_flange(model, table, target, rotations),
    })
}

/// Predicted orientations with the target's turn on the flange as the rows have it, where the model leaves it free.
fn with_rotation_on_flange(
    model: &Model,
    table: &Table,
    target: &str,
    rotations: Vec<Rotation3<f64>>,
) -> Vec<Rotation3<f64>> {
    let known = model.targets.iter().find(|known| known.name == target);
    let number =
        table.positions.iter().find(|columns| columns.target == target).map(|columns| columns.number);
    let read = number.and_then(|number| table.orientations_as(Body::Target(number)));
    let (Some(_), Some(read)) = (known.filter(|known| known.rotation_free), read) else { return rotations };
    let each = rotations
        .iter()
        .zip(&read.rotations)
        .filter_map(|(rotation, read)| Some((rotation.inverse() * (*read)?).into_inner()));
    let svd = each.sum::<Matrix3<f64>>().svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return rotations };
    let mut mirror = Matrix3::identity();
    mirror[(2, 2)] = (u * v_t).determinant().signum();
    let more = Rotation3::from_matrix_unchecked(u * mirror * v_t);
    rotations.iter().map(|rotation| rotation * more).collect()
}

fn sentence(report: &Iso9283) -> String {
    let visits: usize = report.at.iter().map(|pose| pose.visits).sum();
    format!("{}: {visits} returns to {} poses or ways to them; lengths in mm", report.target, report.at.len())
}

fn text(report: &Iso9283, budget: Option<&Budget>, digits: u8) -> String {
    let mut text = format!("{}\n{}\n", report.standard, sentence(report));
    for grid in grids(report, digits) {
        text.push_str(&grid.text());
    }
    if let Some(budget) = budget {
        text.push_str(&budget_grid(budget, digits).text());
        text.push_str(&format!("  {}\n", budget_sentence(budget, digits)));
    }
    for note in &report.notes {
        text.push_str(&format!("note: {note}\n"));
    }
    text
}

/// The name of a pose with the sides it was reached from: `P1 (+ 0 -)`.
fn pose_name(pose: &AtPose) -> String {
    match &pose.sides {
        None => pose.pose.clone(),
        Some(sides) => {
            let signs: Vec<&str> = sides
                .iter()
                .map(|side| match side {
                    1 => "+",
                    -1 => "-",
                    _ => "0",
                })
                .collect();
            format!("{} ({})", pose.pose, signs.join(" "))
        }
    }
}

/// The greatest figures, the figures of each pose, and where there are any, drift and variation with the way of approach.
fn grids(report: &Iso9283, digits: u8) -> Vec<Grid> {
    let mut greatest = Grid::new("", &["greatest of all poses", "", "mm"]);
    let mut row = |name: &str, letter: &str, value: Option<f64>| {
        greatest.rows.push(vec![name.to_owned(), letter.to_owned(), or_dash(value, digits)]);
    };
    row("pose accuracy", "AP", report.accuracy);
    row("pose repeatability", "RP", Some(report.repeatability));
    row("variation with the way of approach", "vAP", report.variation);
    let mut poses =
        Grid::new("At each pose", &["pose", "returns", "AP", "AP x", "AP y", "AP z", "RP", "mean l", "S l"]);
    let mut drifts = Grid::new("Drift", &["pose", "dAP", "dRP", "over s", "measurements"]);
    for pose in &report.at {
        let part = |axis: usize| or_dash(pose.accuracy_parts.map(|parts| parts[axis]), digits);
        let mut row = vec![pose_name(pose), format!("{}", pose.visits), or_dash(pose.accuracy, digits)];
        row.extend([part(0), part(1), part(2)]);
        row.extend([pose.repeatability, pose.l_mean_mm, pose.s_l_mm].map(|value| number(value, digits)));
        poses.rows.push(row);
        if let Some(drift) = pose.drift {
            drifts.rows.push(vec![
                pose_name(pose),
                or_dash(drift.accuracy, digits),
                number(drift.repeatability, digits),
                number(drift.over_s, 0),
                format!("{}", drift.measurements),
            ]);
        }
    }
    let orientations = orientation_grids(report, digits);
    let mut variations = Grid::new("Variation with the way of approach", &["pose", "ways", "vAP"]);
    for one in &report.variations {
        variations.rows.push(vec![one.pose.clone(), format!("{}", one.ways), number(one.variation, digits)]);
    }
    let more = [drifts, variations].into_iter().filter(|grid| !grid.rows.is_empty());
    [greatest, poses].into_iter().chain(orientations).chain(more).collect()
}

/// The greatest figures of the orientation, and those of each pose; none where no orientation was read.
fn orientation_grids(report: &Iso9283, digits: u8) -> Vec<Grid> {
    let Some(all) = report.orientation else { return Vec::new() };
    let three = |values: Option<[f64; 3]>| match values {
        Some(values) => values.map(|value| number(value, digits)).to_vec(),
        None => vec![or_dash(None, digits); 3],
    };
    let mut greatest =
        Grid::new("Orientation, deg", &["greatest of all poses", "", "a (x)", "b (y)", "c (z)"]);
    for (name, letters, values) in [
        ("pose accuracy", "APa, APb, APc", all.accuracy),
        ("pose repeatability, to either side", "RPa, RPb, RPc", Some(all.repeatability)),
        ("variation with the way of approach", "vAPa, vAPb, vAPc", all.variation),
    ] {
        let mut row = vec![name.to_owned(), letters.to_owned()];
        row.extend(three(values));
        greatest.rows.push(row);
    }
    let mut poses =
        Grid::new("Orientation at each pose, deg", &["pose", "APa", "APb", "APc", "RPa", "RPb", "RPc"]);
    for pose in &report.at {
        let Some(own) = pose.orientation else { continue };
        let mut row = vec![pose_name(pose)];
        row.extend(three(own.accuracy));
        row.extend(three(Some(own.repeatability)));
        poses.rows.push(row);
    }
    vec![greatest, poses]
}

/// What was reached about each barycentre, seen along z.
fn drawing(report: &Iso9283, run: &PoseRun) -> Figure {
    let curves = report.at.iter().zip(&run.poses).map(|(at, pose)| Curve {
        name: pose_name(at),
        points: pose
            .visits
            .iter()
            .map(|visit| (visit.attained.x - at.barycentre_mm[0], visit.attained.y - at.barycentre_mm[1]))
            .collect(),
    });
    Figure {
        file_name: "iso-9283".to_owned(),
        title: format!("{}: what was reached, about each barycentre", report.standard),
        across: "x, mm".to_owned(),
        up: "y, mm".to_owned(),
        curves: curves.collect(),
        scattered: true,
    }
}

fn page(
    report: &Iso9283,
    run: &PoseRun,
    budget: Option<&Budget>,
    source: &str,
    digits: u8,
) -> Result<String, String> {
    let page = Page {
        title: format!("{}: {}", report.standard, report.target),
        lines: vec![format!("{}. Table: {source}", sentence(report))],
        grids: grids(report, digits),
        drawing: Some(svg(&drawing(report, run))?),
        budget: budget.map(|budget| (budget_grid(budget, digits), budget_sentence(budget, digits))),
        notes: report.notes.clone(),
    };
    Ok(page.html())
}
