//! Pictures out of files, by their endings.

use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use plumb_document::{FileKind, ReadError, read_bytes};

use super::grey_picture::Picture;
use super::pgm;

/// Why a file gives no picture.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// Not readable.
    #[error("{}: cannot be read: {cause}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// Not a whole picture of a kind that is known.
    #[error("{}: {what}", path.display())]
    Form {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong, and what would be right.
        what: String,
    },
}

/// Reads a picture by its ending: `.pgm`, `.png`, or `.raw` with rows of `raw_width`.
///
/// # Errors
/// [`FrameError`]
pub fn read_picture(path: &Path, raw_width: Option<usize>) -> Result<Picture, FrameError> {
    let read = |cause: ReadError| FrameError::Read { path: path.to_owned(), cause: cause.into() };
    let wrong = |what: String| FrameError::Form { path: path.to_owned(), what };
    let picture = match ending(path).as_str() {
        "pgm" => pgm::parse(&read_bytes(path, FileKind::PICTURE).map_err(read)?).map_err(wrong)?,
        "png" => read_png(&read_bytes(path, FileKind::PICTURE).map_err(read)?).map_err(wrong)?,
        "raw" => {
            let pixels = read_bytes(path, FileKind::PICTURE).map_err(read)?;
            let width = raw_width
                .ok_or_else(|| wrong("a raw file does not say its size: give raw_width_px".to_owned()))?;
            if width == 0 || pixels.is_empty() || !pixels.len().is_multiple_of(width) {
                return Err(wrong(format!(
                    "its {} bytes are no whole rows of {width}: it is cut short, or of another width",
                    pixels.len()
                )));
            }
            Picture { width, height: pixels.len() / width, pixels }
        }
        other => {
            return Err(wrong(format!("`.{other}` is no kind of picture that is known: pgm, png or raw")));
        }
    };
    picture.image().map_err(|error| wrong(error.to_string()))?;
    Ok(picture)
}

pub(super) fn ending(path: &Path) -> String {
    path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// The most bytes a PNG may take once it is unpacked: 8192 x 8192 pixels of four colours. A file of a few kB can hold far more.
const MOST_UNPACKED: usize = 256 << 20;

fn read_png(bytes: &[u8]) -> Result<Picture, String> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
    decoder.set_limits(png::Limits { bytes: MOST_UNPACKED });
    let mut reader = decoder.read_info().map_err(|error| error.to_string())?;
    let size = reader.output_buffer_size().filter(|size| *size <= MOST_UNPACKED);
    let size = size.ok_or_else(|| format!("unpacked it has more than {} MiB", MOST_UNPACKED >> 20))?;
    let mut bytes = vec![0; size];
    let info = reader.next_frame(&mut bytes).map_err(|error| error.to_string())?;
    let samples = info.color_type.samples();
    bytes.truncate(info.buffer_size());
    let grey = |pixel: &[u8]| match pixel {
        [red, green, blue, ..] => {
            ((299 * u32::from(*red) + 587 * u32::from(*green) + 114 * u32::from(*blue) + 500) / 1000) as u8
        }
        [grey, ..] => *grey,
        [] => 0,
    };
    Ok(Picture {
        width: info.width as usize,
        height: info.height as usize,
        pixels: bytes.chunks_exact(samples).map(grey).collect(),
    })
}

/// The bytes of a PGM file.
pub fn write_pgm(width: usize, height: usize, pixels: &[u8]) -> Vec<u8> {
    let mut bytes = format!("P5\n{width} {height}\n255\n").into_bytes();
    bytes.extend_from_slice(pixels);
    bytes
}
