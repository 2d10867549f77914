//! `plumb trial inject`: would the lab have seen it? Hides an effect in somebody's own measurements.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use plumb_calibration::arm_model::Model;
use plumb_calibration::table::{Rename, Table, table_text};
use plumb_diagnosis::Diagnosis;
use plumb_diagnosis::laboratory::{LaboratoryError, Options};
use plumb_estimation::Progress;
use plumb_report::diagnosis_sentence;
use plumb_simulated::physics::campaign::specification::{Requested, Size};
use plumb_simulated::physics::imperfection::Imperfection;

use super::effect_request::{EffectRequest, EffectRequestError};
use super::error::TrialError;
use super::files::{MODEL, TABLE, write};
use super::injection::{Found, InjectionError, Measurements};
use super::outcome::Outcome;
use super::shown::shown_size;
use crate::commands::model::arguments::naming;
use crate::progress::watched;

/// The truth in the open, beside the measurements it is hidden in.
const ANSWER: &str = "answer.json";

/// Sizes that are tried beside the one that was asked for, each twice or half the one before.
const FURTHER_SIZES: usize = 3;

/// Options of `plumb trial inject`.
#[derive(Debug, clap::Args)]
pub(crate) struct InjectArguments {
    /// The model file of your arm.
    model: PathBuf,
    /// Your measurements of it.
    #[arg(long, value_name = "FILE")]
    data: PathBuf,
    /// Read a column by another name, as in J1=q1_deg; OLD= leaves the column out.
    #[arg(long, value_name = "OLD=NEW", value_delimiter = ',')]
    columns: Vec<Rename>,
    /// What to hide: an effect of an arm, such as `joint_backlash(elbow)`; its place at random when not given.
    #[arg(long, value_name = "EFFECT")]
    effect: String,
    /// How much: `2x` for so much that what of it can be seen is twice what your model leaves, or a size such as 0.05deg.
    #[arg(long, default_value = "2x", value_name = "SIZE")]
    size: String,
    /// Seed of what is left to chance: the place, the phase of a wave.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Directory to write table.csv with the effect in it, model.yaml and answer.json to; made if need be.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// What came out at one size.
struct Tried {
    hidden: Imperfection,
    visible_mm: f64,
    found: Found,
    sentence: String,
}

/// Hides, diagnoses, and says from which size on it would be found.
pub(super) fn run(arguments: &InjectArguments) -> Result<Outcome, TrialError> {
    let request: EffectRequest = format!("{}={}", arguments.effect, arguments.size).parse()?;
    let requested = request.0.ok_or_else(|| EffectRequestError::Form(arguments.effect.clone()))?;
    for name in [TABLE, MODEL, ANSWER] {
        let path = arguments.output.join(name);
        if path.exists() {
            return Err(TrialError::Exists(path));
        }
    }
    let model = Model::read(&arguments.model).map_err(LaboratoryError::from).map_err(InjectionError::from)?;
    let named = naming(&model, &arguments.columns);
    let table = Table::read_named(&arguments.data, &named)
        .map_err(LaboratoryError::from)
        .map_err(InjectionError::from)?;
    let (message, truth, injected) =
        watched(|progress| inject(arguments, &requested, model, table, progress))?;
    let failed = |source| TrialError::Write { path: arguments.output.clone(), source };
    fs::create_dir_all(&arguments.output).map_err(failed)?;
    write(&arguments.output.join(TABLE), &table_text(&injected))?;
    fs::copy(&arguments.model, arguments.output.join(MODEL)).map_err(failed)?;
    write(&arguments.output.join(ANSWER), &format!("{truth:#}\n"))?;
    Ok(Outcome::done(message))
}

/// What is said, the truth, and the measurements with the effect in them.
fn inject(
    arguments: &InjectArguments,
    requested: &Requested,
    model: Model,
    table: Table,
    progress: &Progress,
) -> Result<(String, serde_json::Value, Table), TrialError> {
    let own = Measurements::new(model, table, Options::default(), progress)?;
    let mechanism = own.draw(&requested.choice, arguments.seed)?;
    let hidden = match requested.size {
        Size::OverNoise(times) => own.sized(&mechanism, times, progress)?,
        Size::Exact(size) => Imperfection { mechanism, size },
    };
    let plain = own.diagnose(None, progress)?;
    let first = tried(&own, hidden, &plain, progress)?;
    let (effect, site) = (first.hidden.mechanism.name(), first.hidden.mechanism.site(own.arm()));
    let unit = first.hidden.mechanism.unit_on(own.arm());
    let (size, shown, left) = (first.hidden.size, first.visible_mm, own.left_mm());
    let directory = arguments.output.display();
    let mut message = format!(
        "{effect}({site}) of {} is hidden in {directory}: {shown:.3} mm of it can be seen beside the {left:.3} mm that the model leaves.\n",
        shown_size(size, unit)
    );
    let mut show = |one: &Tried| {
        let times = one.visible_mm / own.left_mm().max(f64::MIN_POSITIVE);
        // Writing to a text cannot fail.
        let (size, found) = (shown_size(one.hidden.size, unit), one.found.words());
        let _ = writeln!(message, "  {times:5.2} times ({size}): {found}. {}", one.sentence);
    };
    show(&first);
    let factor = if first.found == Found::Named { 0.5 } else { 2.0 };
    let mut least: Option<f64> = (first.found == Found::Named).then_some(first.hidden.size);
    let mut size = first.hidden.size;
    for _ in 0..FURTHER_SIZES {
        size *= factor;
        let mechanism = first.hidden.mechanism.clone();
        let one = tried(&own, Imperfection { mechanism, size }, &plain, progress)?;
        show(&one);
        let named = one.found == Found::Named;
        least = if named { Some(size) } else { least };
        if named != (factor < 1.0) {
            break;
        }
    }
    message.push_str(&match least {
        Some(size) => format!("The lab would name it from about {} on.\n", shown_size(size, unit)),
        None => {
            format!("The lab would not name it in these measurements, up to {}.\n", shown_size(size, unit))
        }
    });
    let truth = serde_json::json!({
        "effect": effect, "where": site, "size": first.hidden.size, "unit": unit,
        "visible_mm": first.visible_mm, "left_mm": own.left_mm(), "named_from": least,
    });
    let injected = own.with(&first.hidden)?;
    Ok((message, truth, injected))
}

fn tried(
    own: &Measurements,
    hidden: Imperfection,
    plain: &Diagnosis,
    progress: &Progress,
) -> Result<Tried, InjectionError> {
    let diagnosis = own.diagnose(Some(&hidden), progress)?;
    let site = hidden.mechanism.site(own.arm());
    let before = plain.named.as_ref().map(|named| (named.effect.effect.as_str(), named.effect.site.as_str()));
    let found = Found::of(&diagnosis, (hidden.mechanism.name(), &site), before);
    let sentence = diagnosis_sentence(&diagnosis);
    Ok(Tried { visible_mm: own.visible_mm(&hidden, progress)?, hidden, found, sentence })
}
