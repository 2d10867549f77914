//! The camera as a device: a reading is a picture, which goes out on the stream.

use std::time::{Duration, Instant};

use plumb_plugin::{FrameHeader, Host, PluginError, Reading, Sensor, SensorDescription, Value};

use crate::capture::Capture;
use crate::config::{Config, Settings, every_ns};
use crate::film::{Film, Picture};
use crate::kernel;
use crate::recorder::Recorder;

/// The stream of pictures.
const FRAMES: &str = "frames";

/// The longest message of a picture that the manifest allows: 2448 x 2048 pixels.
const LONGEST_FRAME: usize = 5_013_544;

/// So long a picture that was asked for may take.
const PATIENCE: Duration = Duration::from_secs(3);

/// So often a wait looks for a stop.
const STOP_CHECK: Duration = Duration::from_millis(20);

/// A camera of this computer.
#[derive(Debug)]
pub struct V4l2Camera {
    host: Host,
    device: String,
    exposure_ns: Option<u64>,
    recorder: Recorder,
}

impl Sensor for V4l2Camera {
    fn create(config: &Value, host: Host) -> Result<Self, PluginError> {
        let config = Config::read(config)?;
        let capture = kernel::open(&config)?;
        Self::listen_to(capture, &config, host)
    }

    fn describe(&self) -> SensorDescription {
        let layout = self.recorder.film().layout();
        SensorDescription::of_camera(format!(
            "Camera at {}, {} x {} pixels in {}",
            self.device,
            layout.width,
            layout.height,
            layout.format.name()
        ))
    }

    fn configure(&mut self, settings: &Value) -> Result<(), PluginError> {
        let every_ns = Settings::read(settings)?.every_ns()?;
        self.recorder.film().keep_every(every_ns)
    }

    fn arm(&mut self) -> Result<(), PluginError> {
        self.recorder.film().forget();
        Ok(())
    }

    fn read(&mut self, _after_ns: u64) -> Result<Option<Reading>, PluginError> {
        let (picture, waiting) = self.fetch().map_err(|error| self.named(error))?;
        self.emit(&picture)?;
        Ok(Some(Reading::of_picture(picture.time_ns, &picture.pixels, waiting as u64)))
    }
}

impl V4l2Camera {
    /// The camera behind a driver that has been opened.
    pub(crate) fn listen_to(
        capture: Box<dyn Capture>,
        config: &Config,
        host: Host,
    ) -> Result<Self, PluginError> {
        let (device, layout) = (config.device().display().to_string(), capture.layout());
        let header = FrameHeader { width: layout.width, height: layout.height, ..FrameHeader::default() };
        if header.message_bytes() > LONGEST_FRAME {
            return Err(PluginError::Refused(format!(
                "{device}: {} x {} pixels are more than the {} of its stream: give smaller `width_px` and `height_px`",
                layout.width,
                layout.height,
                LONGEST_FRAME - size_of::<FrameHeader>()
            )));
        }
        let exposure_ns = config.exposure_ns();
        let mut film = Film::new(layout, exposure_ns);
        film.keep_every(every_ns(config.every_ms)?)?;
        let recorder = Recorder::start(capture, film, host.clone());
        Ok(Self { host, device, exposure_ns, recorder })
    }

    /// The oldest picture that waits; where none does, one whose shutter opens after this was called. While pictures are fetched no more are kept.
    fn fetch(&self) -> Result<(Picture, usize), PluginError> {
        let end = Instant::now() + PATIENCE;
        let mut film = self.recorder.film();
        film.want_no_more();
        if let Some(waiting) = film.fetch()? {
            return Ok(waiting);
        }
        film.want_one_since(self.host.now_ns());
        loop {
            if let Some(taken) = film.fetch()? {
                return Ok(taken);
            }
            if self.host.should_stop() {
                return Err(PluginError::stopped());
            }
            if Instant::now() >= end {
                return Err(PluginError::TimedOut(silence(film.has_begun())));
            }
            film = self.recorder.wait(film, STOP_CHECK);
        }
    }

    fn emit(&self, picture: &Picture) -> Result<(), PluginError> {
        let layout = self.recorder.film().layout();
        let header = FrameHeader {
            time_ns: picture.time_ns,
            width: layout.width,
            height: layout.height,
            exposure_ns: self.exposure_ns.unwrap_or(0),
            ..FrameHeader::default()
        };
        self.host.emit_in_place(FRAMES, header.message_bytes(), |message| {
            let pixels = header.write(message).map_err(|error| PluginError::Failed(error.to_string()))?;
            pixels.copy_from_slice(&picture.pixels);
            Ok(())
        })
    }

    /// An error of the camera's, with its device file before it.
    fn named(&self, error: PluginError) -> PluginError {
        let text = format!("{}: {}", self.device, error.text());
        PluginError::from_status(error.status(), text)
    }
}

/// Why nothing may have come.
fn silence(has_begun: bool) -> String {
    let seconds = PATIENCE.as_secs();
    if has_begun {
        format!("its pictures have stopped: none has come for {seconds} s")
    } else {
        format!(
            "no picture has come within {seconds} s: does the camera wait for a trigger, or is its bus too slow for so many pixels?"
        )
    }
}

plumb_plugin::export_sensor!(V4l2Camera, include_str!("../plugin.yaml"));
