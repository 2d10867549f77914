//! What is said of how much could be explained.

use serde::Serialize;

use crate::phrase::listed;

/// One group of what is known of a row.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExplainableGroup {
    /// `pose`, `last move`, `order` or `time`, `temperature`, `load`, `session`, or a column of the table.
    pub group: String,
    /// Whether unseen rows are predicted better with it, beyond chance; only then is it used.
    pub explains: bool,
    /// Root mean square error of a point of unseen rows with this group and those before it that explain, mm.
    pub left_mm: f64,
    /// How much that error rises when the regression has all groups that explain but this one, mm.
    pub beyond_others_mm: f64,
    /// One standard error of the fall of the error with this group, mm.
    pub scatter_mm: f64,
}

/// The same where whole regions of pose space are left out, not single poses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BlockedExplainable {
    /// Error of a point by what is fitted, mm.
    pub left_mm: f64,
    /// What no function of the groups predicts there, mm.
    pub not_predictable_mm: f64,
}

/// How much of what a model leaves could be explained at all: root mean square errors of a point of rows that were left out at random, whole poses together, mm
/// (degrees in a table of tilts alone).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explainable {
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
    /// One plain sentence.
    pub sentence: String,
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

    /// With the sentence.
    pub(super) fn in_words(mut self) -> Self {
        self.sentence = self.words();
        self
    }

    fn words(&self) -> String {
        if !self.is_structured() {
            let asked: Vec<String> = self.groups.iter().map(|group| group.group.clone()).collect();
            return format!(
                "left after what is fitted {:.3} mm; nothing of it is predictable from {} (0.000 +- {:.3} mm)",
                self.left_mm,
                listed(&asked, "or"),
                self.scatter_mm
            );
        }
        let steps = self.groups.iter().filter(|group| group.explains).enumerate().map(|(index, group)| {
            let plus = if index > 0 { "+ " } else { "" };
            format!("{plus}{} {:.3}", group.group, group.left_mm)
        });
        let silent = self.groups.iter().filter(|group| !group.explains);
        let silent: Vec<String> = silent.map(|group| group.group.clone()).collect();
        let silent = match silent.is_empty() {
            true => String::new(),
            false => format!(" (nothing more from {})", listed(&silent, "or")),
        };
        format!(
            "left after what is fitted {:.3} mm; predictable from {}{silent} -> {:.3} +- {:.3} mm of structure is still to be named, {:.3} mm is not predictable",
            self.left_mm,
            steps.collect::<Vec<_>>().join(", "),
            self.to_name_mm,
            self.scatter_mm,
            self.not_predictable_mm
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(name: &str, explains: bool, left_mm: f64) -> ExplainableGroup {
        ExplainableGroup {
            group: name.to_owned(),
            explains,
            left_mm,
            beyond_others_mm: 0.0,
            scatter_mm: 0.01,
        }
    }

    fn explainable(groups: Vec<ExplainableGroup>) -> Explainable {
        let not_predictable_mm = groups.last().map_or(0.617, |group| group.left_mm);
        Explainable {
            left_mm: 0.617,
            not_predictable_mm,
            to_name_mm: 0.617 - not_predictable_mm,
            scatter_mm: 0.02,
            groups,
            blocked: None,
            rows: 100,
            points: 100,
            sentence: String::new(),
        }
    }

    #[test]
    fn the_sentence_tells_what_each_group_leaves_and_what_is_left_at_last() {
        let told = explainable(vec![
            group("pose", true, 0.40),
            group("last move", true, 0.35),
            group("time", false, 0.35),
        ]);
        assert_eq!(
            told.in_words().sentence,
            "left after what is fitted 0.617 mm; predictable from pose 0.400, + last move 0.350 (nothing more from time) -> 0.267 +- 0.020 mm of structure is \
             still to be named, 0.350 mm is not predictable"
        );
    }

    #[test]
    fn where_nothing_is_predictable_it_says_so_with_its_scatter() {
        let told = explainable(vec![group("pose", false, 0.617), group("order", false, 0.617)]);
        assert!(!told.is_structured());
        assert_eq!(
            told.in_words().sentence,
            "left after what is fitted 0.617 mm; nothing of it is predictable from pose or order (0.000 +- 0.020 mm)"
        );
    }
}
