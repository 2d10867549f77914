//! The kernel's side: a device file is opened, set, and its buffers are taken in turns. The system's calls are those of `moq-v4l`.

use std::fs;
use std::io;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;
use std::time::Duration;

use moq_v4l::buffer::{Flags, Type};
use moq_v4l::capability;
use moq_v4l::control::{Control, Value as ControlValue};
use moq_v4l::io::mmap::Stream;
use moq_v4l::io::traits::{CaptureStream, Stream as _};
use moq_v4l::video::Capture as _;
use moq_v4l::video::capture::Parameters;
use moq_v4l::{Device, Format, FourCC, Fraction};
use plumb_plugin::PluginError;

use crate::capture::{Capture, CaptureError, Shot, Stamp};
use crate::config::Config;
use crate::grey::{FORMATS, GreyFormat, Layout, name};

/// Buffers that are asked for; the driver may give others.
const BUFFERS: u32 = 4;
/// More than any driver gives.
const MOST_BUFFERS: usize = 32;

/// `POLLIN`: something can be read.
const READABLE: i16 = 1;

// What the system says, by its numbers in `errno.h`.
const EACCES: i32 = 13;
const EBUSY: i32 = 16;
const ENODEV: i32 = 19;
const EINVAL: i32 = 22;
const ENOTTY: i32 = 25;
const ENXIO: i32 = 6;
const EPERM: i32 = 1;

// Controls, by their numbers in `v4l2-controls.h`.
const EXPOSURE_AUTO: u32 = 0x009a_0901;
const EXPOSURE_BY_HAND: i64 = 1;
/// In units of 100 us.
const EXPOSURE_ABSOLUTE: u32 = 0x009a_0902;
const AUTOGAIN: u32 = 0x0098_0912;
const GAIN: u32 = 0x0098_0913;

/// Why a camera cannot be used, with what would be right.
#[derive(Debug, thiserror::Error)]
enum OpenError {
    #[error("there is no such device; {there}")]
    Absent { there: String },
    #[error("it is {what}, not a camera; {there}")]
    NoCamera { what: &'static str, there: String },
    #[error(
        "you may not open it: cameras belong to the group `video`. Add yourself to it (`sudo usermod -aG video $USER`) and log in anew"
    )]
    NotPermitted,
    #[error(
        "{card} gives no pictures there: most cameras have several device files, of which the first gives them; {there}"
    )]
    NoPictures { card: String, there: String },
    #[error("another program uses it (`fuser -v` names it)")]
    Busy,
    #[error(
        "it offers {offered}, of which none can be taken: what can be is {requested}. Compressed pictures cannot: compression moves the edges of a line"
    )]
    NoFormat { offered: String, requested: String },
    #[error("it takes no pictures of {} in {format}; the nearest are {} x {}", asked(*width, *height), nearest.0, nearest.1)]
    NoSize { width: Option<u32>, height: Option<u32>, format: String, nearest: (u32, u32) },
    #[error("its rows of {width} pixels in {format} would have {stride} bytes, which cannot be")]
    BadRows { width: u32, format: String, stride: u32 },
    #[error("it cannot be set to `{key}: {value}`: {cause} (`v4l2-ctl --list-ctrls` lists what it takes)")]
    NotSet { key: &'static str, value: f64, cause: io::Error },
    #[error("{doing} failed: {cause}")]
    System { doing: &'static str, cause: io::Error },
}

fn asked(width: Option<u32>, height: Option<u32>) -> String {
    match (width, height) {
        (Some(width), Some(height)) => format!("{width} x {height} pixels"),
        (Some(width), None) => format!("{width} pixels in a row"),
        (None, Some(height)) => format!("{height} rows"),
        (None, None) => "that size".to_owned(),
    }
}

/// Opens a camera and sets it.
pub(crate) fn open(config: &Config) -> Result<Box<dyn Capture>, PluginError> {
    let path = config.device();
    let formats = config.formats()?;
    let opened = Driver::open(path, config, &formats);
    let driver = opened.map_err(|error| {
        let text = format!("{}: {error}", path.display());
        match error {
            OpenError::Absent { .. } => PluginError::Disconnected(text),
            OpenError::System { .. } => PluginError::Failed(text),
            _ => PluginError::Refused(text),
        }
    })?;
    Ok(Box::new(driver))
}

/// A camera's driver that sends pictures.
struct Driver {
    stream: Stream<'static>,
    layout: Layout,
}

impl Driver {
    fn open(path: &Path, config: &Config, formats: &[GreyFormat]) -> Result<Self, OpenError> {
        let device = device_at(path)?;
        let layout = set_format(&device, config, formats)?;
        let interval_ns = set_speed(&device, config)?;
        set_controls(&device, config)?;
        let stream = start(&device).map_err(|cause| refused("starting it", cause))?;
        Ok(Self { stream, layout: Layout { interval_ns, ..layout } })
    }
}

/// A system's answer that has a meaning of its own, or what was being done.
fn refused(doing: &'static str, cause: io::Error) -> OpenError {
    match cause.raw_os_error() {
        Some(EBUSY) => OpenError::Busy,
        Some(EACCES | EPERM) => OpenError::NotPermitted,
        Some(ENODEV | ENXIO) => OpenError::Absent { there: cameras() },
        _ => OpenError::System { doing, cause },
    }
}

fn device_at(path: &Path) -> Result<Device, OpenError> {
    let no_camera = |what| OpenError::NoCamera { what, there: cameras() };
    let kind = match fs::metadata(path) {
        Ok(known) => known.file_type(),
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => {
            return Err(OpenError::Absent { there: cameras() });
        }
        Err(cause) => return Err(refused("looking at it", cause)),
    };
    if kind.is_dir() {
        return Err(no_camera("a folder"));
    }
    if !kind.is_char_device() {
        return Err(no_camera("a file"));
    }
    let device = Device::with_path(path).map_err(|cause| refused("opening it", cause))?;
    let known = device.query_caps().map_err(|cause| match cause.raw_os_error() {
        Some(ENOTTY | EINVAL) => no_camera("a device of another kind"),
        _ => refused("asking what it is", cause),
    })?;
    let needed = capability::Flags::VIDEO_CAPTURE | capability::Flags::STREAMING;
    if !known.capabilities.contains(needed) {
        return Err(OpenError::NoPictures { card: known.card, there: cameras() });
    }
    Ok(device)
}

/// The video devices of this computer, as a sentence's end.
fn cameras() -> String {
    let entries = fs::read_dir("/sys/class/video4linux").into_iter().flatten().flatten();
    let mut found: Vec<String> = entries
        .filter_map(|entry| {
            let card = fs::read_to_string(entry.path().join("name")).unwrap_or_default();
            Some(format!("/dev/{} ({})", entry.file_name().to_str()?, card.trim()))
        })
        .collect();
    found.sort();
    match found.is_empty() {
        true => "this computer has no video device: is the camera connected, its driver loaded?".to_owned(),
        false => format!("this computer has {}", found.join(", ")),
    }
}

/// Chooses the first of the formats that the camera offers, and its size.
fn set_format(device: &Device, config: &Config, formats: &[GreyFormat]) -> Result<Layout, OpenError> {
    let offered = device.enum_formats().map_err(|cause| refused("asking for its formats", cause))?;
    let offers = |format: &GreyFormat| offered.iter().any(|offer| offer.fourcc.repr == format.code);
    let Some(format) = formats.iter().copied().find(offers) else {
        let offered: Vec<String> = offered.iter().map(|offer| name(offer.fourcc.repr)).collect();
        let requested = if formats.len() == 1 { formats } else { &FORMATS };
        let requested: Vec<String> = requested.iter().map(GreyFormat::name).collect();
        return Err(OpenError::NoFormat { offered: offered.join(", "), requested: requested.join(", ") });
    };
    let now = device.format().map_err(|cause| refused("asking for its size", cause))?;
    let (width, height) = (config.width_px.unwrap_or(now.width), config.height_px.unwrap_or(now.height));
    let requested = Format::new(width, height, FourCC::new(&format.code));
    let set = device.set_format(&requested).map_err(|cause| refused("setting its format", cause))?;
    if (set.width, set.height, set.fourcc.repr) != (width, height, format.code) {
        let (width, height) = (config.width_px, config.height_px);
        let nearest = (set.width, set.height);
        return Err(OpenError::NoSize { width, height, format: format.name(), nearest });
    }
    let least = format.row_bytes(width);
    // Drivers that pad nothing may leave it at 0.
    let stride = if set.stride == 0 { least } else { set.stride as usize };
    if stride < least {
        return Err(OpenError::BadRows { width, format: format.name(), stride: set.stride });
    }
    Ok(Layout { width, height, stride, format, interval_ns: None })
}

/// Sets how many pictures a second it takes; the time from one to the next, ns, where the driver says.
fn set_speed(device: &Device, config: &Config) -> Result<Option<u64>, OpenError> {
    let now = match config.frames_per_second {
        // A driver that has one speed need not report it.
        None => device.params().ok(),
        Some(requested) => {
            let interval = Fraction::new(1000, (requested * 1000.0).round() as u32);
            let not_set = |cause| OpenError::NotSet { key: "frames_per_second", value: requested, cause };
            let set = device.set_params(&Parameters::new(interval)).map_err(not_set)?;
            let given = f64::from(set.interval.denominator) / f64::from(set.interval.numerator.max(1));
            if (given / requested - 1.0).abs() > 0.05 {
                let cause = format!("the nearest is {given:.1}");
                return Err(not_set(io::Error::other(cause)));
            }
            Some(set)
        }
    };
    let interval =
        now.map(|now| now.interval).filter(|period| period.numerator > 0 && period.denominator > 0);
    Ok(interval.map(|period| 1_000_000_000 * u64::from(period.numerator) / u64::from(period.denominator)))
}

/// Sets exposure and gain, where the cell file gives them; what the camera then did by itself it does no more.
fn set_controls(device: &Device, config: &Config) -> Result<(), OpenError> {
    let set = |id: u32, value: i64| device.set_control(Control { id, value: ControlValue::Integer(value) });
    if let Some(exposure_us) = config.exposure_us {
        // A camera that never sets its exposure by itself has no such control.
        let _ = set(EXPOSURE_AUTO, EXPOSURE_BY_HAND);
        set(EXPOSURE_ABSOLUTE, (exposure_us / 100.0).round().max(1.0) as i64)
            .map_err(|cause| OpenError::NotSet { key: "exposure_us", value: exposure_us, cause })?;
    }
    if let Some(gain) = config.gain {
        let _ = set(AUTOGAIN, 0);
        set(GAIN, gain).map_err(|cause| OpenError::NotSet { key: "gain", value: gain as f64, cause })?;
    }
    Ok(())
}

/// Starts to send. All buffers but the first are the driver's then; the first is given to it by the first `next`, which always gives back what it handed out before.
fn start(device: &Device) -> io::Result<Stream<'static>> {
    let mut stream = Stream::with_buffers(device, Type::VideoCapture, BUFFERS)?;
    for buffer in 1..MOST_BUFFERS {
        // Past the last the driver refuses.
        if CaptureStream::queue(&mut stream, buffer).is_err() {
            break;
        }
    }
    stream.start()?;
    Ok(stream)
}

impl Capture for Driver {
    fn layout(&self) -> Layout {
        self.layout
    }

    fn next(&mut self, wait: Duration) -> Result<Option<Shot<'_>>, CaptureError> {
        match self.stream.handle().poll(READABLE, wait.as_millis() as i32) {
            Ok(0) => return Ok(None),
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::Interrupted => return Ok(None),
            Err(error) => return Err(lost(error)),
        }
        let (bytes, about) = CaptureStream::next(&mut self.stream).map_err(lost)?;
        // Drivers of cameras that send no compressed pictures may leave it at 0.
        let used = if about.bytesused == 0 { bytes.len() } else { about.bytesused as usize };
        Ok(Some(Shot {
            bytes: bytes.get(..used).unwrap_or(bytes),
            number: about.sequence,
            stamp: stamp(about.flags, about.timestamp.sec, about.timestamp.usec),
            damaged: about.flags.contains(Flags::ERROR),
        }))
    }
}

fn lost(error: io::Error) -> CaptureError {
    match error.raw_os_error() {
        Some(ENODEV | ENXIO) => CaptureError::Unplugged,
        _ => CaptureError::System(error),
    }
}

/// What a buffer's time means, by its flags.
fn stamp(flags: Flags, seconds: i64, microseconds: i64) -> Stamp {
    let time_ns = (seconds.max(0) as u64) * 1_000_000_000 + (microseconds.max(0) as u64) * 1000;
    if flags & Flags::TIMESTAMP_MASK != Flags::TIMESTAMP_MONOTONIC {
        Stamp::Unknown
    } else if flags & Flags::TSTAMP_SRC_MASK == Flags::TSTAMP_SRC_SOE {
        Stamp::Opened(time_ns)
    } else {
        Stamp::Arrived(time_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_buffers_time_means_what_its_flags_say() {
        let at = |flags| stamp(flags, 3, 5);
        assert_eq!(at(Flags::TIMESTAMP_MONOTONIC), Stamp::Arrived(3_000_005_000));
        assert_eq!(at(Flags::TIMESTAMP_MONOTONIC | Flags::TSTAMP_SRC_SOE), Stamp::Opened(3_000_005_000));
        assert_eq!(at(Flags::TIMESTAMP_COPY | Flags::DONE), Stamp::Unknown);
        assert_eq!(at(Flags::empty()), Stamp::Unknown);
    }

    #[test]
    fn what_the_system_answers_is_reported_in_words() {
        let message_for = |number| refused("starting it", io::Error::from_raw_os_error(number)).to_string();
        assert!(message_for(EBUSY).contains("another program uses it"));
        assert!(message_for(EACCES).contains("group `video`"));
        assert!(message_for(ENODEV).contains("there is no such device"));
        assert!(message_for(5).starts_with("starting it failed: "));
        assert!(matches!(lost(io::Error::from_raw_os_error(ENODEV)), CaptureError::Unplugged));
    }
}
