//! An infrared proximity sensor whose switching line another device reads.
//!
//! The sensor itself is a lamp, a phototransistor and a Schmitt trigger: it has no wire to the computer but one digital line,
//! which runs into an input of the robot that carries it. This plugin takes that line from the robot's stream of input levels,
//! and makes of it what the sensor saw: edges, each with the pose the robot stood in at that moment.

mod config;
mod watch;

use plumb_plugin::{DigitalInputs, Host, LogLevel, PluginError, Reading, Sensor, SensorDescription, Value};

use config::Config;
use watch::Watch;

/// The wired input: the levels of the device that reads the line.
const LINE: &str = "line";
/// The stream of edges.
const EDGES: &str = "edges";

/// An infrared proximity sensor.
#[derive(Debug)]
pub struct IrProximity {
    host: Host,
    config: Config,
    watch: Watch,
    unread: Vec<plumb_plugin::ProximityEdge>,
}

impl Sensor for IrProximity {
    fn create(config: &Value, host: Host) -> Result<Self, PluginError> {
        Ok(Self { host, config: Config::read(config)?, watch: Watch::default(), unread: Vec::new() })
    }

    fn describe(&self) -> SensorDescription {
        SensorDescription {
            model: "Infrared lamp and phototransistor with a Schmitt trigger".to_owned(),
            switches: true,
            quantities: Vec::new(),
        }
    }

    fn configure(&mut self, settings: &Value) -> Result<(), PluginError> {
        let config = self.config.with(settings)?;
        if config != self.config {
            self.config = config;
            self.watch.forget();
        }
        Ok(())
    }

    fn arm(&mut self) -> Result<(), PluginError> {
        loop {
            match self.poll() {
                Ok(()) => break,
                Err(PluginError::InputLost(text)) => self.host.log(LogLevel::Warn, &text),
                Err(error) => return Err(error),
            }
        }
        self.watch.settle();
        self.unread.clear();
        Ok(())
    }

    fn poll(&mut self) -> Result<(), PluginError> {
        loop {
            let message = match self.host.receive::<DigitalInputs>(LINE) {
                Ok(Some(message)) => message,
                Ok(None) => return Ok(()),
                Err(error) => {
                    self.watch.forget();
                    return Err(error);
                }
            };
            for edge in self.watch.take(&self.config, &message)? {
                self.keep(edge)?;
            }
        }
    }

    fn read(&mut self, after_ns: u64) -> Result<Option<Reading>, PluginError> {
        self.poll()?;
        if self.watch.seen_ns < after_ns {
            return Ok(None);
        }
        if let Some(edge) = self.watch.settle() {
            self.keep(edge)?;
        }
        Ok(Some(Reading {
            time_ns: self.watch.seen_ns,
            fired: self.watch.fired(),
            edges: std::mem::take(&mut self.unread),
            quantities: Vec::new(),
        }))
    }
}

impl IrProximity {
    fn keep(&mut self, edge: plumb_plugin::ProximityEdge) -> Result<(), PluginError> {
        self.unread.push(edge);
        self.host.emit(EDGES, &edge)
    }
}

plumb_plugin::export_sensor!(IrProximity, include_str!("../plugin.yaml"));
