//! The model file of a robot, as far as a cell needs it: the numbers of its rows for expressions, and how the drive's angles become the model's.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use plumb_calibration::arm_model::Model;
use plumb_calibration::file::ModelFileError;
use plumb_calibration::forward::ForwardModel;
use plumb_kinematics::{Chain, Motion};
use serde_json::{Map, Value};

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
    /// Names of the places a spirit level lies at.
    pub levels: Vec<String>,
    /// The model's joints from the drive's: coefficients, one row a model joint, one column a joint of the cell's list, then the constant
    /// (rad, or mm for a model joint that slides).
    pub from_drive: Vec<Vec<f64>>,
    /// Where the flange stands, with every effect of the file.
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

    /// From which side the model's joints arrived, for the sides from which the drive's did: that of the one joint of the drive that turns
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
pub(super) struct ModelRows {
    pub(super) text: String,
    pub(super) model: Arc<Model>,
    pub(super) joints: Vec<String>,
    pub(super) quantities: Map<String, Value>,
    pub(super) surfaces: Vec<String>,
    pub(super) levels: Vec<String>,
    pub(super) forward: Arc<ForwardModel>,
}

/// A model joint's angle (rad) from the drive's (rad): coefficients, then the constant.
pub(super) fn model_joint(row: &[f64], drive: &[f64]) -> f64 {
    match row.split_last() {
        Some((constant, coefficients)) => {
            constant + coefficients.iter().zip(drive).map(|(c, q)| c * q).sum::<f64>()
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

/// Reads the rows of a model file.
pub(super) fn read_rows(file: &Path) -> Result<ModelRows, FileProblems> {
    let text = read_document(file, FileKind::CELL)?;
    let problems = Problems::default();
    let root = parse(file, &text, &problems)?;
    let entries = root.entries("a model", &problems).unwrap_or_default();
    let rows = entries.iter().find(|(key, _)| key.name == "joints").map(|(_, node)| node);
    let rows = match rows {
        Some(node) => node.list("`joints`", &problems).unwrap_or_default(),
        None => {
            problems.add(root.span, "a model has the key `joints`", "");
            &[]
        }
    };
    let mut joints = Vec::new();
    let mut quantities = Map::new();
    for row in rows {
        let Some(columns) = row.entries("a joint", &problems) else { continue };
        let Some((_, name)) = columns.iter().find(|(key, _)| key.name == "name") else {
            problems.add(row.span, "a joint has the key `name`", "");
            continue;
        };
        let Some(name) = name.text("`name`", &problems) else { continue };
        let numbers = columns.iter().filter_map(|(key, node)| match node.value {
            NodeValue::Number(number) => Some((key.name.clone(), Value::from(number))),
            _ => None,
        });
        joints.push(name.to_owned());
        quantities.insert(name.to_owned(), Value::Object(numbers.collect()));
    }
    problems.into_result(file, &text)?;
    let model = parse_model(file, &text)?;
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
