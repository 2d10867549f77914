//! A sensor that reports when a line of another device changed: the smallest plugin that takes another device's stream in.

use plumb_plugin::{
    DigitalInputs, Host, PluginError, ProximityEdge, Reading, Sensor, SensorDescription, Value,
};

struct LineWatcher {
    host: Host,
    /// Everything up to here has been seen: ns of the cell's clock.
    seen_ns: u64,
    fired: Option<bool>,
    edges: Vec<ProximityEdge>,
}

plumb_plugin::export_sensor!(LineWatcher, include_str!("plugin.yaml"));

impl Sensor for LineWatcher {
    fn create(_config: &Value, host: Host) -> Result<Self, PluginError> {
        Ok(Self { host, seen_ns: 0, fired: None, edges: Vec::new() })
    }

    fn describe(&self) -> SensorDescription {
        SensorDescription { model: "line watcher".to_owned(), switches: true, quantities: Vec::new() }
    }

    fn arm(&mut self) -> Result<(), PluginError> {
        self.poll()?;
        self.edges.clear();
        Ok(())
    }

    fn poll(&mut self) -> Result<(), PluginError> {
        while let Some(inputs) = self.host.receive::<DigitalInputs>("line")? {
            self.seen_ns = inputs.time_ns;
            self.fired = Some(inputs.level(0));
            if inputs.has_changed(0) {
                let edge = ProximityEdge {
                    time_ns: inputs.time_ns,
                    sequence: 0,
                    fired: u32::from(inputs.level(0)),
                    reserved: 0,
                    joints: inputs.joints,
                    joints_half_width: inputs.joints_half_width,
                };
                self.host.emit("edges", &edge)?;
                self.edges.push(edge);
            }
        }
        Ok(())
    }

    fn read(&mut self, after_ns: u64) -> Result<Option<Reading>, PluginError> {
        if self.seen_ns < after_ns {
            return Ok(None);
        }
        Ok(Some(Reading {
            time_ns: self.seen_ns,
            fired: self.fired,
            edges: std::mem::take(&mut self.edges),
            quantities: Vec::new(),
        }))
    }
}
