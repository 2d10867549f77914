//! The plugin does what every sensor must.

use plumb_light_stripe::LightStripe;
use plumb_plugin::Sensor;
use plumb_plugin::conformance::{CheckOutcome, check_sensor};
use serde_json::json;

#[test]
fn it_conforms() {
    let report = check_sensor(include_str!("../plugin.yaml"), |host| LightStripe::create(&json!({}), host));
    let well = |outcome: &CheckOutcome| !matches!(outcome, CheckOutcome::Failed(_));
    assert!(report.rows.iter().all(|(_, outcome)| well(outcome)), "{report}");
}
