//! The camera on a simulated arm's hand: asks the world for pictures, and emits them.

use std::path::PathBuf;

use plumb_plugin::{FrameHeader, Host, PluginError, Reading, Sensor, SensorDescription, Value};
use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::WorldCommand;
use serde::Deserialize;

/// The stream of pictures.
const FRAMES: &str = "frames";

/// What the cell file gives.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    #[serde(default)]
    laser: Option<OnOff>,
    #[serde(default)]
    filter: Option<InOut>,
    #[serde(default)]
    every_ms: Option<f64>,
    /// The world's socket; the cell gives it.
    world: PathBuf,
}

/// The same while it runs.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    #[serde(default)]
    laser: Option<OnOff>,
    #[serde(default)]
    filter: Option<InOut>,
    /// From picture to picture while the arm moves, ms; 0: only when it is asked.
    #[serde(default)]
    every_ms: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum OnOff {
    On,
    Off,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum InOut {
    In,
    Out,
}

/// The camera on a simulated arm's hand.
#[derive(Debug)]
pub struct SimulatedCamera {
    host: Host,
    world: WorldClient,
}

impl Sensor for SimulatedCamera {
    fn create(config: &Value, host: Host) -> Result<Self, PluginError> {
        let Config { laser, filter, every_ms, world } = Config::deserialize(config).map_err(|error| {
            let takes = "a simulated camera takes {laser: on or off, filter: in or out, every_ms: ms} and, from the cell, the socket of its world";
            PluginError::Refused(format!("{error}; {takes}"))
        })?;
        let world = WorldClient::connect(&world, "simulated-camera")?;
        let mut camera = Self { host, world };
        camera.shine(Settings { laser, filter, every_ms })?;
        Ok(camera)
    }

    fn describe(&self) -> SensorDescription {
        let world = &self.world.welcome().world;
        SensorDescription::of_camera(format!("Camera with a light stripe (simulated: {world})"))
    }

    fn configure(&mut self, settings: &Value) -> Result<(), PluginError> {
        let settings = Settings::deserialize(settings).map_err(|error| {
            PluginError::Refused(format!(
                "{error}; write {{laser: on or off, filter: in or out, every_ms: ms}}"
            ))
        })?;
        self.shine(settings)
    }

    fn read(&mut self, _after_ns: u64) -> Result<Option<Reading>, PluginError> {
        let picture = self.world.expose()?;
        let header = FrameHeader {
            time_ns: picture.time_ns,
            width: picture.width,
            height: picture.height,
            ..FrameHeader::default()
        };
        self.host.emit_in_place(FRAMES, header.message_bytes(), |message| {
            let pixels = header.write(message).map_err(|error| PluginError::Failed(error.to_string()))?;
            pixels.copy_from_slice(&picture.pixels);
            Ok(())
        })?;
        Ok(Some(Reading::of_picture(picture.time_ns, &picture.pixels, u64::from(picture.waiting))))
    }
}

impl SimulatedCamera {
    fn shine(&mut self, settings: Settings) -> Result<(), PluginError> {
        let command = WorldCommand::Shine {
            laser: settings.laser.map(|laser| laser == OnOff::On),
            filter: settings.filter.map(|filter| filter == InOut::In),
        };
        self.world.read(command).map_err(PluginError::from)?;
        if let Some(every_ms) = settings.every_ms {
            let every_ms = (every_ms != 0.0).then_some(every_ms);
            self.world.read(WorldCommand::Shutter { every_ms }).map_err(PluginError::from)?;
        }
        Ok(())
    }
}

plumb_plugin::export_sensor!(SimulatedCamera, include_str!("../plugin.yaml"));
