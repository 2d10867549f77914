//! Words and spaces that the parts of the Run screen share.

use plumb_cell::event::StepOutcome;
use ratatui::layout::Rect;

/// Seconds as people say them.
pub(crate) fn spoken(seconds: f64) -> String {
    if seconds < 90.0 { format!("{seconds:.0} s") } else { format!("{:.0} min", seconds / 60.0) }
}

/// How a step ended, in a word.
pub(crate) fn outcome_word(outcome: StepOutcome) -> &'static str {
    match outcome {
        StepOutcome::Passed => "passed",
        StepOutcome::Failed => "failed",
        StepOutcome::Error => "ended with an error",
        StepOutcome::Skipped => "skipped",
        StepOutcome::NotNeeded => "not needed",
        StepOutcome::Interrupted => "interrupted",
    }
}

/// One column of air at the sides.
pub(crate) fn padded(area: Rect) -> Rect {
    let pad = u16::from(area.width > 20);
    Rect { x: area.x.saturating_add(pad), width: area.width.saturating_sub(2 * pad), ..area }
}
