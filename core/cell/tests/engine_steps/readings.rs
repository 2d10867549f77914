//! `measure` and `configure`, with a camera and a sensor in memory.

use std::sync::{Arc, Mutex};

use plumb_cell::device::{Act, DeviceError, DeviceLinks, Link, SensorLink};
use plumb_cell::engine::start_run;
use plumb_cell::event::{Event, RunOutcome};
use plumb_cell::workcell::DeviceSetting;
use plumb_plugin::{PluginError, Quantity, QuantityDescription, Reading, SensorDescription, Value};

use super::support::running::{ZERO_ERROR_DEG, cell_with_steps, message_of, request, watch};
use super::support::{Devices, World};
use super::{folder, readings};

/// What the sensor was asked for, in order.
type Asked = Arc<Mutex<Vec<String>>>;

/// A sensor that reports a width of 1.5 px, and takes `{gain: 0 to 9}`; a gain of 9 breaks it.
struct Gauge {
    description: SensorDescription,
    asked: Asked,
    gain: f64,
}

impl SensorLink for Gauge {
    fn description(&self) -> &SensorDescription {
        &self.description
    }

    fn activate(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    fn arm(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    fn read(&mut self, after_ns: u64) -> Result<Reading, DeviceError> {
        self.asked.lock().expect("no test panicked").push(format!("read after {after_ns}"));
        if self.gain == 9.0 {
            let error = PluginError::Disconnected("the camera does not answer; is its plug in?".to_owned());
            return Err(DeviceError::refused("eye", "read", error));
        }
        let width = Quantity { name: "width".to_owned(), value: 1.5, standard_uncertainty: 0.1 };
        Ok(Reading { time_ns: 77, quantities: vec![width], ..Reading::default() })
    }

    fn configure(&mut self, settings: &Value) -> Result<(), DeviceError> {
        self.asked.lock().expect("no test panicked").push(settings.to_string());
        let gain = settings["gain"].as_f64().unwrap_or(-1.0);
        if !(0.0..=9.0).contains(&gain) {
            let error = PluginError::Refused("`gain` is 0 to 9".to_owned());
            return Err(DeviceError::refused("eye", "configure", error));
        }
        self.gain = gain;
        Ok(())
    }
}

/// The cell's devices with the gauge instead of the eye.
struct WithGauge(Devices, Asked);

impl DeviceLinks for WithGauge {
    fn connect(&mut self, device: &DeviceSetting, guard: Value) -> Result<Link, DeviceError> {
        if device.name != "eye" {
            return self.0.connect(device, guard);
        }
        let quantities = vec![QuantityDescription { name: "width".to_owned(), unit: "px".to_owned() }];
        let description = SensorDescription { model: "gauge".to_owned(), switches: false, quantities };
        Ok(Link::Sensor(Box::new(Gauge { description, asked: Arc::clone(&self.1), gain: 0.0 })))
    }

    fn simulate(&mut self, act: &Act) -> Result<Option<f64>, String> {
        self.0.simulate(act)
    }

    fn world_socket(&self) -> Option<String> {
        self.0.world_socket()
    }

    fn shut_down(&mut self, keep_world: bool) {
        self.0.shut_down(keep_world);
    }
}

/// Runs the steps: how it ended, what it said, the readings of the record and what the gauge was asked.
fn run(steps: &str) -> (RunOutcome, String, Vec<(String, f64)>, Vec<String>) {
    let folder = folder();
    let cell = cell_with_steps(&folder, steps);
    let asked = Asked::default();
    let devices = WithGauge(Devices(World::new(ZERO_ERROR_DEG)), Arc::clone(&asked));
    let running = start_run(request(&cell, &folder), |_| Ok(Box::new(devices))).expect("it starts");
    let (outcome, events) = watch(running, |_: &Event, _| {});
    let asked = asked.lock().expect("no test panicked").clone();
    (outcome, message_of(&events).to_owned(), readings(&folder), asked)
}

#[test]
fn a_measurement_is_recorded_and_may_be_used_in_expressions_under_its_unit() {
    let (outcome, message, readings, asked) = run("
steps:
  - {id: gauge, do: {measure: {sensor: eye, trigger: eye}}}
  - {id: twice, do: {compute: {values: {twice_px: 2 * gauge.width_px}}}}
");
    assert_eq!((outcome, message.as_str()), (RunOutcome::Passed, "all steps passed"));
    assert_eq!(readings, [("width".to_owned(), 1.5), ("twice_px".to_owned(), 3.0)]);
    assert_eq!(asked, ["read after 0", "read after 77"], "what is triggered first is waited for");
}

#[test]
fn how_sure_a_reading_is_may_be_used_in_expressions_and_is_never_0() {
    let (outcome, message, readings, _) = run("
steps:
  - {id: gauge, do: {measure: {sensor: eye}}}
  - {id: twice, do: {compute: {values: {twice_px: 2 * gauge.std_width_px}}}}
  - {id: row, do: {row: {robot: arm, p1_x_mm: gauge.width_px, std_x_mm: gauge.std_width_px - 0.1}}, on_error: abort}
");
    assert_eq!(outcome, RunOutcome::Error);
    assert!(message.contains("`std_x_mm` is 0: a standard uncertainty is above 0"), "{message}");
    assert_eq!(readings.last(), Some(&("twice_px".to_owned(), 0.2)));
}

#[test]
fn settings_reach_the_sensor_as_they_are_written_and_a_refusal_ends_the_step() {
    let (outcome, message, _, asked) = run("
steps:
  - {id: set, do: {configure: {sensor: eye, settings: {gain: 3}}}}
  - {id: too_far, do: {configure: {sensor: eye, settings: {gain: 11}}}, on_error: abort}
");
    assert_eq!(outcome, RunOutcome::Error);
    assert!(message.contains("step `too_far`: eye: `gain` is 0 to 9"), "{message}");
    assert_eq!(asked, ["{\"gain\":3}", "{\"gain\":11}"]);
}

#[test]
fn a_camera_that_does_not_answer_is_reported_in_its_own_words() {
    let (outcome, message, readings, _) = run("
steps:
  - {id: broken, do: {configure: {sensor: eye, settings: {gain: 9}}}}
  - {id: gauge, do: {measure: {sensor: eye}}, on_error: abort}
");
    assert_eq!(outcome, RunOutcome::Error);
    assert!(message.contains("step `gauge`: eye: ") && message.contains("is its plug in?"), "{message}");
    assert!(readings.is_empty(), "{readings:?}");
}

#[test]
fn a_scan_without_a_step_is_refused() {
    let (outcome, message, _, _) = run("
steps:
  - id: scan
    do: {scan: {robot: arm, sensor: eye, from_mm: [200, 0, 200], to_mm: [200, 0, 200], step_mm: 0, aim_mm: [0, 0, 100]}}
    on_error: abort
");
    assert_eq!(outcome, RunOutcome::Error);
    assert!(message.contains("a step of 0 mm on a way of 0.0 mm makes no scan"), "{message}");
}
