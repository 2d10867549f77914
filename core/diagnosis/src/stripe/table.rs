//! Scans as files: for each scan a table of views and one of points, as a cell writes them.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use plumb_calibration::table::with_line_feeds;
use plumb_document::{FileKind, read_text};

/// One picture: where the arm was commanded to be.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Commanded joints, rad or mm.
    pub q: Vec<f64>,
    /// How fast they were at the exposure, rad/s or mm/s; empty at rest.
    pub speed: Vec<f64>,
    /// The way in which each joint arrived, as in `Table::approach`; empty where not known.
    pub approach: Vec<i8>,
    /// When the picture was exposed, s; nothing where not logged.
    pub time_s: Option<f64>,
}

/// One point of a stripe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StripePixel {
    /// The view it is of.
    pub view: usize,
    /// Column, pixels.
    pub u_px: f64,
    /// Row, pixels.
    pub v_px: f64,
    /// The column's standard uncertainty, pixels.
    pub sigma_px: f64,
}

/// Scans that are looked at together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scans {
    /// Every view of every scan.
    pub views: Vec<View>,
    /// The scan each view is of.
    pub scan_of_view: Vec<usize>,
    /// Every point; its view counts through all scans.
    pub pixels: Vec<StripePixel>,
    /// The scans' names.
    pub names: Vec<String>,
}

/// Why scans cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ScansError {
    /// Not readable.
    #[error("{}: cannot be read: {cause}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// Nothing there.
    #[error(
        "{}: no scan lies there (NAME.poses.csv with NAME.stripes.csv); let the procedure's scans `save:` their clouds",
        path.display()
    )]
    Empty {
        /// The folder.
        path: PathBuf,
    },
    /// A table is not as it must be.
    #[error("{}:{line}: {what}", path.display())]
    Row {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: u64,
        /// What is wrong, and what would be right.
        what: String,
    },
}

const POSES: &str = ".poses.csv";
const STRIPES: &str = ".stripes.csv";

fn text_of(path: &Path) -> Result<String, ScansError> {
    read_text(path, FileKind::TABLE)
        .map_err(|cause| ScansError::Read { path: path.to_owned(), cause: cause.into() })
}

impl Scans {
    /// Reads every scan in a folder, in the order of their names.
    ///
    /// # Errors
    /// [`ScansError`]
    pub fn read(folder: &Path) -> Result<Self, ScansError> {
        let failed = |cause| ScansError::Read { path: folder.to_owned(), cause };
        let mut names = Vec::new();
        for entry in fs::read_dir(folder).map_err(failed)? {
            let name = entry.map_err(failed)?.file_name().to_string_lossy().into_owned();
            names.extend(name.strip_suffix(POSES).map(str::to_owned));
        }
        names.sort();
        let mut scans = Self::default();
        for name in &names {
            let [poses, stripes] = [POSES, STRIPES].map(|ending| folder.join(format!("{name}{ending}")));
            let (of_poses, of_stripes) = (text_of(&poses)?, text_of(&stripes)?);
            scans.add(name, (&poses, &of_poses), (&stripes, &of_stripes))?;
        }
        if scans.names.is_empty() {
            return Err(ScansError::Empty { path: folder.to_owned() });
        }
        Ok(scans)
    }

    /// Adds one scan from the texts of its two files.
    ///
    /// # Errors
    /// [`ScansError::Row`]
    pub fn add(
        &mut self,
        name: &str,
        (poses_path, poses): (&Path, &str),
        (stripes_path, stripes): (&Path, &str),
    ) -> Result<(), ScansError> {
        let first = self.views.len();
        let scan = self.names.len();
        let poses = Columns::read(poses_path, poses)?;
        // As many joints as the header counts without a gap.
        let joints = (1..).take_while(|joint| poses.column(&format!("q{joint}_deg")).is_some()).count();
        if joints == 0 {
            let what = "the header has no `q1_deg`; a scan's poses are q1_deg, q2_deg, ...";
            return Err(poses.wrong(1, what.to_owned()));
        }
        for (line, row) in &poses.rows {
            let mut view = View { q: Vec::new(), speed: Vec::new(), approach: Vec::new(), time_s: None };
            if poses.column("time_s").is_some() {
                view.time_s = Some(poses.number(*line, row, "time_s")?);
            }
            for joint in 1..=joints {
                view.q.push(poses.number(*line, row, &format!("q{joint}_deg"))?.to_radians());
                let side = format!("approach_q{joint}");
                if poses.column(&side).is_some() {
                    view.approach.push(poses.number(*line, row, &side)?.clamp(-1.0, 1.0) as i8);
                }
                let speed = format!("speed_q{joint}_deg_s");
                if poses.column(&speed).is_some() {
                    view.speed.push(poses.number(*line, row, &speed)?.to_radians());
                }
            }
            self.views.push(view);
            self.scan_of_view.push(scan);
        }
        let stripes = Columns::read(stripes_path, stripes)?;
        for (line, row) in &stripes.rows {
            let number = |name: &str| stripes.number(*line, row, name);
            let of = number("row")?;
            let views = self.views.len() - first;
            // Written so that NaN is refused as well.
            if !(of >= 1.0 && of <= views as f64 && of.fract() == 0.0) {
                let what = format!("row {of} is none of the {views} of {}", poses_path.display());
                return Err(stripes.wrong(*line, what));
            }
            let pixel = StripePixel {
                view: first + of as usize - 1,
                u_px: number("u_px")?,
                v_px: number("v_px")?,
                sigma_px: number("sigma_px")?,
            };
            if pixel.sigma_px <= 0.0 {
                return Err(stripes.wrong(*line, format!("`sigma_px` is {}; it is above 0", pixel.sigma_px)));
            }
            self.pixels.push(pixel);
        }
        self.names.push(name.to_owned());
        Ok(())
    }

    /// The same with only every so many rows of each picture: neighbouring rows say almost the same.
    #[must_use]
    pub fn thinned(mut self, every: u32) -> Self {
        self.pixels.retain(|pixel| (pixel.v_px as u32).is_multiple_of(every.max(1)));
        self
    }
}

/// A line that is no row of a table.
fn unreadable(path: &Path, error: &csv::Error) -> ScansError {
    let line = error.position().map_or(1, csv::Position::line);
    ScansError::Row { path: path.to_owned(), line, what: error.to_string() }
}

/// A table whose columns are found by name.
struct Columns<'a> {
    path: &'a Path,
    names: Vec<String>,
    rows: Vec<(u64, csv::StringRecord)>,
}

impl<'a> Columns<'a> {
    fn read(path: &'a Path, text: &str) -> Result<Self, ScansError> {
        let text = with_line_feeds(text);
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
        let headers = reader.headers().map_err(|error| unreadable(path, &error))?;
        let names = headers.iter().map(str::to_owned).collect();
        let mut rows = Vec::new();
        for row in reader.records() {
            let row = row.map_err(|error| unreadable(path, &error))?;
            rows.push((row.position().map_or(0, csv::Position::line), row));
        }
        Ok(Self { path, names, rows })
    }

    fn column(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }

    fn number(&self, line: u64, row: &csv::StringRecord, name: &str) -> Result<f64, ScansError> {
        let index = self.column(name).ok_or_else(|| self.wrong(1, format!("the header has no `{name}`")))?;
        let text = row.get(index).unwrap_or_default();
        let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| self.wrong(line, format!("`{name}` is `{text}`, which is no number")))
    }

    fn wrong(&self, line: u64, what: String) -> ScansError {
        ScansError::Row { path: self.path.to_owned(), line, what }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(poses: &str, stripes: &str) -> Result<Scans, ScansError> {
        let mut scans = Scans::default();
        let (a, b) = (Path::new("a.poses.csv"), Path::new("a.stripes.csv"));
        scans.add("a", (a, poses), (b, stripes)).map(|()| scans)
    }

    const POSES: &str = "q1_deg,q2_deg,approach_q1,approach_q2\n90,0,1,-1\n45,10,0,1\n";

    #[test]
    fn two_scans_are_counted_through_and_every_other_row_of_a_picture_can_be_left_out() {
        let stripes = "row,u_px,v_px,sigma_px,on\n1,100.5,7,0.03,ball\n2,90,8,0.03,ball\n";
        let mut scans = read(POSES, stripes).unwrap();
        scans.add("b", (Path::new("b"), POSES), (Path::new("b"), stripes)).unwrap();
        assert_eq!(scans.views.len(), 4);
        assert_eq!(scans.scan_of_view, [0, 0, 1, 1]);
        assert_eq!(scans.pixels[2].view, 2);
        assert!((scans.views[0].q[0] - 90_f64.to_radians()).abs() < 1e-12);
        assert_eq!(scans.views[0].approach, [1, -1]);
        assert_eq!(scans.thinned(2).pixels.len(), 2);
    }

    #[test]
    fn the_time_of_a_picture_is_read_where_it_was_logged() {
        let stripes = "row,u_px,v_px,sigma_px,on\n1,100.5,7,0.03,ball\n";
        assert_eq!(read(POSES, stripes).unwrap().views[0].time_s, None);
        let dated = read("q1_deg,q2_deg,time_s\n90,0,12.5\n", stripes).unwrap();
        assert_eq!(dated.views[0].time_s, Some(12.5));
        let wrong = read("q1_deg,q2_deg,time_s\n90,0,late\n", stripes).unwrap_err().to_string();
        assert_eq!(wrong, "a.poses.csv:2: `time_s` is `late`, which is no number");
    }

    #[test]
    fn what_is_wrong_is_reported_with_file_and_line() {
        let refusal = |poses: &str, stripes: &str| read(poses, stripes).unwrap_err().to_string();
        let header = "row,u_px,v_px,sigma_px,on\n";
        assert_eq!(
            refusal(POSES, &format!("{header}3,1,1,1,x\n")),
            "a.stripes.csv:2: row 3 is none of the 2 of a.poses.csv"
        );
        let left = format!("{header}1,left,1,1,x\n");
        for stripes in [left.replace('\n', "\r\n"), left] {
            assert!(refusal(POSES, &stripes).contains(":2: `u_px` is `left`"), "{stripes:?}");
        }
        assert!(refusal(POSES, &format!("{header}1,1,1,0,x\n")).contains("`sigma_px` is 0"));
        assert!(refusal(POSES, "row,u_px\n1,1\n").contains("no `v_px`"));
        assert!(refusal("x\n1\n", header).contains("no `q1_deg`"));
        assert!(refusal(POSES, &format!("{header}1,1\n")).starts_with("a.stripes.csv:2"));
    }

    #[test]
    fn a_folder_without_scans_says_what_is_missing() {
        let folder = tempfile::tempdir().unwrap();
        assert!(Scans::read(folder.path()).unwrap_err().to_string().contains("no scan lies there"));
    }
}
