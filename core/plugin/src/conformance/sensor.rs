//! What every sensor must do.

use std::collections::HashSet;

use super::CheckOutcome;
use super::names::{WRITABLE, can_be_written};
use super::times::wrong_time;
use crate::{PluginError, Reading, SensorDescription, Value};

/// A fresh sensor, however it is reached, with nothing on its inputs.
pub trait SensorBench {
    /// What it says about itself.
    ///
    /// # Errors
    /// What the sensor says, as all below.
    fn describe(&mut self) -> Result<SensorDescription, PluginError>;

    /// Whether it takes in another device's stream.
    fn has_inputs(&self) -> bool;

    /// Makes it forget.
    ///
    /// # Errors
    /// What the sensor says.
    fn arm(&mut self) -> Result<(), PluginError>;

    /// Lets it take in what has come.
    ///
    /// # Errors
    /// What the sensor says.
    fn poll(&mut self) -> Result<(), PluginError>;

    /// Changes settings.
    ///
    /// # Errors
    /// What the sensor says.
    fn configure(&mut self, settings: &Value) -> Result<(), PluginError>;

    /// What it has seen; `None` when its inputs have not been seen up to `after_ns`.
    ///
    /// # Errors
    /// What the sensor says.
    fn read(&mut self, after_ns: u64) -> Result<Option<Reading>, PluginError>;

    /// Makes every input report that messages were lost; false where that cannot be arranged.
    fn lose_messages(&mut self) -> bool;
}

/// A check of a sensor: a statement, and the function that says whether it holds.
pub type SensorCheck = (&'static str, fn(&mut dyn SensorBench) -> Result<CheckOutcome, PluginError>);

/// What every sensor must do.
pub const SENSOR_CHECKS: &[SensorCheck] = &[
    ("its description makes sense", description_makes_sense),
    ("it can be armed, polled and read at once", can_be_read_at_once),
    ("its readings hold what its description says", readings_fit),
    ("its readings are dated by the cell's clock", readings_are_dated),
    ("a reading asked for after a moment is not an older one", readings_are_fresh),
    ("it does not claim to have seen what has not come", claims_nothing),
    ("it reports lost messages and goes on", reports_loss),
    ("it refuses settings it does not know", refuses_unknown_settings),
];

fn failed(how: String) -> Result<CheckOutcome, PluginError> {
    Ok(CheckOutcome::Failed(how))
}

fn description_makes_sense(bench: &mut dyn SensorBench) -> Result<CheckOutcome, PluginError> {
    let sensor = bench.describe()?;
    if sensor != bench.describe()? {
        return failed("it describes itself in two ways".to_owned());
    }
    if !sensor.switches && sensor.quantities.is_empty() {
        return failed("it neither switches nor measures anything".to_owned());
    }
    let mut names = HashSet::new();
    for quantity in &sensor.quantities {
        let (name, unit) = (&quantity.name, &quantity.unit);
        if name.is_empty() || !names.insert(name) {
            return failed(format!("two quantities are called '{name}', or one has no name"));
        }
        if !can_be_written(name) {
            return failed(format!("'{name}' cannot be named in an expression: {WRITABLE}"));
        }
        if !KNOWN_UNITS.contains(&unit.as_str()) {
            let known =
                KNOWN_UNITS.iter().filter(|unit| !unit.is_empty()).copied().collect::<Vec<_>>().join(", ");
            return failed(format!(
                "'{unit}' of '{name}' is no unit plumb knows: use \"\" for a pure number, or one of {known}"
            ));
        }
    }
    Ok(CheckOutcome::Passed)
}

/// The units a quantity may have. A procedure names a value by its quantity and unit, so the list is closed; lengths and angles are mm and deg or
/// rad throughout.
pub const KNOWN_UNITS: &[&str] = &[
    "",
    "mm",
    "um",
    "mm2",
    "mm3",
    "deg",
    "rad",
    "s",
    "ms",
    "us",
    "Hz",
    "N",
    "mN",
    "Nm",
    "kg",
    "g",
    "mg",
    "Pa",
    "kPa",
    "bar",
    "mbar",
    "degC",
    "K",
    "V",
    "mV",
    "A",
    "mA",
    "W",
    "J",
    "Ohm",
    "F",
    "H",
    "lx",
    "cd",
    "lm",
    "dB",
    "pH",
    "mol",
    "ml",
    "ul",
    "rpm",
    "px",
    "%",
    "ppm",
    "counts",
    "mm_per_s",
    "deg_per_s",
    "rad_per_s",
    "mm_per_s2",
    "ml_per_min",
    "W_per_m2",
    "g_per_l",
    "mol_per_l",
];

fn can_be_read_at_once(bench: &mut dyn SensorBench) -> Result<CheckOutcome, PluginError> {
    bench.arm()?;
    bench.poll()?;
    bench.read(0)?;
    Ok(CheckOutcome::Passed)
}

fn readings_fit(bench: &mut dyn SensorBench) -> Result<CheckOutcome, PluginError> {
    let sensor = bench.describe()?;
    bench.arm()?;
    bench.poll()?;
    let Some(reading) = bench.read(0)? else { return nothing_to_read(bench) };
    if !sensor.switches && (reading.fired.is_some() || !reading.edges.is_empty()) {
        return failed("it does not switch and yet reports an output".to_owned());
    }
    if !reading.edges.is_empty() {
        return failed("it reports edges right after it was armed".to_owned());
    }
    // What a sensor measures on other devices' messages may depend on what it sees there.
    let lacks = sensor.quantities.iter().find(|described| {
        !bench.has_inputs() && !reading.quantities.iter().any(|quantity| quantity.name == described.name)
    });
    if let Some(quantity) = lacks {
        return failed(format!("a reading lacks '{}', which its description promises", quantity.name));
    }
    for quantity in &reading.quantities {
        if !sensor.quantities.iter().any(|described| described.name == quantity.name) {
            return failed(format!("'{}' is not in its description", quantity.name));
        }
        if !quantity.value.is_finite()
            || quantity.standard_uncertainty.is_nan()
            || quantity.standard_uncertainty < 0.0
        {
            return failed(format!(
                "'{}' is {} +- {}",
                quantity.name, quantity.value, quantity.standard_uncertainty
            ));
        }
    }
    Ok(CheckOutcome::Passed)
}

fn readings_are_dated(bench: &mut dyn SensorBench) -> Result<CheckOutcome, PluginError> {
    bench.arm()?;
    bench.poll()?;
    let Some(reading) = bench.read(0)? else { return nothing_to_read(bench) };
    // Before anything has come on its inputs it has seen nothing, up to no moment at all.
    let has_seen_nothing = bench.has_inputs() && reading.time_ns == 0;
    let times = std::iter::once(reading.time_ns).filter(|_| !has_seen_nothing);
    let mut times = times.chain(reading.edges.iter().map(|edge| edge.time_ns));
    Ok(times
        .find_map(wrong_time)
        .map_or(CheckOutcome::Passed, |how| CheckOutcome::Failed(format!("the time of a reading {how}"))))
}

fn readings_are_fresh(bench: &mut dyn SensorBench) -> Result<CheckOutcome, PluginError> {
    bench.arm()?;
    bench.poll()?;
    let Some(first) = bench.read(0)? else { return nothing_to_read(bench) };
    let after = first.time_ns.saturating_add(1);
    match bench.read(after)? {
        Some(second) if second.time_ns < after => failed(format!(
            "asked for a reading not before {after} ns it gave one of {} ns: measure anew, or return nothing (PLUMB_EMPTY) until something newer is \
             there",
            second.time_ns
        )),
        _ => Ok(CheckOutcome::Passed),
    }
}

/// A sensor without inputs always has something to read; one with inputs waits for them.
fn nothing_to_read(bench: &mut dyn SensorBench) -> Result<CheckOutcome, PluginError> {
    if bench.has_inputs() {
        return Ok(CheckOutcome::Skipped("it has nothing to read before its inputs have come".to_owned()));
    }
    failed("it has no inputs to wait for, and nothing to read".to_owned())
}

fn claims_nothing(bench: &mut dyn SensorBench) -> Result<CheckOutcome, PluginError> {
    if !bench.has_inputs() {
        return Ok(CheckOutcome::Skipped("it takes nothing in from other devices".to_owned()));
    }
    bench.arm()?;
    bench.poll()?;
    match bench.read(u64::MAX)? {
        None => Ok(CheckOutcome::Passed),
        Some(reading) => failed(format!("it claims to have seen up to the end of time: {reading:?}")),
    }
}

fn reports_loss(bench: &mut dyn SensorBench) -> Result<CheckOutcome, PluginError> {
    if !bench.has_inputs() {
        return Ok(CheckOutcome::Skipped("it takes nothing in from other devices".to_owned()));
    }
    if !bench.lose_messages() {
        return Ok(CheckOutcome::Skipped("no loss can be arranged here".to_owned()));
    }
    let polled = bench.poll();
    let read = bench.read(0);
    let is_loss = |error: &PluginError| matches!(error, PluginError::InputLost(_));
    if !polled.as_ref().is_err_and(is_loss) && !read.as_ref().is_err_and(is_loss) {
        return failed(format!("messages were lost; polling gave {polled:?} and reading {read:?}"));
    }
    bench.poll()?;
    bench.read(0)?;
    Ok(CheckOutcome::Passed)
}

fn refuses_unknown_settings(bench: &mut dyn SensorBench) -> Result<CheckOutcome, PluginError> {
    let settings = serde_json::json!({"no_sensor_has_such_a_setting": 1});
    match bench.configure(&settings) {
        Err(PluginError::Refused(_) | PluginError::Unsupported(_)) => Ok(CheckOutcome::Passed),
        other => failed(format!("an unknown setting ended with {other:?}")),
    }
}
