//! The model file of a robot, as far as a cell needs it: the numbers of its rows for expressions, and how the drive's angles become the model's.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use plumb_calibration::arm_model::Model;
use plumb_calibration::file::ModelFileError;
use plumb_calibration::forward::ForwardModel;
use plumb_kinematics::{Chain, Motion};
use serde_json::{Map, Value, json};

use crate::expression::{Calculator, Expression, Names, Shape};
use crate::read_context::ReadContext;
use plumb_document::{
    FileKind, FileProblems, Key, Node, NodeValue, Problem, Problems, did_you_mean, parse, read_document,
};

/// The geometry of a robot.
#[derive(Debug, Clone)]
pub struct ModelFile {
    /// Its file: the newest revision of the one that the cell names.
    pub file: PathBuf,
    /// The file's text.
    pub text: String,
    /// What it says, with everything that was found and added.
    pub model: Arc<Model>,
    /// Names of the model's joints, in order.
    pub joints: Vec<String>,
    /// The numbers of each joint's row: `{"shoulder": {"a_mm": 177.8, ...}, ...}`.
    pub quantities: Map<String, Value>,
    /// Names of the surfaces that trigger poses and stripes lie on.
    pub surfaces: Vec<String>,
    /// Names of the locations a spirit level lies at.
    pub levels: Vec<String>,
    /// The model's joints from the drive's: coefficients, one row a model joint, one column a joint of the cell's list, then the constant
    /// (rad, or mm for a model joint that slides).
    pub from_drive: Vec<Vec<f64>>,
    /// Where the flange is, with every effect of the file.
    pub forward: Arc<ForwardModel>,
}

impl ModelFile {
    /// The model's joints for the drive's (rad, or mm of one that slides), in the order of the cell's list of joints.
    pub fn model_joints(&self, drive: &[f64]) -> Vec<f64> {
        self.from_drive.iter().map(|row| model_joint(row, drive)).collect()
    }

    /// Whether a joint of the model slides, so that its coordinate is a length.
    pub fn slides(&self, joint: usize) -> bool {
        self.chain().joints.get(joint).is_some_and(|joint| joint.motion == Motion::Slides)
    }

    /// Its nominal chain of joints.
    pub fn chain(&self) -> &Chain {
        &self.model.chain
    }

    /// The way in which the model's joints arrived (`Table::approach`), for the ways in which the drive's did: that of the one joint of the drive that turns
    /// it, or of `searched` where there are several; 0 where that is not known.
    pub fn model_sides(&self, drive: &[i8], searched: Option<usize>) -> Vec<i8> {
        let side = |row: &Vec<f64>| {
            let turning = |column: &usize| row.get(*column).is_some_and(|turns| *turns != 0.0);
            let mut columns = (0..drive.len()).filter(turning);
            let one = match (columns.next(), columns.next()) {
                (Some(only), None) => Some(only),
                _ => searched.filter(turning),
            };
            let signed = one.map(|column| {
                let turns = row.get(column).copied().unwrap_or(0.0);
                f64::from(drive.get(column).copied().unwrap_or(0)) * turns.signum()
            });
            signed.unwrap_or(0.0) as i8
        };
        self.from_drive.iter().map(side).collect()
    }

    /// What expressions may name of it.
    pub(crate) fn shape(&self) -> Shape {
        let rows = self.quantities.iter().map(|(joint, row)| {
            let entries =
                row.as_object().into_iter().flatten().map(|(name, _)| (name.clone(), Shape::Single));
            (joint.clone(), Shape::Map(entries.collect()))
        });
        Shape::Map(rows.collect())
    }
}

/// What is read of a model file.
#[derive(Debug)]
pub(super) struct ModelRows {
    pub(super) text: String,
    pub(super) model: Arc<Model>,
    pub(super) joints: Vec<String>,
    pub(super) quantities: Map<String, Value>,
    pub(super) surfaces: Vec<String>,
    pub(super) levels: Vec<String>,
    pub(super) forward: Arc<ForwardModel>,
}

/// A model joint's angle (rad) from the drive's (rad): coefficients, then the constant. A joint of the drive whose position is not known (NaN) leaves
/// those unknown that depend on it.
pub(super) fn model_joint(row: &[f64], drive: &[f64]) -> f64 {
    match row.split_last() {
        Some((constant, coefficients)) => {
            let driving = coefficients.iter().zip(drive).filter(|(c, _)| **c != 0.0);
            constant + driving.map(|(c, q)| c * q).sum::<f64>()
        }
        None => 0.0,
    }
}

/// Checks a model file whole, as the model lab reads it.
///
/// # Errors
/// The first mistake in it.
pub(crate) fn check_model(file: &Path) -> Result<(), FileProblems> {
    parse_model(file, &read_document(file, FileKind::CELL)?).map(|_| ())
}

fn parse_model(file: &Path, text: &str) -> Result<Model, FileProblems> {
    Model::parse(&file.display().to_string(), text).map_err(|ModelFileError(problems)| problems)
}

/// Reads the rows of a model file. The joints are those of the model, so that one whose arm is described by a URDF file needs no `joints:`.
pub(super) fn read_rows(file: &Path) -> Result<ModelRows, FileProblems> {
    let text = read_document(file, FileKind::CELL)?;
    let model = parse_model(file, &text)?;
    let problems = Problems::default();
    let mut written = written_rows(&parse(file, &text, &problems)?, &problems);
    problems.into_result(file, &text)?;
    let joints: Vec<String> = model.chain.joints.iter().map(|joint| joint.name.clone()).collect();
    let row_of = |joint: &String| (joint.clone(), written.remove(joint).unwrap_or_else(|| json!({})));
    let quantities = joints.iter().map(row_of).collect();
    let surfaces = model.surfaces.iter().map(|surface| surface.name.clone()).collect();
    let levels = model.levels.iter().filter_map(|level| level.name.clone()).collect();
    let forward = ForwardModel::new(model.clone()).map_err(|error| FileProblems {
        file: file.to_owned(),
        text: text.clone(),
        problems: vec![Problem { span: None, message: error.to_string(), help: None }],
    })?;
    Ok(ModelRows {
        text,
        model: Arc::new(model),
        joints,
        quantities,
        surfaces,
        levels,
        forward: Arc::new(forward),
    })
}

/// The numbers that the file gives of each joint, by the joint's name.
fn written_rows(root: &Node, problems: &Problems) -> Map<String, Value> {
    let entries = root.entries("a model", problems).unwrap_or_default();
    let rows = entries.iter().find(|(key, _)| key.name == "joints").map(|(_, node)| node);
    let rows = rows.and_then(|node| node.list("`joints`", problems)).unwrap_or_default();
    rows.iter().filter_map(|row| written_row(row, problems)).collect()
}

/// The name and the numbers of one joint.
fn written_row(row: &Node, problems: &Problems) -> Option<(String, Value)> {
    let columns = row.entries("a joint", problems)?;
    let (_, name) = columns.iter().find(|(key, _)| key.name == "name")?;
    let numbers = columns.iter().filter_map(|(key, node)| match node.value {
        NodeValue::Number(number) => Some((key.name.clone(), Value::from(number))),
        _ => None,
    });
    Some((name.text("`name`", problems)?.to_owned(), Value::Object(numbers.collect())))
}

/// Reads `model_from_drive`: for each model joint an expression that is linear in the drive's joints. A model joint that is not named is
/// the drive joint of the same name.
pub(super) fn read_from_drive(
    model_joints: &[String],
    slides: &[bool],
    drive_joints: &[String],
    entries: &[(Key, Node)],
    context: &ReadContext<'_>,
) -> Vec<Vec<f64>> {
    for (name, _) in entries {
        if !model_joints.contains(&name.name) {
            let help = did_you_mean(&name.name, model_joints.iter().map(String::as_str));
            context.problems.add(name.span, format!("the model has no joint `{}`", name.name), help);
        }
    }
    model_joints
        .iter()
        .zip(slides)
        .map(|(joint, slides)| match entries.iter().find(|(name, _)| name.name == *joint) {
            Some((_, node)) => read_row(node, *slides, drive_joints, context)
                .unwrap_or_else(|| vec![0.0; drive_joints.len() + 1]),
            None => {
                drive_joints.iter().map(|drive| f64::from(u8::from(drive == joint))).chain([0.0]).collect()
            }
        })
        .collect()
}

fn read_row(
    node: &Node,
    slides: bool,
    drive_joints: &[String],
    context: &ReadContext<'_>,
) -> Option<Vec<f64>> {
    let expression = context.expression(node, "a joint of the model")?;
    let mut names = Names::default();
    drive_joints.iter().for_each(|joint| names.set(joint, Shape::Single));
    let before = context.problems.len();
    expression.check_names(&names, context.file, context.problems);
    if context.problems.len() > before {
        return None;
    }
    match linear_coefficients(&expression, slides, drive_joints, context.calculator) {
        Ok(row) => Some(row),
        Err(reason) => {
            context.problems.add(
                node.span,
                reason,
                "write sums and multiples of the drive's joints, in degrees, as in `elbow - shoulder`",
            );
            None
        }
    }
}

/// Coefficients and constant (rad, or mm of a slide) of an expression in degrees, or millimetres, found by trying; refused when another try does not agree.
fn linear_coefficients(
    expression: &Expression,
    slides: bool,
    joints: &[String],
    calculator: &Calculator,
) -> Result<Vec<f64>, String> {
    let at = |values: &dyn Fn(usize) -> f64| {
        let values = joints
            .iter()
            .enumerate()
            .map(|(index, joint)| (joint.clone(), Value::from(values(index))))
            .collect();
        expression.number(calculator, &values).map_err(|error| error.to_string())
    };
    let constant = at(&|_| 0.0)?;
    let mut row = Vec::new();
    for joint in 0..joints.len() {
        row.push(at(&|index| if index == joint { 1.0 } else { 0.0 })? - constant);
    }
    let trial = |index: usize| 17.0 + 3.5 * index as f64;
    let expected: f64 = constant + row.iter().enumerate().map(|(index, c)| c * trial(index)).sum::<f64>();
    if (at(&trial)? - expected).abs() > 1e-9 * expected.abs().max(1.0) {
        return Err("this is not linear in the drive's joints".to_owned());
    }
    row.push(if slides { constant } else { constant.to_radians() });
    Ok(row)
}

#[cfg(test)]
mod tests {
    use super::*;

    const URDF: &str = r#"<robot name="two"><link name="base"/><link name="post"/><link name="hand"/>
      <joint name="column" type="revolute"><parent link="base"/><child link="post"/><axis xyz="0 0 1"/>
        <limit lower="-3" upper="3" velocity="1" effort="0"/></joint>
      <joint name="reach" type="prismatic"><parent link="post"/><child link="hand"/><axis xyz="1 0 0"/>
        <limit lower="0" upper="0.5" velocity="1" effort="0"/></joint></robot>"#;

    /// What is read of a model whose arm is described in a URDF file, with these keys besides.
    fn read(keys: &str) -> Result<ModelRows, FileProblems> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("two.urdf"), URDF).unwrap();
        let file = folder.path().join("two.model.yaml");
        std::fs::write(&file, format!("arm: two\nconvention: {{urdf: two.urdf}}\n{keys}")).unwrap();
        read_rows(&file)
    }

    #[test]
    fn a_models_joints_are_those_of_its_urdf_file() {
        let rows = read("").unwrap();
        assert_eq!(rows.joints, ["column", "reach"]);
        assert_eq!(rows.quantities.len(), 2);
        let slides: Vec<bool> = (0..2).map(|joint| rows.model.slides(joint)).collect();
        assert_eq!(slides, [false, true]);
    }

    #[test]
    fn rows_that_add_to_a_urdf_file_keep_its_order_and_need_not_be_complete() {
        let rows = read("joints: [{name: reach, gear_ratio: 4}]\n").unwrap();
        assert_eq!(rows.joints, ["column", "reach"]);
        assert_eq!(rows.quantities["reach"]["gear_ratio"], 4.0);
        assert_eq!(rows.quantities["column"], json!({}));
    }

    #[test]
    fn a_joint_that_the_urdf_file_does_not_have_is_refused_with_its_position() {
        let problems = read("joints: [{name: rich}]\n").unwrap_err().problems;
        assert_eq!(problems.len(), 1, "{problems:?}");
        assert!(
            problems[0].message.contains("no joint `rich`") && problems[0].span.is_some(),
            "{problems:?}"
        );
    }
}
