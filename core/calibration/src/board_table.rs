//! Corners of a board in pictures, pixel by pixel, as the columns `board_*` of a measurement table.

use std::collections::BTreeMap;

use csv::{ReaderBuilder, StringRecord};
use thiserror::Error;

use crate::board_picture::{BoardCorners, BoardPictureError, BoardPose, CameraNumbers, Corner};
use crate::table::with_line_feeds;

/// Why a table of corners and a table of poses do not make one.
#[derive(Debug, Error)]
pub enum BoardTableError {
    /// A file is no table with commas.
    #[error("{file}: {reason}")]
    Malformed {
        /// The file.
        file: String,
        /// What the reader said.
        reason: String,
    },
    /// A column is missing.
    #[error("{file}: there is no column `{column}`; {needed}")]
    NoColumn {
        /// The file.
        file: String,
        /// The column.
        column: &'static str,
        /// What the table has to have.
        needed: &'static str,
    },
    /// A cell that is no number.
    #[error("{file}: line {line}, column `{column}`: `{cell}` is not {what}")]
    Cell {
        /// The file.
        file: String,
        /// Its line.
        line: u64,
        /// The column.
        column: &'static str,
        /// What is there.
        cell: String,
        /// What belongs there.
        what: &'static str,
    },
    /// A picture that gives no pose.
    #[error("{file}: picture `{picture}`: {source}")]
    Picture {
        /// The file of the corners.
        file: String,
        /// Which picture.
        picture: String,
        /// Why.
        source: BoardPictureError,
    },
    /// A board in a picture of which nobody said how large it is.
    #[error(
        "{file}: nobody says how large the board `{board}` is: give --size {board}=9x6 and --square-mm {board}=25, or one of each for all boards"
    )]
    UnknownBoard {
        /// The file of the corners.
        file: String,
        /// Which board.
        board: String,
    },
    /// A picture without joints.
    #[error(
        "{file}: picture `{picture}` has corners and no pose: the table of poses has no row with it in its column `picture`"
    )]
    NoPose {
        /// The file of the corners.
        file: String,
        /// Which picture.
        picture: String,
    },
}

/// A file's name, for messages, and its text.
#[derive(Debug, Clone, Copy)]
pub struct NamedText<'t> {
    /// The name.
    pub name: &'t str,
    /// The text.
    pub text: &'t str,
}

const OF_CORNERS: &str =
    "a table of corners has the columns picture, corner, u_px, v_px, and board where there are several";

/// The corners of a board in a picture: by the picture's name and the board's, where there are several.
type Seen = BTreeMap<(String, Option<String>), Vec<Corner>>;
const OF_POSES: &str = "it says which picture was taken in each row, by its name in the table of corners";

impl NamedText<'_> {
    fn malformed(&self, error: &csv::Error) -> BoardTableError {
        BoardTableError::Malformed { file: self.name.to_owned(), reason: error.to_string() }
    }

    pub(crate) fn rows(&self) -> Result<(StringRecord, Vec<StringRecord>), BoardTableError> {
        let text = with_line_feeds(self.text);
        let mut reader =
            ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
        let header = reader.headers().map_err(|error| self.malformed(&error))?.clone();
        let rows = reader.records().collect::<Result<Vec<_>, _>>().map_err(|error| self.malformed(&error))?;
        Ok((header, rows))
    }

    pub(crate) fn column(
        &self,
        header: &StringRecord,
        column: &'static str,
        needed: &'static str,
    ) -> Result<usize, BoardTableError> {
        header.iter().position(|name| name == column).ok_or_else(|| BoardTableError::NoColumn {
            file: self.name.to_owned(),
            column,
            needed,
        })
    }

    /// Corners by picture and board.
    fn corners(&self) -> Result<Seen, BoardTableError> {
        let (header, rows) = self.rows()?;
        let index = |column| self.column(&header, column, OF_CORNERS);
        let (picture, number, u, v) = (index("picture")?, index("corner")?, index("u_px")?, index("v_px")?);
        let board = header.iter().position(|name| name == "board");
        let mut pictures = Seen::new();
        for row in &rows {
            let wrong = |column: &'static str, at: usize, what: &'static str| BoardTableError::Cell {
                file: self.name.to_owned(),
                line: row.position().map_or(0, csv::Position::line),
                column,
                cell: row.get(at).unwrap_or("").to_owned(),
                what,
            };
            let pixel = |column: &'static str, at: usize| {
                let value = row.get(at).and_then(|cell| cell.parse::<f64>().ok());
                value.filter(|value| value.is_finite()).ok_or_else(|| wrong(column, at, "a number of pixels"))
            };
            let number = row
                .get(number)
                .and_then(|cell| cell.parse::<usize>().ok())
                .ok_or_else(|| wrong("corner", number, "the number of a corner, 0 or more"))?;
            let corner = Corner { number, at: [pixel("u_px", u)?, pixel("v_px", v)?] };
            let board = board.map(|board| row.get(board).unwrap_or("").to_owned());
            pictures.entry((row.get(picture).unwrap_or("").to_owned(), board)).or_default().push(corner);
        }
        Ok(pictures)
    }
}

/// The table of poses with the board's pose in each picture: position, rotation vector, and how far the corners are off. Rows whose picture has no corners
/// are left empty there. Where the corners are of several boards (column `board`), a picture has a row for each that it shows. `size` says how large the board of a name is.
///
/// # Errors
/// [`BoardTableError`]
pub fn with_boards(
    poses: NamedText<'_>,
    corners: NamedText<'_>,
    size: impl Fn(Option<&str>) -> Option<BoardCorners>,
    camera: &CameraNumbers,
) -> Result<String, BoardTableError> {
    let pictures = corners.corners()?;
    let mut found: BTreeMap<&str, Vec<(Option<&str>, BoardPose)>> = BTreeMap::new();
    for ((picture, board), seen) in &pictures {
        let failed = |source| {
            let (file, picture) = (corners.name.to_owned(), picture.clone());
            BoardTableError::Picture { file, picture, source }
        };
        let known = size(board.as_deref()).ok_or_else(|| BoardTableError::UnknownBoard {
            file: corners.name.to_owned(),
            board: board.clone().unwrap_or_default(),
        })?;
        let pose = known.pose(camera, seen).map_err(failed)?;
        found.entry(picture).or_default().push((board.as_deref(), pose));
    }
    let several = pictures.keys().any(|(_, board)| board.is_some());
    // Every other column of the table of poses goes along as it is.
    let (header, rows) = poses.rows()?;
    let index = poses.column(&header, "picture", OF_POSES)?;
    if several && header.iter().any(|name| name == "board") {
        let reason =
            "the column `board` belongs to the table of corners: which boards a picture shows is seen there"
                .to_owned();
        return Err(BoardTableError::Malformed { file: poses.name.to_owned(), reason });
    }
    let taken = |picture: &str| rows.iter().any(|row| row.get(index) == Some(picture));
    if let Some((lost, _)) = pictures.keys().find(|(picture, _)| !taken(picture)) {
        return Err(BoardTableError::NoPose { file: corners.name.to_owned(), picture: lost.clone() });
    }
    let mut text = format!(
        "{},{}board_x_mm,board_y_mm,board_z_mm,board_rx_rad,board_ry_rad,board_rz_rad,corners_off_px\n",
        csv_line(&header),
        if several { "board," } else { "" }
    );
    let none = if several { ",".repeat(7) } else { ",".repeat(6) };
    for row in &rows {
        let seen = row.get(index).and_then(|picture| found.get(picture)).map_or(&[][..], Vec::as_slice);
        if seen.is_empty() {
            text.push_str(&format!("{},{none}\n", csv_line(row)));
        }
        for (board, pose) in seen {
            let board = board.map_or_else(String::new, |board| format!("{},", quoted(board)));
            text.push_str(&format!("{},{board}{}\n", csv_line(row), pose_cells(pose)));
        }
    }
    Ok(text)
}

fn pose_cells(pose: &BoardPose) -> String {
    let position = pose.camera_from_board.translation.vector;
    let rotation = pose.camera_from_board.rotation.scaled_axis();
    let numbers: Vec<String> =
        position.iter().chain(rotation.iter()).map(|number| format!("{number:.9}")).collect();
    format!("{},{:.4}", numbers.join(","), pose.off_px)
}

// A cell that holds what separates cells is quoted, and its quotes doubled (RFC 4180).
pub(crate) fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}

/// A record as a line of a table, without its end.
pub(crate) fn csv_line(record: &StringRecord) -> String {
    record.iter().map(quoted).collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Table;

    const BOARD: BoardCorners = BoardCorners { columns: 3, rows: 3, square_mm: 20.0 };
    const CAMERA: CameraNumbers =
        CameraNumbers { focal_px: [800.0, 800.0], principal_px: [320.0, 240.0], distortion: [0.0; 5] };

    /// A board square before the camera, 400 mm off: a square is 40 px.
    fn corners(picture: &str) -> String {
        (0..9).map(|n| format!("{picture},{n},{},{}\n", 320 + 40 * (n % 3), 240 + 40 * (n / 3))).collect()
    }

    fn made(poses: &str, corners: &str) -> Result<String, BoardTableError> {
        let [poses, corners] =
            [("poses.csv", poses), ("corners.csv", corners)].map(|(name, text)| NamedText { name, text });
        with_boards(poses, corners, |_| Some(BOARD), &CAMERA)
    }

    #[test]
    fn corners_become_columns_that_the_lab_reads() {
        let text = format!("picture,corner,u_px,v_px\n{}", corners("a.png"));
        let made = made("q1_deg,picture\n10,a.png\n20,b.png\n", &text).unwrap();
        let table = Table::parse("made.csv", &made).unwrap();
        let board = table.board.as_ref().unwrap();
        assert!(board[0][0].abs() < 1e-6 && (board[0][2] - 400.0).abs() < 1e-6, "{made}");
        assert!(board[1][0].is_nan() && table.orientations[0].rotations[1].is_none(), "no corners, no pose");
    }

    #[test]
    fn several_boards_in_a_picture_are_a_row_each() {
        let of = |board: &str| {
            corners("a.png").lines().map(|line| format!("{line},{board}\n")).collect::<String>()
        };
        let text = format!("picture,corner,u_px,v_px,board\n{}{}", of("left"), of("right"));
        let made = made("q1_deg,picture\n10,a.png\n20,b.png\n", &text).unwrap();
        let table = Table::parse("made.csv", &made).unwrap();
        assert_eq!(
            (table.len(), table.board_seen.name(0), table.board_seen.name(1)),
            (3, Some("left"), Some("right"))
        );
        assert_eq!(table.board_seen.name(2), None, "{made}");
        let [poses, corners] =
            [("poses.csv", "q1_deg,picture,board\n10,a.png,left\n"), ("corners.csv", text.as_str())]
                .map(|(name, text)| NamedText { name, text });
        let message = with_boards(poses, corners, |_| Some(BOARD), &CAMERA).unwrap_err().to_string();
        assert!(message.contains("belongs to the table of corners"), "{message}");
        let message = with_boards(poses, corners, |name| (name == Some("left")).then_some(BOARD), &CAMERA)
            .unwrap_err()
            .to_string();
        assert!(message.contains("how large the board `right` is"), "{message}");
    }

    #[test]
    fn what_does_not_go_together_is_reported_with_file_line_and_picture() {
        let text = format!("picture,corner,u_px,v_px\n{}", corners("a.png"));
        for (poses, corners, part) in [
            ("q1_deg\n10\n", text.as_str(), "poses.csv: there is no column `picture`"),
            ("q1_deg,picture\n10,b.png\n", text.as_str(), "picture `a.png` has corners and no pose"),
            ("q1_deg,picture\n10,a\n", "picture,corner,u_px\na,0,3\n", "there is no column `v_px`"),
            (
                "q1_deg,picture\n10,a\n",
                "picture,corner,u_px,v_px\na,0,3,left\n",
                "line 2, column `v_px`: `left`",
            ),
            (
                "q1_deg,picture\n10,a\n",
                "picture,corner,u_px,v_px\na,x,3,4\n",
                "`x` is not the number of a corner",
            ),
            ("q1_deg,picture\n10,a\n", "picture,corner,u_px,v_px\na,0,3,4\n", "picture `a`: 1 corners"),
        ] {
            for end in ["\n", "\r\n"] {
                let reported =
                    made(&poses.replace('\n', end), &corners.replace('\n', end)).unwrap_err().to_string();
                assert!(reported.contains(part), "{end:?}: {part}: {reported}");
            }
        }
    }
}
