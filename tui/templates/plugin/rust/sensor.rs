//! A sensor that measures a height. It makes its readings up: replace `read` by what reads yours.

use plumb_plugin::{Host, PluginError, Quantity, QuantityDescription, Reading, Sensor, SensorDescription, Value};

/// The sensor.
pub struct {Type} {
    host: Host,
}

impl Sensor for {Type} {
    /// Connects. `config` is what the cell file gives under `config:`, as plugin.yaml allows it.
    fn create(_config: &Value, host: Host) -> Result<Self, PluginError> {
        Ok(Self { host })
    }

    fn describe(&self) -> SensorDescription {
        let height = QuantityDescription { name: "height".to_owned(), unit: "mm".to_owned() };
        SensorDescription { model: "{name}, made up".to_owned(), switches: false, quantities: vec![height] }
    }

    /// Measures now: a reading is never older than `after_ns`, because the arm may have moved since. `None` means nothing is there yet.
    fn read(&mut self, _after_ns: u64) -> Result<Option<Reading>, PluginError> {
        let time_ns = self.host.now_ns();
        let height = Quantity { name: "height".to_owned(), value: 12.5, standard_uncertainty: 0.01 };
        Ok(Some(Reading { time_ns, quantities: vec![height], ..Reading::default() }))
    }
}

plumb_plugin::export_sensor!({Type}, include_str!("../plugin.yaml"));
