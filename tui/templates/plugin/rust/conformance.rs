//! What every {kind} must do, without a device and without plumb: `cargo test`.

use plumb_plugin::conformance::check_{kind};
use plumb_plugin::{{Kind}, Value};

#[test]
fn it_conforms() {
    let report = check_{kind}(include_str!("../plugin.yaml"), |host| {crate}::{Type}::create(&Value::Null, host));
    assert!(report.is_good(), "{report}");
}
