//! Everything the screens show, in one value. [`super::update`] changes it, [`super::view`] draws it.

use std::time::Duration;

use super::cell::{ArmShape, CellState};
use super::history::HistoryState;
use super::hits::Hits;
use super::keys::Context;
use super::log::LogState;
use super::model::ModelState;
use super::run::{OpenPrompt, RunState};
use super::scan::ScanState;
use super::screen::Screen;
use super::theme::Theme;

/// What is open over the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Overlay {
    /// The keys that hold here.
    Help {
        /// Lines scrolled away at the top.
        scrolled: u16,
    },
    /// "A run is open: leave?"
    Leave,
    /// "Abort the run?"
    Abort,
    /// "Bring back what a run put in force?"
    BringBack,
    /// The chosen candidate of the model in full.
    Candidate,
    /// "Add a candidate that the lab rejects?"
    AddRejected,
}

/// One line above the footer: the last thing worth saying.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Notice {
    /// How severe.
    pub severity: Severity,
    /// One plain sentence.
    pub text: String,
}

/// How the program is being left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leaving {
    /// Since when, by the screens' clock.
    pub since: Duration,
    /// The run is to be aborted, not kept.
    pub aborts: bool,
}

/// How severe a notice is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Severity {
    /// For information.
    Info,
    /// Wants attention.
    Warning,
    /// A fault.
    Error,
}

/// All state of the screens.
#[derive(Clone, Debug)]
pub(crate) struct State {
    /// The page shown.
    pub screen: Screen,
    /// What lies over it.
    pub overlay: Option<Overlay>,
    /// The looks.
    pub theme: Theme,
    /// Who answers prompts; goes into the record. Empty for who only watches.
    pub operator: String,
    /// The last thing worth saying.
    pub notice: Option<Notice>,
    /// The program waits for the run to come to rest before it closes.
    pub leaving: Option<Leaving>,
    /// Time since the screens opened.
    pub now: Duration,
    /// Size of the terminal, columns and rows.
    pub size: (u16, u16),
    /// Devices and streams.
    pub cell: CellState,
    /// The run; none when only a model is looked at.
    pub run: Option<RunState>,
    /// The model lab; none when no model and table were given.
    pub model: Option<ModelState>,
    /// The record; none where nothing is recorded.
    pub history: Option<HistoryState>,
    /// The cloud; none where nothing was scanned.
    pub scan: Option<ScanState>,
    /// What happened.
    pub log: LogState,
    /// What a command needs besides to find this record, with a blank before it: ` --record DIR`, or nothing.
    pub record_option: String,
    /// What can be clicked in the frame drawn last.
    pub hits: Hits,
}

impl State {
    /// The screens of a cell whose run is about to start.
    pub(crate) fn of_cell(operator: &str, shape: Option<ArmShape>, theme: Theme) -> Self {
        let cell = CellState { shape, ..CellState::default() };
        Self {
            cell,
            run: Some(RunState::default()),
            history: Some(HistoryState::default()),
            screen: Screen::Run,
            ..Self::empty(operator, theme)
        }
    }

    /// The screens of a run that somebody else controls.
    pub(crate) fn of_watcher(theme: Theme) -> Self {
        Self { history: None, ..Self::of_cell("", None, theme) }
    }

    /// The screen of the record alone.
    pub(crate) fn of_record(theme: Theme) -> Self {
        Self { history: Some(HistoryState::default()), screen: Screen::History, ..Self::empty("", theme) }
    }

    /// The screens of a model and a table of measurements.
    pub(crate) fn of_model(model: ModelState, theme: Theme) -> Self {
        Self { model: Some(model), screen: Screen::Model, ..Self::empty("", theme) }
    }

    /// The screen of a cloud alone.
    pub(crate) fn of_cloud(scan: ScanState, theme: Theme) -> Self {
        Self { scan: Some(scan), screen: Screen::Scan, ..Self::empty("", theme) }
    }

    fn empty(operator: &str, theme: Theme) -> Self {
        Self {
            screen: Screen::Log,
            overlay: None,
            theme,
            operator: operator.to_owned(),
            notice: None,
            leaving: None,
            now: Duration::ZERO,
            size: (80, 24),
            cell: CellState::default(),
            run: None,
            model: None,
            history: None,
            scan: None,
            log: LogState::default(),
            record_option: String::new(),
            hits: Hits::default(),
        }
    }

    /// The pages that have something to show, in the order of their tabs.
    pub(crate) fn screens(&self) -> Vec<Screen> {
        let shown = |screen: &Screen| match screen {
            Screen::Cell | Screen::Run => self.run.is_some(),
            Screen::Model => self.model.is_some(),
            Screen::History => self.history.is_some(),
            Screen::Log => self.run.is_some() || self.model.is_some(),
            Screen::Scan => self.scan.is_some(),
        };
        Screen::ALL.into_iter().filter(shown).collect()
    }

    /// Where the keys of this moment are looked up, the narrowest context first.
    pub(crate) fn contexts(&self) -> Vec<Context> {
        match self.overlay {
            Some(Overlay::Help { .. } | Overlay::Candidate) => {
                vec![Context::Overlay, Context::NotWriting, Context::Everywhere]
            }
            Some(Overlay::Leave) => vec![Context::Leaving, Context::NotWriting, Context::Everywhere],
            Some(Overlay::Abort) => vec![Context::Aborting, Context::NotWriting, Context::Everywhere],
            Some(Overlay::AddRejected) => {
                vec![Context::AddingRejected, Context::NotWriting, Context::Everywhere]
            }
            Some(Overlay::BringBack) => vec![Context::BringingBack, Context::NotWriting, Context::Everywhere],
            None => self.contexts_of_page(),
        }
    }

    /// Where keys are looked up on the page itself, whatever lies over it.
    pub(crate) fn contexts_of_page(&self) -> Vec<Context> {
        if self.is_naming() {
            return vec![Context::Naming, Context::Everywhere];
        }
        if self.is_filtering() {
            return vec![Context::Filtering, Context::Everywhere];
        }
        if self.is_writing_an_answer() {
            return vec![Context::Prompt, Context::Everywhere];
        }
        let mut contexts = match (self.screen, &self.run) {
            (Screen::Cell, _) => vec![Context::Cell],
            (Screen::Run, Some(run)) => run.contexts(),
            (Screen::Run, None) => Vec::new(),
            (Screen::Model, _) => vec![Context::Model],
            (Screen::History, _) if self.has_opened_run() => vec![Context::OpenedRun],
            (Screen::History, _) => vec![Context::History],
            (Screen::Log, _) => vec![Context::Log],
            (Screen::Scan, _) => vec![Context::Scan],
        };
        contexts.extend(self.has_run_keys().then_some(Context::Run));
        if !self.is_typing() {
            contexts.push(Context::NotTyping);
        }
        contexts.extend([Context::NotWriting, Context::Everywhere]);
        contexts
    }

    /// Whether the keys that steer a run hold. They do on every page, so that none of them means something else while an arm may move.
    fn has_run_keys(&self) -> bool {
        self.run.as_ref().is_some_and(RunState::is_open)
    }

    /// Whether letters go into the name of an effect.
    pub(crate) fn is_naming(&self) -> bool {
        self.screen == Screen::Model && self.model.as_ref().is_some_and(|model| model.naming.is_some())
    }

    /// Whether letters go into the filter of the runs.
    pub(crate) fn is_filtering(&self) -> bool {
        self.screen == Screen::History && self.history.as_ref().is_some_and(|history| history.filtering)
    }

    /// Whether a run of the record is open over the list.
    fn has_opened_run(&self) -> bool {
        self.history.as_ref().is_some_and(|history| history.opened.is_some())
    }

    /// Whether letters go into an answer.
    pub(crate) fn is_writing_an_answer(&self) -> bool {
        let prompt = self.run.as_ref().and_then(|run| run.prompt.as_ref());
        self.is_typing() && prompt.is_some_and(OpenPrompt::is_written)
    }

    /// Whether digits go into an answer.
    pub(crate) fn is_typing(&self) -> bool {
        let prompt = self.run.as_ref().and_then(|run| run.prompt.as_ref());
        self.screen == Screen::Run && self.overlay.is_none() && prompt.is_some_and(|prompt| prompt.is_typed())
    }

    /// Whether a run is under way that leaving would interrupt.
    pub(crate) fn has_open_run(&self) -> bool {
        !self.only_watches() && self.run.as_ref().is_some_and(|run| run.is_open())
    }

    /// Whether nothing can be sent to the engine from here.
    pub(crate) fn only_watches(&self) -> bool {
        self.operator.is_empty()
    }

    /// Says something on the line above the footer.
    pub(crate) fn notify(&mut self, severity: Severity, text: impl Into<String>) {
        self.notice = Some(Notice { severity, text: text.into() });
    }
}
