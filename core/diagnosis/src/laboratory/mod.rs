//! The laboratory: one model, one table, and everything that can be asked of the pair.

mod addition;
mod comparison;
mod effect_plot;
mod found_surfaces;
mod known;
mod map_note;
mod mapping;
mod orientations;
mod placements;
mod plausible;
mod point_errors;
mod preview;
mod profile_units;
mod regressor;
mod rows;
mod standard_errors;

pub(crate) use addition::moved;
pub use addition::{Addition, without};
pub use comparison::{Comparison, EffectValue, JointAxis, JointError, OrientationErrors, Rms, WhyHeld};
pub use effect_plot::EffectPlot;
pub use found_surfaces::{FoundAngle, FoundNumber, FoundSurface};
pub use map_note::MapNote;
pub use mapping::MapStep;
pub(crate) use mapping::{Mapped, drop_map};
pub use placements::Placement;
pub use plausible::ImplausibleError;
pub use point_errors::{ErrorSummary, Errors};
pub(crate) use point_errors::{point_squares, points_in};
pub use preview::Preview;
pub use regressor::PlotAxis;
pub use rows::{Points, RowResidual, Series};
pub(crate) use standard_errors::StandardErrors;

use std::path::Path;
use std::sync::OnceLock;

use known::Known;
use thiserror::Error;

use crate::jump::Jump;
use crate::split::{Holdout, HoldoutError, Split};
use plumb_calibration::arm_model::{AddedEffect, Epochs, Model};
use plumb_calibration::effect::{
    self, CandidateContext, DatasetSummary, DefinitionError, EffectId, EffectNameError, POSE_ERROR, Site,
};
use plumb_calibration::file::ModelFileError;
use plumb_calibration::fit::{Fit, FitError, FitOptions, ResidualModel, estimate_noise};
use plumb_calibration::measurement::{Observations, ObservationsError, ReadingNoise, unused_distances};
use plumb_calibration::table::{Body, Table, TableError};
use plumb_estimation::{Cancelled, Progress};

/// How a laboratory works.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// Overrides the model file's `free:` where given; an empty list frees nothing but base and targets.
    pub free: Option<Vec<String>>,
    /// How the held-out set is chosen.
    pub holdout: Holdout,
    /// How to fit.
    pub fit: FitOptions,
}

/// Why a question cannot be answered.
#[derive(Debug, Error)]
pub enum LaboratoryError {
    /// The model file.
    #[error(transparent)]
    Model(#[from] ModelFileError),
    /// The table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// They do not go together.
    #[error(transparent)]
    Observations(#[from] ObservationsError),
    /// Numbers that cannot be meant.
    #[error(transparent)]
    Implausible(#[from] ImplausibleError),
    /// An effect's name or place.
    #[error(transparent)]
    Effect(#[from] EffectNameError),
    /// A formula of the user's own.
    #[error(transparent)]
    Formula(#[from] Box<DefinitionError>),
    /// The held-out set.
    #[error(transparent)]
    Holdout(#[from] HoldoutError),
    /// The fit.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// It was asked to end.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A file cannot be written.
    #[error("{path}: {source}")]
    Write {
        /// The file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// A request that makes no sense for this model.
    #[error("{0}")]
    Refused(String),
}

impl LaboratoryError {
    /// Whether it is only that the work was asked to end, wherever it was at that moment.
    pub fn is_cancelled(&self) -> bool {
        matches!(self, Self::Cancelled(_) | Self::Fit(FitError::Cancelled(_)))
    }
}

/// The sessions of a table, those that a model knows already first.
fn sessions(model: &Model, table: &Table, holdout: Holdout) -> Result<Epochs, LaboratoryError> {
    let refused = |reason: &str| Err(LaboratoryError::Refused(format!("{}: {reason}", table.source)));
    if table.session.names.is_empty() {
        return refused(
            "`base: {per: session}` needs the column `session`, which names the session of each row",
        );
    }
    if holdout == Holdout::Session {
        return refused(
            "with `base: {per: session}` the base of a session that is held out cannot be fitted; choose another `--holdout`",
        );
    }
    // The order of sessions is that of their bases in the model file: those that are known keep their place.
    let mut names = match &model.epochs {
        Some(Epochs::Sessions(names)) => names.clone(),
        _ => Vec::new(),
    };
    for name in &table.session.names {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    Ok(Epochs::Sessions(names))
}

/// Where a camera on the hand sees a board and nothing else is measured, the base has no place but that of the model file: the board is found beside it.
fn hold_unseen_base(model: &mut Model, table: &Table) {
    // What nothing but the board, or the profiles, sees moves with them: base and board would slide together.
    let reads_else = !table.positions.is_empty()
        || !table.orientations.iter().all(|columns| columns.body == Body::Board)
        || !table.scalars.is_empty()
        || table.tilt.is_some()
        || table.is_of_stripes()
        || !table.touch.names.is_empty()
        || (!table.on.names.is_empty() && table.profiles.is_empty());
    // Surfaces that may all move say no more of the base than the board does.
    let mut named = table.on.names.iter().filter_map(|name| model.surface_position(name));
    let are_free = named.all(|index| model.surfaces.get(index).is_some_and(|surface| surface.free));
    if !table.profiles.is_empty() && !reads_else && !table.sees_a_board() && are_free {
        model.base.free = false;
    }
    if table.sees_a_board()
        && !reads_else
        && !model.boards.is_empty()
        && model.boards.iter().all(|board| board.free)
    {
        model.base.free = false;
    }
}

/// A model and a table.
#[derive(Debug, Clone)]
pub struct Laboratory {
    model: Model,
    table: Table,
    observations: Observations,
    summary: DatasetSummary,
    split: Split,
    options: Options,
    known: Known<Dated>,
}

/// A laboratory with the epochs that its rows show.
#[derive(Debug)]
pub(crate) struct Dated {
    pub(crate) laboratory: Laboratory,
    pub(crate) jumps: Vec<Jump>,
}

impl Laboratory {
    /// Reads both files.
    ///
    /// # Errors
    /// A file that cannot be read or understood, or two that do not go together.
    pub fn open(model: &Path, data: &Path, options: Options) -> Result<Self, LaboratoryError> {
        Self::new(Model::read(model)?, Table::read(data)?, options)
    }

    /// Brings a model and a table together.
    ///
    /// # Errors
    /// They do not go together, or the held-out set cannot be chosen.
    pub fn new(mut model: Model, mut table: Table, options: Options) -> Result<Self, LaboratoryError> {
        if let Some(free) = &options.free {
            for pattern in free {
                effect::expand(pattern, &model)?;
            }
            model.free.clone_from(free);
        }
        model.noise.estimated.clear();
        if model.base.per_session {
            model.epochs = Some(sessions(&model, &table, options.holdout)?);
        }
        hold_unseen_base(&mut model, &table);
        let observations = Observations::new(&model, &table)?;
        profile_units::check(&model, &table)?;
        let unused = unused_distances(&model, &table);
        for odd in plausible::check(&model, &table)?.into_iter().chain(unused) {
            if !table.warnings.contains(&odd) {
                table.warnings.push(odd);
            }
        }
        let problem = ResidualModel::new(&model, &table, &observations, &[])?;
        problem.check_formulas()?;
        for odd in orientations::check(&problem)? {
            if !table.warnings.contains(&odd) {
                table.warnings.push(odd);
            }
        }
        let split = Split::new(&table, options.holdout)?;
        let summary = DatasetSummary::of(&model, &table);
        let known = Known::default();
        let mut laboratory = Self { model, table, observations, summary, split, options, known };
        laboratory.estimate_noise()?;
        Ok(laboratory)
    }

    /// Gives readings whose noise nobody declared, beside others, the one that the fit shows. Where nothing can be fitted they
    /// keep what they have: the first fit that is asked for says why.
    fn estimate_noise(&mut self) -> Result<(), LaboratoryError> {
        let effects = self.fitted_effects()?;
        let (model, table, observations) = (&self.model, &self.table, &self.observations);
        let progress = Progress::unwatched();
        let found = estimate_noise(model, table, observations, &effects, &self.split.fit, &progress);
        if let Some(estimated) = found.ok().filter(|estimated| !estimated.is_empty()) {
            self.model.noise.estimated = estimated;
            self.observations = Observations::new(&self.model, &self.table)?;
        }
        Ok(())
    }

    /// The noise of every kind of reading, and who says so.
    pub fn noise(&self) -> Vec<ReadingNoise> {
        self.observations.noise(&self.model)
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The same table under another model of the same joints, targets and surfaces.
    pub(crate) fn with_model(&self, model: Model) -> Self {
        Self { model, ..self.clone() }
    }

    /// What the table's readings are.
    pub(crate) fn observations(&self) -> &Observations {
        &self.observations
    }

    /// The table.
    pub fn table(&self) -> &Table {
        &self.table
    }

    /// What the table logs.
    pub fn summary(&self) -> &DatasetSummary {
        &self.summary
    }

    /// Which rows are fitted and which are held out.
    pub fn split(&self) -> &Split {
        &self.split
    }

    /// How the laboratory works.
    pub fn options(&self) -> &Options {
        &self.options
    }

    pub(crate) fn context(&self) -> CandidateContext<'_> {
        CandidateContext { model: &self.model, summary: &self.summary }
    }

    /// The effects that are always fitted, at their last values; those the user has added are not among them.
    pub(crate) fn free_effects(&self) -> Result<Vec<AddedEffect>, EffectNameError> {
        let mut effects: Vec<AddedEffect> = Vec::new();
        for pattern in &self.model.free {
            for id in effect::expand(pattern, &self.model)? {
                // `joint_zero(*)` beside an added `joint_zero(pan)` frees the others.
                if effects.iter().chain(&self.model.effects).any(|other| other.id.same_as(&id)) {
                    continue;
                }
                let known = self.model.fitted.iter().find(|other| other.id.same_as(&id));
                let parameters = effect::build(&id, &self.model)?.parameters().len();
                let values = known.map_or_else(|| vec![0.0; parameters], |known| known.values.clone());
                effects.push(AddedEffect { id, values });
            }
        }
        if !self.model.pose_errors.is_empty() {
            effects.push(AddedEffect { id: EffectId::at(POSE_ERROR, Site::Base), values: Vec::new() });
        }
        let reset = EffectId::at("base_reset", Site::Base);
        let taken = effects.iter().chain(&self.model.effects).any(|other| other.id.same_as(&reset));
        if self.model.base.per_session && self.model.epoch_count() > 1 && !taken {
            let known = self.model.fitted.iter().find(|other| other.id.same_as(&reset));
            let values = known.map_or_else(Vec::new, |known| known.values.clone());
            effects.push(AddedEffect { id: reset, values });
        }
        Ok(effects)
    }

    /// Everything the model says is to be fitted: the free effects, then the added ones.
    pub(crate) fn fitted_effects(&self) -> Result<Vec<AddedEffect>, EffectNameError> {
        let mut effects = self.free_effects()?;
        effects.extend(self.model.effects.iter().cloned());
        Ok(effects)
    }

    /// The least-squares problem with all fitted effects and `more` of them.
    pub(crate) fn problem(&self, more: &[AddedEffect]) -> Result<ResidualModel<'_>, EffectNameError> {
        let mut effects = self.fitted_effects()?;
        effects.extend(more.iter().cloned());
        ResidualModel::new(&self.model, &self.table, &self.observations, &effects)
    }

    /// Rows that are not held out and in which anything was measured.
    pub(crate) fn measured_rows(&self) -> Vec<usize> {
        let mut rows = self.split.fit_rows();
        rows.retain(|row| !self.observations.range(*row).is_empty());
        rows
    }

    /// Fits a problem to the rows that are not held out. That of the model as it is is fitted once.
    pub(crate) fn fit(
        &self,
        problem: &ResidualModel<'_>,
        progress: &Progress,
    ) -> Result<Fit, LaboratoryError> {
        progress.check()?;
        let plain = self.fitted_effects()?;
        let is_plain = problem.effects().eq(plain.iter().map(|added| &added.id));
        if let Some(fit) = self.known.fit.get().filter(|_| is_plain) {
            return Ok(fit.clone());
        }
        let fit = problem.fit(&problem.start(), &self.split.fit, self.options.fit, progress)?;
        if is_plain {
            // Another thread may have been first: its fit is the same.
            let _ = self.known.fit.set(fit.clone());
        }
        Ok(fit)
    }

    /// What was found of epochs, once it was asked for.
    pub(crate) fn known_epochs(&self) -> &OnceLock<Option<Box<Dated>>> {
        &self.known.dated
    }

    /// The same with the epoch of an event, once one was found.
    pub(crate) fn known_epochs_at_event(&self) -> &OnceLock<Option<Box<Dated>>> {
        &self.known.dated_at_event
    }

    /// Keeps about `most` of the fitted rows, chosen at random; returns to one pose stay together. The locked ones stay.
    pub(crate) fn keep_rows(&mut self, most: usize) {
        self.known = Known::default();
        self.split.keep(&self.table, most);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TWO_LINKS;

    /// Whether the base is still free, of a model with these lines and a table of these columns.
    fn base_is_free(lines: &str, columns: &str, cells: &str) -> bool {
        let text = TWO_LINKS.replace("base: {xyz_mm: [0, 0, 0], free: false}", "base: {free: true}");
        let mut model = Model::parse("m.yaml", &format!("{text}{lines}")).unwrap();
        let rows: String = (0..3).map(|row| format!("{},{},{cells}\n", 10 * row, 20 - row)).collect();
        let table = Table::parse("t.csv", &format!("q1_deg,q2_deg,{columns}\n{rows}")).unwrap();
        hold_unseen_base(&mut model, &table);
        model.base.free
    }

    #[test]
    fn a_base_that_slides_with_what_is_seen_is_held_and_one_that_anything_else_sees_is_not() {
        let board = "board: {seen_by: p1}\n";
        let seen = "board_x_mm,board_y_mm,board_z_mm";
        assert!(!base_is_free(board, seen, "1,2,3"));
        assert!(
            base_is_free("board: {seen_by: p1, free: false}\n", seen, "1,2,3"),
            "a board whose place is known"
        );
        assert!(base_is_free(board, &format!("{seen},p1_x_mm"), "1,2,3,4"));
        assert!(base_is_free(board, &format!("{seen},height_mm"), "1,2,3,4"));
        assert!(base_is_free(board, &format!("{seen},tilt_x_deg"), "1,2,3,4"));
        assert!(base_is_free(board, &format!("{seen},touch"), "1,2,3,a"));
        assert!(base_is_free(board, &format!("{seen},on"), "1,2,3,plate"));
        assert!(base_is_free(board, &format!("{seen},p1_qw,p1_qx,p1_qy,p1_qz"), "1,2,3,1,0,0,0"));
        assert!(base_is_free("", "p1_x_mm", "1"));
        // The same of a laser line and the surfaces it sees.
        let profile = |free: bool| {
            format!(
                "profile: {{seen_by: p1}}\nsurfaces: {{plate: {{plane: {{normal: [0, 0, 1], offset_mm: 0}}, free: {free}}}}}\n"
            )
        };
        let points = "profile_x_mm,profile_z_mm,on";
        assert!(!base_is_free(&profile(true), points, "1,100,plate"));
        assert!(base_is_free(&profile(false), points, "1,100,plate"), "a surface whose place is known");
        assert!(base_is_free(&profile(true), &format!("{points},p1_x_mm"), "1,100,plate,4"));
    }

    #[test]
    fn being_asked_to_end_is_no_error_of_the_files_wherever_it_was() {
        let ended = plumb_estimation::Cancelled;
        assert!(LaboratoryError::from(ended).is_cancelled());
        assert!(LaboratoryError::Fit(FitError::Cancelled(ended)).is_cancelled());
        assert!(!LaboratoryError::Refused("no".to_owned()).is_cancelled());
        assert!(!LaboratoryError::Fit(FitError::NoRows { table: "t".to_owned() }).is_cancelled());
    }

    #[test]
    fn sessions_that_the_model_knows_keep_their_place_and_others_follow() {
        let lab = crate::testing::two_links(4, "", 0.05, 3, |_| [0.0; 2]);
        let named = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<String>>();
        let mut table = lab.table().clone();
        let none = sessions(lab.model(), &table, Holdout::None);
        assert!(none.unwrap_err().to_string().contains("`session`"));
        table.session.names = named(&["monday", "tuesday"]);
        assert_eq!(
            sessions(lab.model(), &table, Holdout::None).unwrap(),
            Epochs::Sessions(named(&["monday", "tuesday"]))
        );
        let epochs = Some(Epochs::Sessions(named(&["sunday", "tuesday"])));
        let model = Model { epochs, ..lab.model().clone() };
        let all = Epochs::Sessions(named(&["sunday", "tuesday", "monday"]));
        assert_eq!(sessions(&model, &table, Holdout::Regions).unwrap(), all);
        assert!(sessions(&model, &table, Holdout::Session).is_err(), "its base could not be fitted");
    }

    #[test]
    fn a_base_per_session_is_free_between_sessions_where_there_are_several() {
        let lab = crate::testing::two_links(4, "joint_zero(*)", 0.05, 3, |_| [0.0; 2]);
        let free = |per_session: bool, epochs: &[&str], added: &[&str]| {
            let mut model = lab.model().clone();
            model.base.per_session = per_session;
            model.epochs = Some(Epochs::Sessions(epochs.iter().map(|name| (*name).to_owned()).collect()));
            model.effects = added
                .iter()
                .map(|text| {
                    let id = effect::parse(text, &model).unwrap();
                    let parameters = effect::build(&id, &model).unwrap().parameters().len();
                    AddedEffect { id, values: vec![0.0; parameters] }
                })
                .collect();
            let free = lab.with_model(model).free_effects().unwrap();
            free.iter().map(|one| one.id.name.clone()).collect::<Vec<String>>()
        };
        let zeros = ["joint_zero", "joint_zero"];
        assert_eq!(free(true, &["a", "b"], &[]), [zeros[0], zeros[1], "base_reset"]);
        assert_eq!(free(true, &["a"], &[]), zeros, "one session has one base");
        assert_eq!(free(false, &["a", "b"], &[]), zeros);
        assert_eq!(free(true, &["a", "b"], &["base_reset"]), zeros, "it was added already");
        assert_eq!(free(false, &["a"], &["joint_zero(elbow)"]), zeros[..1], "the others alone");
    }
}
