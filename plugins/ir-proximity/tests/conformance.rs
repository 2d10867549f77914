//! The plugin does what every sensor must.

use plumb_ir_proximity::IrProximity;
use plumb_plugin::Sensor;
use plumb_plugin::conformance::{CheckOutcome, check_sensor};
use serde_json::json;

#[test]
fn it_conforms() {
    let report =
        check_sensor(include_str!("../plugin.yaml"), |host| IrProximity::create(&json!({"bit": 0}), host));
    assert!(report.rows.iter().all(|(_, outcome)| *outcome == CheckOutcome::Passed), "{report}");
}
