//! `plumb stripe show`: a stored cloud on the Scan screen, or as a picture.

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::ValueEnum;
use plumb_cloud::Cloud;

use crate::failure::CommandResult;
use crate::print_line::print_line;
use crate::screens;
use crate::screens::scan::{Colouring, PictureSize, ScanState, Strokes, Viewpoint, picture};

/// Show a stored cloud on the Scan screen, or write a picture of it.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The cloud: a PLY, PCD or E57 file.
    cloud: PathBuf,
    /// Write a picture (PNG) there, and show nothing.
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// The picture as two side by side, the left one for the left eye.
    #[arg(long, requires = "picture")]
    stereo: bool,
    /// The picture's width and height, pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x960", value_parser = size, requires = "picture")]
    size: PictureSize,
    /// From which side: at 0 along y, at 90 from the right; deg.
    #[arg(long, value_name = "DEG", default_value_t = -30.0, allow_negative_numbers = true)]
    turn: f64,
    /// From how far above; 90 is straight down; deg.
    #[arg(long, value_name = "DEG", default_value_t = 30.0, allow_negative_numbers = true)]
    up: f64,
    /// The virtual camera's opening; 0 sees all rays parallel; deg.
    #[arg(long, value_name = "DEG", default_value_t = 30.0)]
    opening: f64,
    /// What the shorter side of the view shows, mm; all of it if left out.
    #[arg(long, value_name = "MM")]
    high: Option<f64>,
    /// The place in the middle of the view, mm.
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    at: Option<Vec<f64>>,
    /// What colours say.
    #[arg(long, value_name = "WHAT", default_value = "height")]
    colour: ColourBy,
    /// Points, not stripes as a wire-frame.
    #[arg(long)]
    points: bool,
    /// Along the plane most points lie in.
    #[arg(long)]
    edge_on: bool,
}

/// What colours say.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum ColourBy {
    /// How high a point lies.
    Height,
    /// How far from the plane most points lie in.
    Residual,
    /// How bright the stripe was.
    Intensity,
}

/// Why nothing is shown.
#[derive(Debug, thiserror::Error)]
enum ShowError {
    #[error("--at has {0} numbers; write X,Y,Z in mm")]
    At(usize),
    #[error(
        "most of these points lie in no plane, from which they could be measured: choose another --colour, or leave out --edge-on"
    )]
    NoPlane,
    #[error("{}: {what}", path.display())]
    Picture { path: PathBuf, what: String },
}

fn size(text: &str) -> Result<PictureSize, String> {
    let side = |side: &str| side.parse::<usize>().ok().filter(|side| (64..=8192).contains(side));
    let sides = text.split_once('x').and_then(|(width, height)| Some((side(width)?, side(height)?)));
    let (width, height) = sides.ok_or("write WIDTHxHEIGHT, each 64 to 8192")?;
    Ok(PictureSize { width, height })
}

/// Shows the cloud.
///
/// # Errors
/// The file holds no cloud; the picture cannot be written; the terminal cannot be used.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let cloud = plumb_cloud::read(&arguments.cloud)?;
    let scan = arguments.looked_at(cloud)?;
    let Some(path) = &arguments.picture else {
        screens::look(scan)?;
        return Ok(ExitCode::SUCCESS);
    };
    let failed = |what: String| ShowError::Picture { path: path.clone(), what };
    let bytes = picture(&scan, arguments.size, arguments.stereo).map_err(failed)?;
    fs::write(path, bytes).map_err(|cause| failed(cause.to_string()))?;
    print_line!("{} points of {} stripes, {}", scan.points.len(), scan.stripes, scan.eye.describe())?;
    if let (true, Some(band)) = (arguments.edge_on, &scan.band) {
        print_line!(
            "band {:.3} mm thick (95 % of the {} points in it), {:.3} mm rms",
            band.thickness(),
            band.points,
            band.rms
        )?;
    }
    Ok(ExitCode::SUCCESS)
}

impl Arguments {
    /// The cloud as these arguments look at it.
    fn looked_at(&self, cloud: Cloud) -> Result<ScanState, ShowError> {
        let name = self.cloud.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut scan = ScanState::of_cloud(name, cloud);
        scan.colouring = match self.colour {
            ColourBy::Height => Colouring::Height,
            ColourBy::Residual => Colouring::Residual,
            ColourBy::Intensity => Colouring::Intensity,
        };
        if matches!(self.colour, ColourBy::Residual) {
            scan.know_band();
            if scan.band.is_none() {
                return Err(ShowError::NoPlane);
            }
        }
        if self.points {
            scan.strokes = Strokes::Points;
        }
        scan.eye.opening = self.opening.clamp(0.0, 110.0).to_radians();
        scan.eye.viewpoint = Viewpoint::Around {
            yaw: self.turn.to_radians(),
            pitch: self.up.clamp(-90.0, 90.0).to_radians(),
            roll: 0.0,
        };
        scan.eye.see_all(scan.points.iter().map(|point| point.position));
        if let Some(high) = self.high {
            scan.eye.span = high.clamp(1e-3, 1e6);
        }
        match self.at.as_deref() {
            None => {}
            Some([x, y, z]) => scan.eye.target = [*x, *y, *z].into(),
            Some(other) => return Err(ShowError::At(other.len())),
        }
        if self.edge_on && !scan.toggle_edge_on() {
            return Err(ShowError::NoPlane);
        }
        Ok(scan)
    }
}
