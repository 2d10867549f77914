//! Workcell files: which devices there are, how they are wired, what they may do, and which procedures they run.
//!
//! A file is read in two stages: [`raw`](self) holds what was typed, with its positions; [`Workcell`] holds what is true: every name in it leads
//! somewhere, every file it names was read and fits.

mod instruments;
mod keep_out;
mod load;
mod model_file;
mod raw;
mod robot;
mod target;
mod tolerances;

use std::path::PathBuf;
use std::sync::Arc;

use plumb_record::Instrument;
use serde_json::Value;

pub(crate) use keep_out::{BoundKeepOut, KeepOut};
pub use keep_out::{KeepOutPlane, Trespass, guard};
pub use load::load_workcell;
pub use model_file::ModelFile;
pub(crate) use model_file::check_model;
pub use robot::RobotSetting;
pub use target::{OverTarget, TTarget, Under};

use crate::cell_names::CellNames;
use crate::procedure::Procedure;
use plumb_document::Span;

/// A workcell that was read and is in order.
#[derive(Debug, Clone)]
pub struct Workcell {
    /// Its file.
    pub file: PathBuf,
    /// The file's text.
    pub text: String,
    /// Its name; the record keeps corrections under it.
    pub name: String,
    /// For people.
    pub title: String,
    /// The simulated world it is in, for a simulated cell.
    pub world: Option<WorldSetting>,
    /// Directories with plugins of its own, beside those that are known.
    pub plugins: Vec<PathBuf>,
    /// Its devices.
    pub devices: Vec<DeviceSetting>,
    /// What is said about those of them that move.
    pub robots: Vec<RobotSetting>,
    /// Where no part of a robot may go.
    pub keep_out: Vec<KeepOutPlane>,
    /// The T target on its table, as it is meant to lie.
    pub target: Option<TTarget>,
    /// What the operator measures with.
    pub instruments: Vec<Instrument>,
    /// What is known of the cell's parts, and how well: sizes of errors that procedures refer to. The unit is the end of the name.
    pub tolerances: Vec<(String, f64)>,
    /// What it can run; the first is what it runs unless specified otherwise.
    pub procedures: Vec<Arc<Procedure>>,
    /// Answers for unattended runs.
    pub answers: Option<PathBuf>,
}

/// The simulated world of a cell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorldSetting {
    /// The world file.
    pub file: PathBuf,
    /// How its time goes.
    pub pace: Pace,
}

/// How the time of a simulated world goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// As on the wall.
    Real,
    /// As fast as can be, when nobody watches.
    Fast,
}

impl Pace {
    /// `real` or `fast`.
    pub fn name(self) -> &'static str {
        match self {
            Pace::Real => "real",
            Pace::Fast => "fast",
        }
    }
}

/// One device.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceSetting {
    /// Its name in the cell.
    pub name: String,
    /// Where the name is written in the file.
    pub span: Span,
    /// The plugin that serves it.
    pub plugin: String,
    /// What the plugin is given.
    pub config: Value,
    /// The controller that replaces a real one, over the arm of the simulated world: the device's port leads to it.
    pub emulate: Option<String>,
    /// The most memory its process may take, MB; the host's own limit when none.
    pub memory_limit_mb: Option<u64>,
    /// Which streams of other devices it takes in.
    pub inputs: Vec<Wire>,
}

/// A stream of one device led to an input of another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wire {
    /// The input.
    pub input: String,
    /// The device the stream comes from.
    pub device: String,
    /// The stream.
    pub stream: String,
    /// Where it is in the file.
    pub span: Span,
}

impl Workcell {
    /// What is said about a robot.
    pub fn robot(&self, name: &str) -> Option<&RobotSetting> {
        self.robots.iter().find(|robot| robot.device == name)
    }

    /// The procedure of this name, or in this file.
    pub fn procedure(&self, requested: &str) -> Option<&Arc<Procedure>> {
        self.procedures
            .iter()
            .find(|procedure| procedure.name == requested || procedure.file.ends_with(requested))
    }
}

/// What these devices offer, as far as it is known before they are started.
pub(crate) fn cell_names(devices: &[DeviceSetting], robots: &[RobotSetting]) -> CellNames {
    let is_sensor = |name: &String| robots.iter().all(|robot| robot.device != *name);
    let model = |robot: &RobotSetting| Some((robot.device.clone(), robot.model.as_ref()?.shape()));
    CellNames {
        robots: robots.iter().map(RobotSetting::names).collect(),
        sensors: devices.iter().map(|device| device.name.clone()).filter(is_sensor).collect(),
        quantities: Vec::new(),
        streams: Vec::new(),
        models: robots.iter().filter_map(model).collect(),
    }
}
