//! A folder of pictures, taken in the order of their names.

use std::fs;
use std::path::{Path, PathBuf};

use super::grey_picture::Picture;
use super::picture::{FrameError, ending, read_picture};

/// A folder of pictures.
#[derive(Debug, Clone)]
pub struct FrameFolder {
    folder: PathBuf,
    files: Vec<PathBuf>,
    raw_width: Option<usize>,
    again: bool,
    next: usize,
    size: Option<(usize, usize)>,
}

impl FrameFolder {
    /// Looks for pictures. With `again` the first follows the last.
    ///
    /// # Errors
    /// [`FrameError`] for a folder that cannot be read or holds none.
    pub fn open(folder: &Path, raw_width: Option<usize>, again: bool) -> Result<Self, FrameError> {
        let read = |cause| FrameError::Read { path: folder.to_owned(), cause };
        let mut files = Vec::new();
        for entry in fs::read_dir(folder).map_err(read)? {
            let path = entry.map_err(read)?.path();
            if ["pgm", "png", "raw"].contains(&ending(&path).as_str()) {
                files.push(path);
            }
        }
        if files.is_empty() {
            let what = "the folder holds no pictures that end in .pgm, .png or .raw".to_owned();
            return Err(FrameError::Form { path: folder.to_owned(), what });
        }
        files.sort();
        Ok(Self { folder: folder.to_owned(), files, raw_width, again, next: 0, size: None })
    }

    /// The next picture; all have the size of the first.
    ///
    /// # Errors
    /// [`FrameError`] for a file that is no whole picture, has another size, or when there are no more.
    pub fn next_picture(&mut self) -> Result<Picture, FrameError> {
        if self.again && self.next == self.files.len() {
            self.next = 0;
        }
        let Some(path) = self.files.get(self.next) else {
            let what = match self.files.len() {
                1 => "its only picture has been taken".to_owned(),
                count => format!("all its {count} pictures have been taken"),
            };
            return Err(FrameError::Form { path: self.folder.clone(), what });
        };
        self.next += 1;
        let picture = read_picture(path, self.raw_width)?;
        let (width, height) = *self.size.get_or_insert((picture.width, picture.height));
        if (picture.width, picture.height) != (width, height) {
            let what = format!(
                "its size is {} x {}; the pictures before it have {width} x {height}",
                picture.width, picture.height
            );
            return Err(FrameError::Form { path: path.clone(), what });
        }
        Ok(picture)
    }
}
