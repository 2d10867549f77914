//! The plugin: pictures come in, points go out.

use std::time::Duration;

use plumb_plugin::{
    FrameHeader, Host, JointState, JointVector, LogLevel, PluginError, Quantity, QuantityDescription,
    Reading, Sensor, SensorDescription, StripeFault, StripeHeader, StripePoint, Value,
};

use crate::config::{Config, Find};
use crate::extract::{Extractor, Image, NoStripe, RowPoint, SpotFinder};
use crate::frame::FrameFolder;
use crate::geometry::{Collineation, Rig, SheetFrame, read_rig};
use crate::pose::{Pose, Way};
use crate::quantity::quantity;
use crate::rays;

/// The wired input of pictures.
const FRAMES: &str = "frames";
/// The wired input of the robot's joints.
const POSE: &str = "pose";
/// The stream of points.
const POINTS: &str = "points";

/// The longest picture message that is taken in: 2448 x 2048 pixels.
const LONGEST_FRAME: usize = 5_013_544;

/// A light stripe sensor.
#[derive(Debug)]
pub struct LightStripe {
    host: Host,
    config: Config,
    geometry: Option<Geometry>,
    folder: Option<FrameFolder>,
    way: Way,
    has_pose: bool,
    extractor: Extractor,
    spots: SpotFinder,
    message: Vec<u8>,
    /// So many bytes of `message` are a picture that waits for the robot to report where it was.
    waiting: Option<usize>,
    size: Option<(u32, u32)>,
    last: Option<Last>,
    last_frame_ns: u64,
}

/// From pixels to points, ready to use.
#[derive(Debug)]
struct Geometry {
    /// As it is in force: the file's numbers with the corrections.
    rig: Rig,
    /// The frame in which corrections of the sheet are expressed: that of the file's sheet.
    drawn_sheet: Option<SheetFrame>,
    collineation: Collineation,
}

/// What the last picture held.
#[derive(Debug, Clone)]
struct Last {
    time_ns: u64,
    quantities: Vec<Quantity>,
}

impl Sensor for LightStripe {
    fn create(config: &Value, host: Host) -> Result<Self, PluginError> {
        let config = Config::read(config)?;
        let mut sensor = Self {
            host,
            geometry: None,
            folder: None,
            config: config.clone(),
            way: Way::default(),
            has_pose: false,
            extractor: Extractor::new(),
            spots: SpotFinder::default(),
            message: vec![0; LONGEST_FRAME],
            waiting: None,
            size: None,
            last: None,
            last_frame_ns: 0,
        };
        sensor.take_config(config)?;
        Ok(sensor)
    }

    fn describe(&self) -> SensorDescription {
        let quantity = |(name, unit): &(&str, &str)| QuantityDescription {
            name: (*name).to_owned(),
            unit: (*unit).to_owned(),
        };
        SensorDescription {
            model: "Light stripe range sensor".to_owned(),
            switches: false,
            quantities: QUANTITIES.iter().map(quantity).collect(),
        }
    }

    fn configure(&mut self, settings: &Value) -> Result<(), PluginError> {
        self.take_config(self.config.with(settings)?)
    }

    fn arm(&mut self) -> Result<(), PluginError> {
        loop {
            match self.poll() {
                Ok(()) => break,
                Err(PluginError::InputLost(text)) => self.host.log(LogLevel::Warn, &text),
                Err(error) => return Err(error),
            }
        }
        self.last = None;
        Ok(())
    }

    fn poll(&mut self) -> Result<(), PluginError> {
        self.take_poses()?;
        loop {
            if self.waiting.is_none() {
                match self.host.receive_bytes(FRAMES, &mut self.message) {
                    Ok(Some(length)) => self.waiting = Some(length),
                    Ok(None) => return Ok(()),
                    // Not wired: pictures come from files.
                    Err(PluginError::Refused(_)) if self.folder.is_some() => return Ok(()),
                    Err(error) => return Err(error),
                }
                // The robot may have reported where it was while the picture was on its way.
                self.take_poses()?;
            }
            if !self.take_waiting_frame()? {
                return Ok(());
            }
        }
    }

    fn read(&mut self, after_ns: u64) -> Result<Option<Reading>, PluginError> {
        self.poll()?;
        if self.folder.is_some() && after_ns != u64::MAX {
            self.take_file()?;
        }
        let seen = self.last.as_ref().filter(|last| last.time_ns >= after_ns);
        Ok(seen.map(|last| Reading {
            time_ns: last.time_ns,
            quantities: last.quantities.clone(),
            ..Reading::default()
        }))
    }
}

/// What a reading may hold, by name and unit.
const QUANTITIES: &[(&str, &str)] = &[
    ("rows", ""),
    ("u", "px"),
    ("width", "px"),
    ("sigma", "px"),
    ("peak", ""),
    ("saturated", "%"),
    ("fault", ""),
    ("spot_u", "px"),
    ("spot_v", "px"),
    ("spot_pixels", ""),
    ("ray_x", ""),
    ("ray_y", ""),
    ("top_x", ""),
    ("top_y", ""),
    ("bottom_x", ""),
    ("bottom_y", ""),
    ("lens_x", "mm"),
    ("lens_y", "mm"),
    ("lens_z", "mm"),
    ("sheet_x", ""),
    ("sheet_y", ""),
    ("sheet_z", ""),
    ("sheet_d", "mm"),
    ("focal_u", "px"),
    ("focal_v", "px"),
    ("middle_x", "mm"),
    ("middle_y", "mm"),
    ("middle_z", "mm"),
    ("along_x", ""),
    ("along_y", ""),
    ("along_z", ""),
];

impl LightStripe {
    fn take_config(&mut self, config: Config) -> Result<(), PluginError> {
        let refused = |error: &dyn std::fmt::Display| PluginError::Refused(error.to_string());
        let geometry = match &config.rig {
            None => None,
            Some(path) => {
                let rig = read_rig(&config.path(path)).map_err(|error| refused(&error))?;
                let drawn_sheet = rig.sheet_frame();
                let rig = rig.corrected(&config.corrections).map_err(|error| refused(&error))?;
                let collineation = rig.collineation().map_err(|error| refused(&error))?;
                Some(Geometry { rig, drawn_sheet, collineation })
            }
        };
        if config.frames != self.config.frames || self.folder.is_none() {
            self.folder = match &config.frames {
                None => None,
                Some(frames) => {
                    let folder = config.path(&frames.folder);
                    let opened = FrameFolder::open(&folder, frames.raw_width_px, frames.again);
                    Some(opened.map_err(|error| refused(&error))?)
                }
            };
        }
        self.geometry = geometry;
        self.config = config;
        Ok(())
    }

    fn take_poses(&mut self) -> Result<(), PluginError> {
        loop {
            match self.host.receive::<JointState>(POSE) {
                Ok(Some(state)) => {
                    self.has_pose = true;
                    self.way.add(state);
                }
                Ok(None) => return Ok(()),
                // Not wired: points come without a pose.
                Err(PluginError::Refused(_)) => return Ok(()),
                Err(error) => {
                    self.way.forget();
                    return Err(error);
                }
            }
        }
    }

    /// Works on the picture in `message`; false when the robot has not yet reported where it was.
    fn take_waiting_frame(&mut self) -> Result<bool, PluginError> {
        let message = std::mem::take(&mut self.message);
        let waiting = self.waiting.take();
        // What lies behind it is of pictures before.
        let taken = match FrameHeader::read(message.get(..waiting.unwrap_or(0)).unwrap_or_default()) {
            Ok((header, pixels)) => self.take_frame(&header, pixels),
            Err(error) => Err(PluginError::Failed(error.to_string())),
        };
        self.message = message;
        self.waiting = waiting.filter(|_| matches!(taken, Ok(false)));
        taken
    }

    fn take_frame(&mut self, header: &FrameHeader, pixels: &[u8]) -> Result<bool, PluginError> {
        if header.time_ns < self.last_frame_ns {
            let late_ms = (self.last_frame_ns - header.time_ns) as f64 / 1e6;
            return Err(PluginError::InputLost(format!(
                "a picture came out of order, {late_ms:.1} ms behind one that came before it; it is left out"
            )));
        }
        let size = *self.size.get_or_insert((header.width, header.height));
        self.require_size(size, header)?;
        let time_ns = header.time_ns.saturating_add_signed(self.config.delay_ns());
        let (joints, speeds) = match self.way.at(time_ns) {
            _ if !self.has_pose => (JointVector::zeros(0), JointVector::zeros(0)),
            Pose::At(joints, speeds) => (joints, speeds),
            Pose::NotYet => return Ok(false),
            // A stripe without a pose: anyone who knows that the robot was at rest for the picture can do without.
            Pose::Untold => (JointVector::zeros(0), JointVector::zeros(0)),
            Pose::Before(by_ns) => return Err(PluginError::InputLost(too_early(by_ns))),
        };
        self.last_frame_ns = header.time_ns;
        let image = Image::new(header.width as usize, header.height as usize, pixels)
            .map_err(|error| PluginError::Failed(error.to_string()))?;
        let seen = StripeHeader { time_ns: header.time_ns, joints, speeds, ..StripeHeader::default() };
        self.look(seen, &image)?;
        Ok(true)
    }

    fn require_size(&self, size: (u32, u32), header: &FrameHeader) -> Result<(), PluginError> {
        let requested = self
            .geometry
            .as_ref()
            .map_or(size, |geometry| (geometry.rig.camera.width_px, geometry.rig.camera.height_px));
        if (header.width, header.height) == requested {
            return Ok(());
        }
        let from = if self.geometry.is_some() { "the rig's camera has" } else { "those before it had" };
        Err(PluginError::Failed(format!(
            "a picture of {} x {} pixels came; {from} {} x {}",
            header.width, header.height, requested.0, requested.1
        )))
    }

    fn take_file(&mut self) -> Result<(), PluginError> {
        let Some(folder) = &mut self.folder else { return Ok(()) };
        let picture = folder.next_picture().map_err(|error| PluginError::Failed(error.to_string()))?;
        let header = FrameHeader {
            time_ns: self.host.now_ns(),
            width: picture.width as u32,
            height: picture.height as u32,
            ..FrameHeader::default()
        };
        self.take_frame(&header, &picture.pixels)?;
        Ok(())
    }

    fn look(&mut self, seen: StripeHeader, image: &Image<'_>) -> Result<(), PluginError> {
        let quantities = match self.config.find {
            Find::Stripe => self.look_for_stripe(seen, image)?,
            Find::BrightSpot | Find::DarkSpot => self.look_for_spot(image)?,
        };
        self.last = Some(Last { time_ns: seen.time_ns, quantities });
        Ok(())
    }

    fn look_for_spot(&mut self, image: &Image<'_>) -> Result<Vec<Quantity>, PluginError> {
        let dark = self.config.find == Find::DarkSpot;
        let spot = self.spots.find(image, self.config.threshold, dark, &self.config.noise);
        let spot = spot.map_err(|error| PluginError::Failed(error.to_string()))?;
        let mut quantities = vec![
            quantity("spot_u", spot.u_px, spot.sigma_px),
            quantity("spot_v", spot.v_px, spot.sigma_px),
            quantity("spot_pixels", f64::from(spot.pixels), 0.0),
        ];
        if let Some(geometry) = geometry_of_rays(&self.config, self.geometry.as_ref())? {
            let ray = geometry.rig.ray([spot.u_px, spot.v_px].into()).ok_or_else(|| {
                PluginError::Failed(
                    "the spot lies outside of what the lens's distortion holds for".to_owned(),
                )
            })?;
            quantities.extend([quantity("ray_x", ray.x, 0.0), quantity("ray_y", ray.y, 0.0)]);
            quantities.extend(rays::rig_quantities(&geometry.rig, geometry.drawn_sheet.as_ref()));
        }
        Ok(quantities)
    }

    fn look_for_stripe(
        &mut self,
        seen: StripeHeader,
        image: &Image<'_>,
    ) -> Result<Vec<Quantity>, PluginError> {
        let found = self.extractor.extract(image, &self.config.settings());
        let (points, fault) = match found {
            Ok(profile) => (profile.points.as_slice(), 0),
            Err(error) => {
                self.host.log(LogLevel::Debug, &error.to_string());
                (&[][..], fault_of(&error).code())
            }
        };
        let header = StripeHeader { fault, ..seen };
        let geometry = self.geometry.as_ref();
        let reported: Vec<StripePoint> = points.iter().map(|point| stripe_point(point, geometry)).collect();
        let mut quantities = summary(points, fault);
        if let Some(geometry) = geometry_of_rays(&self.config, self.geometry.as_ref())? {
            quantities.extend(rays::line_quantities(&geometry.rig, points));
            quantities.extend(rays::rig_quantities(&geometry.rig, geometry.drawn_sheet.as_ref()));
        }
        self.host.emit_bytes(POINTS, &header.message(&reported))?;
        Ok(quantities)
    }
}

/// A picture that is dated so long before the first pose that is remembered is not late: another clock has dated it.
const OTHER_CLOCK: Duration = Duration::from_secs(10);

/// Why there is no pose for a picture that is dated so long (ns) before the first that is remembered.
fn too_early(by_ns: u64) -> String {
    let by_s = by_ns as f64 * 1e-9;
    if Duration::from_nanos(by_ns) > OTHER_CLOCK {
        return format!(
            "the clock of input `{FRAMES}` is {by_s:.1} s behind the clock of input `{POSE}`: the plugins of camera and robot do not date with the cell's clock (`now_ns` of their hosts), so that where the robot was at an exposure cannot be known"
        );
    }
    format!(
        "a picture came so late that where the robot was at its exposure is no longer known: it is dated {by_s:.3} s before the first pose that is remembered; it is left out"
    )
}

/// The geometry, where rays are to be given.
fn geometry_of_rays<'a>(
    config: &Config,
    geometry: Option<&'a Geometry>,
) -> Result<Option<&'a Geometry>, PluginError> {
    if !config.rays {
        return Ok(None);
    }
    let none = || PluginError::Refused("`rays` needs a `rig`: without one pixels have no rays".to_owned());
    geometry.map(Some).ok_or_else(none)
}

fn fault_of(error: &NoStripe) -> StripeFault {
    match error {
        NoStripe::Dark { .. } => StripeFault::Dark,
        NoStripe::Bright { .. } => StripeFault::Bright,
        NoStripe::Short { .. } => StripeFault::Short,
        NoStripe::Flat { .. } => StripeFault::Flat,
        NoStripe::Ambiguous { .. } => StripeFault::Ambiguous,
    }
}

/// A row's point with its position, where the rig is known and the pixel means one.
fn stripe_point(point: &RowPoint, geometry: Option<&Geometry>) -> StripePoint {
    let mut reported = StripePoint {
        u_px: point.centre,
        v_px: point.row as f32,
        sigma_px: point.sigma,
        width_px: point.width,
        intensity: point.peak,
        flags: point.flags,
        flange_mm: [f32::NAN; 3],
        sigma_mm: f32::NAN,
    };
    let position = geometry.and_then(|geometry| {
        let pixel = geometry.rig.camera.straighten([f64::from(point.centre), f64::from(point.row)].into())?;
        let position = geometry.rig.bent(geometry.collineation.point(pixel).ok()?);
        Some((position, geometry.collineation.per_column(pixel).ok()?.norm()))
    });
    if let Some((position, per_column)) = position {
        reported.flange_mm = [position.x as f32, position.y as f32, position.z as f32];
        reported.sigma_mm = (per_column * f64::from(point.sigma)) as f32;
    }
    reported
}

fn summary(points: &[RowPoint], fault: u32) -> Vec<Quantity> {
    let count = points.len() as f64;
    let mut quantities = vec![quantity("rows", count, 0.0), quantity("fault", f64::from(fault), 0.0)];
    if points.is_empty() {
        return quantities;
    }
    let mean =
        |value: fn(&RowPoint) -> f32| points.iter().map(|point| f64::from(value(point))).sum::<f64>() / count;
    let variance: f64 = points.iter().map(|point| f64::from(point.sigma).powi(2)).sum();
    let saturated = points.iter().filter(|point| point.is(RowPoint::SATURATED)).count() as f64;
    quantities.extend([
        quantity("u", mean(|point| point.centre), variance.sqrt() / count),
        quantity("width", mean(|point| point.width), 0.0),
        quantity("sigma", (variance / count).sqrt(), 0.0),
        quantity("peak", mean(|point| point.peak), 0.0),
        quantity("saturated", 100.0 * saturated / count, 0.0),
    ]);
    quantities
}

plumb_plugin::export_sensor!(LightStripe, include_str!("../plugin.yaml"));
