//! The options of `plumb model`.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use clap_complete::ArgValueCandidates;
use plumb_calibration::arm_model::Model;
use plumb_calibration::revision::{Entry, Family, RevisionError};
use plumb_calibration::table::{Naming, Rename, Table};
use plumb_cell::measurement_table::{HASH_COMMENT, MODEL_COMMENT};
use plumb_diagnosis::laboratory::{Laboratory, LaboratoryError, Options};
use plumb_diagnosis::split::Holdout;
use plumb_kinematics::HalfSpace;

use crate::completion;

/// A model, a table, and how to bring them together.
#[derive(Debug, Args)]
pub(crate) struct PairArguments {
    /// The model file. The original means its newest revision; name a revision's own file to use that.
    pub(crate) model: PathBuf,
    /// The measurement table.
    #[arg(short, long, value_name = "CSV")]
    pub(crate) data: PathBuf,
    /// Effects that are always fitted, instead of the file's `free:`: `none`, or a list such as `joint_zero(*),link_length(elbow)`.
    #[arg(long, value_name = "LIST")]
    free: Option<String>,
    /// Hold-out rows to check with: regions, random:0.3:SEED, time:0.3, session, none.
    #[arg(long, default_value = "regions", value_name = "HOW")]
    holdout: Holdout,
    /// Plain least squares: let far poses pull as hard as they like.
    #[arg(long)]
    least_squares: bool,
    /// Take a table that says it was measured with another model.
    #[arg(long)]
    any_model: bool,
    /// Read a column by another name, as in J1=q1_deg,X=p1_x_mm; OLD= leaves the column out. The joints may also be called as the model calls
    /// them, as in shoulder_deg.
    #[arg(long, value_name = "OLD=NEW", value_delimiter = ',')]
    columns: Vec<Rename>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// How the headers of a model's table are read.
pub(crate) fn naming(model: &Model, renamed: &[Rename]) -> Naming {
    let joints = model.chain.joints.iter().map(|joint| joint.name.clone()).collect();
    Naming { joints, renamed: renamed.to_vec() }
}

/// A list of effects, split at the commas outside brackets.
fn free_list(text: &str) -> Vec<String> {
    if text.trim() == "none" {
        return Vec::new();
    }
    let mut list = vec![String::new()];
    let mut depth = 0;
    for letter in text.chars() {
        match letter {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
        match (letter, depth, list.last_mut()) {
            (',' | ';', 0, _) => list.push(String::new()),
            (letter, _, Some(last)) => last.push(letter),
            (_, _, None) => {}
        }
    }
    list.iter().map(|part| part.trim().to_owned()).filter(|part| !part.is_empty()).collect()
}

/// A laboratory, and the revision of the model it works on.
pub(crate) struct Opened {
    pub(crate) laboratory: Laboratory,
    pub(crate) family: Family,
    pub(crate) entry: Entry,
}

/// Why a pair of files cannot be opened.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OpenError {
    #[error(transparent)]
    Revision(#[from] RevisionError),
    #[error(transparent)]
    Laboratory(#[from] LaboratoryError),
    #[error(
        "{} was measured with another model, {measured_with} (cell {cell}, run {run}): give that model, or the table of a run of this \
         model's cell; --any-model takes them together all the same", table.display()
    )]
    OtherModel { table: PathBuf, measured_with: String, cell: String, run: String },
}

impl PairArguments {
    /// Reads both files.
    pub(crate) fn open(&self) -> Result<Opened, OpenError> {
        let entry = Family::resolve(&self.model)?;
        let naming = naming(&entry.model, &self.columns);
        let table = Table::read_named(&self.data, &naming).map_err(LaboratoryError::from)?;
        if !self.any_model {
            self.require_own_table(&table)?;
        }
        let mut options = Options {
            free: self.free.as_deref().map(free_list),
            holdout: self.holdout,
            ..Options::default()
        };
        options.fit.robust = !self.least_squares;
        let laboratory = Laboratory::new(entry.model.clone(), table, options)?;
        Ok(Opened { laboratory, family: Family::of(&self.model)?, entry })
    }

    /// A table that says with which model it was measured is of the cell with that model: its joints mean something else in another. The
    /// model is the same when its file is called so, whatever revision it is, or when its text is the same, whatever it is called.
    fn require_own_table(&self, table: &Table) -> Result<(), OpenError> {
        let comment = |what: &str| {
            table
                .comments
                .iter()
                .find_map(|line| line.strip_prefix(what)?.strip_prefix(": ").map(str::to_owned))
        };
        let Some(measured_with) = comment(MODEL_COMMENT) else { return Ok(()) };
        let family = Family::of(&self.model)?;
        let same_name =
            Family::of(Path::new(&measured_with)).is_ok_and(|theirs| theirs.original() == family.original());
        let text = std::fs::read(&self.model).unwrap_or_default();
        if same_name || comment(HASH_COMMENT) == Some(plumb_record::sha256_hex(&text)) {
            return Ok(());
        }
        let unknown = || "unknown".to_owned();
        Err(OpenError::OtherModel {
            table: self.data.clone(),
            measured_with,
            cell: comment("cell").unwrap_or_else(unknown),
            run: comment("run").unwrap_or_else(unknown),
        })
    }

    /// The table's file name, as revisions note it.
    pub(crate) fn data_name(&self) -> String {
        self.data.file_name().unwrap_or(self.data.as_os_str()).to_string_lossy().into_owned()
    }
}

/// How residuals are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PlotFormat {
    /// A file of vector graphics.
    Svg,
    /// In the terminal.
    Term,
}

/// Options of `compare`.
#[derive(Debug, Args)]
pub(crate) struct CompareArguments {
    #[command(flatten)]
    pub(crate) pair: PairArguments,
    /// Draw the residuals.
    #[arg(long, value_enum)]
    pub(crate) plot: Option<PlotFormat>,
    /// File to draw to; `residuals.svg` when not given.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

impl CompareArguments {
    pub(crate) fn output(&self) -> &Path {
        self.output.as_deref().unwrap_or(Path::new("residuals.svg"))
    }
}

/// Options of `diagnose`.
#[derive(Debug, Args)]
pub(crate) struct DiagnoseArguments {
    #[command(flatten)]
    pub(crate) pair: PairArguments,
}

/// Options of `add`.
#[derive(Debug, Args)]
pub(crate) struct AddArguments {
    #[command(flatten)]
    pub(crate) change: ChangeArguments,
    /// Add it without asking, whatever the lab thinks of it. Otherwise the lab judges one effect first, and asks where it would not name it; without a terminal
    /// it is not added then.
    #[arg(long)]
    pub(crate) yes: bool,
}

/// Options of `remove`, and of `add` besides its own.
#[derive(Debug, Args)]
pub(crate) struct ChangeArguments {
    #[command(flatten)]
    pub(crate) pair: PairArguments,
    /// The effect: `joint_compliance(shoulder)`, a wildcard `joint_zero(*)`, or the group `geometry(*)`.
    #[arg(add = ArgValueCandidates::new(completion::effects))]
    pub(crate) effect: String,
}

/// Options of `accept`.
#[derive(Debug, Args)]
pub(crate) struct AcceptArguments {
    #[command(flatten)]
    pub(crate) pair: PairArguments,
}

/// Options of `grow`.
#[derive(Debug, Args)]
pub(crate) struct GrowArguments {
    #[command(flatten)]
    pub(crate) pair: PairArguments,
    /// Stop where nothing more can be named: add no corrections.
    #[arg(long)]
    pub(crate) mechanisms_only: bool,
    /// Stop before the residual map: add effects only.
    #[arg(long)]
    pub(crate) no_map: bool,
    /// Show what would be added, but write no revisions.
    #[arg(long)]
    pub(crate) dry: bool,
}

/// Options of `next`.
#[derive(Debug, Args)]
pub(crate) struct NextArguments {
    #[command(flatten)]
    pub(crate) pair: PairArguments,
    /// How many new poses; two returns come on top.
    #[arg(short = 'n', long, default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=50))]
    pub(crate) number: u16,
    /// A plane nothing of the arm may cross, base frame: its normal and how far along it the allowed side begins, in mm,
    /// such as 0,0,1,20 for twenty millimetres above the base's foot. May be given several times.
    #[arg(long, value_name = "NX,NY,NZ,OFFSET_MM", value_parser = keep_out, allow_hyphen_values = true)]
    pub(crate) keep_out: Vec<HalfSpace>,
    /// Loads the hand can carry, kg; those of the table when not given.
    #[arg(long, value_name = "KG", value_delimiter = ',')]
    pub(crate) payload: Vec<f64>,
    /// Print the poses as a table (CSV) that a procedure goes through with `repeat: {over: FILE}`.
    #[arg(long, conflicts_with = "json")]
    pub(crate) csv: bool,
}

fn keep_out(text: &str) -> Result<HalfSpace, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    let wrong = || format!("`{text}` is no plane; write its normal and offset in mm, such as 0,0,1,20");
    let numbers: Result<[f64; 4], _> = numbers.map_err(|_| wrong())?.try_into();
    let Ok([x, y, z, offset]) = numbers else { return Err(wrong()) };
    let length = f64::hypot(f64::hypot(x, y), z);
    if !(length > 0.0 && length.is_finite() && offset.is_finite()) {
        return Err(wrong());
    }
    Ok(HalfSpace { normal: [x / length, y / length, z / length], offset })
}

/// Options of `effects`.
#[derive(Debug, Args)]
pub(crate) struct EffectsArguments {
    /// One effect: `joint_backlash`.
    #[arg(add = ArgValueCandidates::new(completion::effects))]
    pub(crate) name: Option<String>,
}

/// Options of `export`.
#[derive(Debug, Args)]
pub(crate) struct ExportArguments {
    /// The model file. model.yaml means its newest revision (model.rev2.yaml for a given one).
    pub(crate) model: PathBuf,
    /// What to write; it goes to standard output.
    #[arg(long = "as", value_enum, value_name = "FORM")]
    pub(crate) form: ExportForm,
    /// Leave out effects that the form cannot hold, and say how much that makes. Otherwise they are refused.
    #[arg(long)]
    pub(crate) leave_out: bool,
    /// For `targets`: the joint targets of a program, worked out by the drawing; a table with columns q1_deg, q2_deg and so on.
    #[arg(long, value_name = "CSV", required_if_eq("form", "targets"))]
    pub(crate) poses: Option<PathBuf>,
    /// The joint of a compensation table (linuxcnc) or a scale (fluidnc), where the model has several.
    #[arg(long, value_name = "JOINT")]
    pub(crate) joint: Option<String>,
    /// Lines of a compensation table.
    #[arg(long, default_value_t = 101, value_name = "N", value_parser = clap::value_parser!(u16).range(2..=256))]
    pub(crate) lines: u16,
    /// For `fluidnc`: the axis's `steps_per_mm` as the controller has it now.
    #[arg(long, value_name = "NUMBER", required_if_eq("form", "fluidnc"), value_parser = steps, allow_negative_numbers = true)]
    pub(crate) steps_per_mm: Option<f64>,
    /// For `fluidnc`: which axis the joint is, where it is not called so.
    #[arg(long, value_parser = FLUIDNC_AXES)]
    pub(crate) axis: Option<String>,
}

/// As FluidNC calls axes.
pub(crate) const FLUIDNC_AXES: [&str; 6] = ["x", "y", "z", "a", "b", "c"];

/// Reads a number of steps.
fn steps(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite() && *number > 0.0);
    number.ok_or_else(|| "give a number above 0".to_owned())
}

/// What other programs read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExportForm {
    /// Links and joints for ROS, simulators and planners; no shapes. Lengths in metres.
    Urdf,
    /// The `kinematics_params_file` of the ROS driver of Universal Robots.
    RosCalibration,
    /// The rows of Denavit and Hartenberg as a table, with Hayati's fifth number.
    Dh,
    /// Joint targets in place of those of `--poses`: with them the tip and the hand come where the drawing (the first revision) would have had them.
    Targets,
    /// A compensation file of LinuxCNC for one joint (COMP_FILE, type 0): its zero, gain, waves, map and play. mm or degrees.
    Linuxcnc,
    /// The `steps_per_mm` of an axis for FluidNC, which holds a scale for each axis and nothing else: what play, waves and maps leave is said.
    Fluidnc,
}

/// Options of `template`.
#[derive(Debug, Args)]
pub(crate) struct TemplateArguments {
    /// The robot: one of those known, a number of joints, or a URDF file.
    pub(crate) robot: String,
    /// The link at which the arm of a URDF file ends; the end of its longest branch when not given.
    #[arg(long, value_name = "LINK")]
    pub(crate) tip: Option<String>,
    /// Folder to write to.
    #[arg(short, long, default_value = ".", value_name = "FOLDER")]
    pub(crate) output: PathBuf,
}

/// Options of `report`.
#[derive(Debug, Args)]
pub(crate) struct ReportArguments {
    #[command(flatten)]
    pub(crate) pair: PairArguments,
    /// The page to write.
    #[arg(short, long, default_value = "report.html", value_name = "FILE")]
    pub(crate) output: PathBuf,
}

/// Options of `screen`.
#[derive(Debug, Args)]
pub(crate) struct ScreenArguments {
    #[command(flatten)]
    pub(crate) pair: PairArguments,
}

/// A model file and its revisions.
#[derive(Debug, Args)]
pub(crate) struct FamilyArguments {
    /// The model file.
    pub(crate) model: PathBuf,
    /// Take a table that says it was measured with another model.
    #[arg(long)]
    any_model: bool,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[cfg(test)]
mod tests {
    use super::free_list;

    #[test]
    fn lists_are_split_outside_brackets_only() {
        assert_eq!(
            free_list("joint_zero(*), joint_harmonic(lift, 20)"),
            ["joint_zero(*)", "joint_harmonic(lift, 20)"]
        );
        assert!(free_list("none").is_empty());
    }
}
