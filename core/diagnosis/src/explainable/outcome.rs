//! How much of what a model leaves could be explained.

use plumb_calibration::measurement::ReadingUnit;
use serde::Serialize;

/// One group of what is known of a row.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExplainableGroup {
    /// `pose`, `last move`, `order` or `time`, `temperature`, `load`, `session`, or a column of the table.
    pub group: String,
    /// Whether unseen rows are predicted better with it, beyond chance; only then is it used.
    pub explains: bool,
    /// Root mean square error of a point of unseen rows with this group and those before it that explain.
    pub left_mm: f64,
    /// How much that error rises when the regression has all groups that explain but this one.
    pub beyond_others_mm: f64,
    /// One standard error of the fall of the error with this group.
    pub scatter_mm: f64,
}

/// The same where whole regions of pose space are left out, not single poses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BlockedExplainable {
    /// Error of a point by what is fitted.
    pub left_mm: f64,
    /// What no function of the groups predicts there.
    pub not_predictable_mm: f64,
}

/// How much of what a model leaves could be explained at all: root mean square errors of a point of rows that were left out at random, whole poses together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explainable {
    /// The unit of the table's readings, and so of every error here and in its groups whose name ends in `_mm`: mm, or degrees of angles alone.
    pub unit: ReadingUnit,
    /// Left by what is fitted.
    pub left_mm: f64,
    /// Left by the flexible regression besides.
    pub not_predictable_mm: f64,
    /// The difference of the two: structure to which no effect of the model answers.
    pub to_name_mm: f64,
    /// One standard error of the difference.
    pub scatter_mm: f64,
    /// What is known of a row, in the order in which it was asked.
    pub groups: Vec<ExplainableGroup>,
    /// With whole regions left out; nothing where too little would be left to fit.
    pub blocked: Option<BlockedExplainable>,
    /// Rows looked at.
    pub rows: usize,
    /// Measured points in them.
    pub points: usize,
}

impl Explainable {
    /// Whether anything is predictable.
    pub fn is_structured(&self) -> bool {
        self.groups.iter().any(|group| group.explains)
    }

    /// The groups that explain something, as a person reads them.
    pub fn kinds(&self) -> Vec<String> {
        self.groups.iter().filter(|group| group.explains).map(|group| group.group.clone()).collect()
    }
}
