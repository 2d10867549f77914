//! The pages of the program.

/// The pages of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Screen {
    /// Devices, joints, streams, the arm over the table.
    Cell,
    /// The procedure: steps, prompt, what was found.
    Run,
    /// The model lab: candidates, residuals, the fall of the error.
    Model,
    /// The runs in the record, and how corrections moved over time.
    History,
    /// What happened, line by line.
    Log,
    /// A cloud of points that turns.
    Scan,
}

impl Screen {
    /// All pages in the order of their tabs.
    pub(crate) const ALL: [Self; 6] =
        [Self::Cell, Self::Run, Self::Model, Self::History, Self::Log, Self::Scan];

    /// The name on the tab.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Cell => "Cell",
            Self::Run => "Run",
            Self::Model => "Model",
            Self::History => "History",
            Self::Log => "Log",
            Self::Scan => "Scan",
        }
    }
}
