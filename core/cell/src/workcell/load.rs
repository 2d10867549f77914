//! From a workcell file to a workcell that is in order.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use plumb_kinematics::Motion;

use super::model_file::{ModelRows, read_from_drive, read_rows};
use super::raw::{RawDevice, RawKeepOut, RawRobot, RawWorkcell};
use super::{
    DeviceSetting, KeepOutPlane, ModelFile, RobotSetting, Wire, Workcell, WorldSetting, cell_names, raw,
    tolerances,
};
use crate::cell_names::CellNames;
use crate::deg_or_mm::DegOrMm;
use crate::expression::Calculator;
use crate::procedure::{LoadedFiles, Procedure, check_procedure, load};
use crate::read_context::ReadContext;
use crate::step::read_action;
use plumb_document::{
    DocumentKind, FileKind, FileProblems, Problem, Problems, Span, did_you_mean, parse_as, read_document,
};

/// Reads a workcell with everything it names: models, procedures and those they call. What only the devices themselves can say is checked
/// when they are connected, before anything moves.
///
/// # Errors
/// Every mistake of every file, a [`FileProblems`] a file.
pub fn load_workcell(file: &Path, calculator: &Calculator) -> Result<Workcell, Vec<FileProblems>> {
    let text = read_document(file, FileKind::CELL).map_err(|problem| vec![problem])?;
    let problems = Problems::default();
    let root = parse_as(DocumentKind::Cell, file, &text, &problems).map_err(|problem| vec![problem])?;
    let folder = file.parent().unwrap_or(Path::new("."));
    let context = ReadContext { calculator, file: &text, folder, problems: &problems, read_action };
    let raw = raw::read(&root, &context);
    let mut loader = Loader { folder: file.parent().unwrap_or(Path::new(".")), context, wrong: Vec::new() };
    let workcell = raw.map(|raw| loader.workcell(file, &text, raw));
    let mut wrong = std::mem::take(&mut loader.wrong);
    if let Err(own) = problems.into_result(file, &text) {
        wrong.insert(0, own);
    }
    match workcell {
        Some(workcell) if wrong.is_empty() => Ok(workcell),
        _ => Err(wrong),
    }
}

/// The most devices of a cell. Each is a process with its own streams in shared memory, of which iceoryx2 opens some ten files.
const MOST_DEVICES: usize = 64;

struct Loader<'a> {
    folder: &'a Path,
    context: ReadContext<'a>,
    /// Mistakes in files that this one names.
    wrong: Vec<FileProblems>,
}

impl Loader<'_> {
    fn workcell(&mut self, file: &Path, text: &str, raw: RawWorkcell) -> Workcell {
        let problems = self.context.problems;
        let devices_known = raw.devices.is_some();
        let raw_devices = raw.devices.unwrap_or_default();
        if let Some(device) = raw_devices.get(MOST_DEVICES) {
            let message = format!("the cell has {} devices", raw_devices.len());
            let help = format!("at most {MOST_DEVICES} are run: each is a process of its own");
            problems.add(device.name.span, message, help);
        }
        if devices_known && raw_devices.is_empty() {
            let message = "the cell has no devices".to_owned();
            problems.push(Problem { span: None, message, help: None });
        }
        let world = raw
            .world
            .and_then(|world| Some(WorldSetting { file: self.existing(&world.file)?, pace: world.pace }));
        let devices: Vec<DeviceSetting> =
            raw_devices.iter().map(|device| self.device(device, &raw_devices, world.is_some())).collect();
        let known_robots = raw.robots.as_ref().map(|robots| {
            robots.iter().map(|robot| (robot.device.name.clone(), robot.model.is_some())).collect::<Vec<_>>()
        });
        let robots: Vec<RobotSetting> = raw
            .robots
            .unwrap_or_default()
            .into_iter()
            .map(|robot| self.robot(robot, devices_known.then_some(&devices)))
            .collect();
        let keep_out = raw.keep_out.into_iter();
        let keep_out = keep_out.filter_map(|plane| self.keep_out(plane, known_robots.as_deref())).collect();
        let names = cell_names(&devices, &robots);
        let procedures = self.procedures(&raw.procedures, &names);
        tolerances::check(&raw.tolerances, &procedures, problems);
        let answers = raw.answers.and_then(|answers| self.existing(&answers));
        let plugins = raw.plugins.iter().filter_map(|directory| self.existing_directory(directory)).collect();
        let title = raw.title.unwrap_or_else(|| raw.name.clone());
        Workcell {
            file: file.to_owned(),
            text: text.to_owned(),
            name: raw.name,
            title,
            world,
            plugins,
            devices,
            robots,
            keep_out,
            target: raw.target,
            instruments: raw.instruments,
            tolerances: raw.tolerances.into_iter().map(|(name, value)| (name.name, value)).collect(),
            procedures,
            answers,
        }
    }

    /// The path of a file named here; its absence is reported.
    fn existing(&self, (name, span): &(String, Span)) -> Option<PathBuf> {
        let path = self.folder.join(name);
        // What is there and no file is reported by who reads it.
        if path.exists() {
            return Some(path);
        }
        let message = format!("there is no file {}", path.display());
        self.context.problems.add(*span, message, "the name is relative to this file");
        None
    }

    /// The path of a directory named here; its absence is reported.
    fn existing_directory(&self, (name, span): &(String, Span)) -> Option<PathBuf> {
        let path = self.folder.join(name);
        if path.is_dir() {
            return Some(path);
        }
        let message = format!("there is no directory {}", path.display());
        self.context.problems.add(*span, message, "the name is relative to this file");
        None
    }

    fn device(&self, raw: &RawDevice, all: &[RawDevice], simulated: bool) -> DeviceSetting {
        let problems = self.context.problems;
        if let Some((_, span)) = &raw.emulate {
            if !simulated {
                let message = "a controller is emulated only over the arm of a simulated world";
                problems.add(*span, message, "add `world: {file: ...}` to the cell, or take `emulate` away");
            }
            if let Some(key) = ["port", "address"].into_iter().find(|key| raw.config.get(key).is_some()) {
                let message =
                    format!("the {key} of an emulated controller is known when it has been started");
                problems.add(*span, message, format!("take `{key}` out of the device's `config`"));
            }
        }
        let inputs = raw.inputs.iter().filter_map(|(input, stream, span)| {
            let Some((device, stream)) = stream.split_once('/') else {
                problems.add(
                    *span,
                    format!("`{stream}` is no stream"),
                    "write the device and its stream, as in `arm/inputs`",
                );
                return None;
            };
            if !all.iter().any(|other| other.name.name == device) {
                let help = did_you_mean(device, all.iter().map(|other| other.name.name.as_str()));
                problems.add(*span, format!("there is no device `{device}` in the cell"), help);
            } else if device == raw.name.name {
                problems.add(*span, "a device cannot take in its own stream", "");
            }
            Some(Wire {
                input: input.clone(),
                device: device.to_owned(),
                stream: stream.to_owned(),
                span: *span,
            })
        });
        DeviceSetting {
            name: raw.name.name.clone(),
            span: raw.name.span,
            inputs: inputs.collect(),
            plugin: raw.plugin.0.clone(),
            config: raw.config.clone(),
            emulate: raw.emulate.as_ref().map(|(controller, _)| controller.clone()),
            memory_limit_mb: raw.memory_limit_mb,
        }
    }

    /// `devices` are those of the cell, where they are known.
    fn robot(&mut self, raw: RawRobot, devices: Option<&Vec<DeviceSetting>>) -> RobotSetting {
        let problems = self.context.problems;
        if let Some(devices) = devices
            && !devices.iter().any(|device| device.name == raw.device.name)
        {
            let help = did_you_mean(&raw.device.name, devices.iter().map(|device| device.name.as_str()));
            problems.add(
                raw.device.span,
                format!("there is no device `{}` in the cell", raw.device.name),
                help,
            );
        }
        let typed_joints = raw.joints.as_deref().unwrap_or_default();
        let joints: Vec<String> = typed_joints.iter().map(|(joint, _)| joint.name.clone()).collect();
        let known = |joint: &str, span: Span| {
            let found = raw.joints.is_none() || joints.iter().any(|known| known == joint);
            if !found {
                let help = did_you_mean(joint, joints.iter().map(String::as_str));
                problems.add(span, format!("`joints` names no `{joint}`"), help);
            }
            found
        };
        let limits = raw.limits.iter().filter(|(joint, unit, _)| {
            let written = typed_joints.iter().find(|(name, _)| name.name == joint.name);
            if let Some(written) = written.and_then(|(_, unit)| *unit).filter(|written| written != unit) {
                let message = format!("joint `{}` goes by {}", joint.name, written.symbol());
                problems.add(joint.span, message, format!("write it under `limits_{}`", written.symbol()));
            }
            known(&joint.name, joint.span)
        });
        let limits = limits.map(|(joint, unit, [least, most])| {
            (joint.name.clone(), unit.to_internal(*least), unit.to_internal(*most))
        });
        let limits = limits.collect();
        let mut initialize: Vec<String> = Vec::new();
        for (joint, span) in &raw.initialize {
            if initialize.contains(joint) {
                problems.add(*span, format!("`initialize` names `{joint}` twice"), "name each joint once");
            } else if known(joint, *span) {
                initialize.push(joint.clone());
            }
        }
        let model = raw.model.as_ref().and_then(|model| self.model(model, &raw, &joints));
        RobotSetting {
            device: raw.device.name.clone(),
            joints: typed_joints
                .iter()
                .map(|(joint, unit)| (joint.name.clone(), unit.unwrap_or(DegOrMm::Deg)))
                .collect(),
            model,
            limits,
            initialize,
        }
    }

    fn model(&mut self, model: &(String, Span), raw: &RawRobot, joints: &[String]) -> Option<ModelFile> {
        let file = plumb_calibration::revision::Family::newest_file(&self.existing(model)?);
        match read_rows(&file) {
            Ok(ModelRows {
                text,
                model: whole,
                joints: model_joints,
                quantities,
                surfaces,
                levels,
                forward,
            }) => {
                for joint in &model_joints {
                    let given = raw.model_from_drive.iter().any(|(name, _)| name.name == *joint);
                    if !given && raw.joints.is_some() && !joints.contains(joint) {
                        let message = format!("nothing drives the model's joint `{joint}`");
                        let help =
                            "name the drive's joint the same in `joints`, or give it in `model_from_drive`";
                        self.context.problems.add(model.1, message, help);
                    }
                }
                let slides: Vec<bool> =
                    whole.chain.joints.iter().map(|joint| joint.motion == Motion::Slides).collect();
                let from_drive =
                    read_from_drive(&model_joints, &slides, joints, &raw.model_from_drive, &self.context);
                Some(ModelFile {
                    file,
                    text,
                    model: whole,
                    joints: model_joints,
                    quantities,
                    surfaces,
                    levels,
                    from_drive,
                    forward,
                })
            }
            Err(problems) => {
                self.wrong.push(problems);
                None
            }
        }
    }

    /// `robots` are those of the cell with whether a model is named, where they are known.
    fn keep_out(&self, raw: RawKeepOut, robots: Option<&[(String, bool)]>) -> Option<KeepOutPlane> {
        let problems = self.context.problems;
        let (robot, span) = &raw.robot;
        match robots.map(|robots| (robots, robots.iter().find(|(known, _)| known == robot))) {
            None => {}
            Some((robots, None)) => {
                let help = did_you_mean(robot, robots.iter().map(|(robot, _)| robot.as_str()));
                problems.add(*span, format!("there is no robot `{robot}` in the cell"), help);
            }
            Some((_, Some((_, false)))) => {
                problems.add(
                    *span,
                    format!("robot `{robot}` has no model"),
                    "give it one: where its parts are cannot be known without",
                );
            }
            Some((_, Some(_))) => {}
        }
        let length = raw.normal.iter().map(|n| n * n).sum::<f64>().sqrt();
        if length < 1e-9 {
            problems.add(raw.normal_span, "the normal of a plane has a length", "for a table: `[0, 0, 1]`");
            return None;
        }
        let normal = raw.normal.map(|n| n / length);
        Some(KeepOutPlane { name: raw.name, robot: raw.robot.0, normal, offset_mm: raw.offset_mm })
    }

    fn procedures(&mut self, named: &[(String, Span)], names: &CellNames) -> Vec<Arc<Procedure>> {
        // A mistake here may be why a name in a procedure leads nowhere: first things first.
        let names_are_right = self.context.problems.is_empty() && self.wrong.is_empty();
        let mut procedures: Vec<Arc<Procedure>> = Vec::new();
        for (name, span) in named {
            let Some(path) = self.existing(&(name.clone(), *span)) else { continue };
            let loaded = load(&path, self.context.calculator, &mut LoadedFiles::default());
            self.add_wrong(loaded.wrong);
            let Some(procedure) = loaded.procedure else { continue };
            if names_are_right {
                self.add_wrong(check_procedure(&procedure, names).err().unwrap_or_default());
            }
            if procedures.iter().any(|known| known.name == procedure.name) {
                let message = format!("two procedures are called `{}`", procedure.name);
                self.context.problems.add(*span, message, "give each a name of its own");
            }
            procedures.push(Arc::new(procedure));
        }
        procedures
    }

    /// Adds mistakes in other files, those of one file together and none twice.
    fn add_wrong(&mut self, more: Vec<FileProblems>) {
        for problems in more {
            match self.wrong.iter_mut().find(|known| known.file == problems.file) {
                Some(known) => known.add(problems),
                None => self.wrong.push(problems),
            }
        }
    }
}
