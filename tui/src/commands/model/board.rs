//! `plumb model board`: corners of a board in pictures become the board's pose in a measurement table.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use plumb_calibration::board_picture::{BoardCorners, CameraNumbers};
use plumb_calibration::board_table::{NamedText, with_boards};
use plumb_document::{FileKind, read_text};

/// Options of `board`.
#[derive(Debug, Args)]
pub(crate) struct BoardArguments {
    /// The poses: a table with the joints of each picture and a column `picture`, its name in the table of corners.
    poses: PathBuf,
    /// The corners, as any program found them: a table with the columns picture, corner, `u_px`, `v_px`, and board where there are several boards.
    #[arg(long, value_name = "CSV")]
    corners: PathBuf,
    /// Inner corners of the chessboard or `ChArUco` board along x and y, which are numbered from 0 along x, then y: 9x6. Of one among several boards: left=9x6.
    #[arg(long, required = true, value_name = "COLUMNSxROWS", value_parser = |text: &str| of_board(text, inner_corners))]
    size: Vec<OfBoard<(usize, usize)>>,
    /// The side of a square, mm. Of one among several boards: left=25.
    #[arg(long, required = true, value_name = "MM", value_parser = |text: &str| of_board(text, above_zero))]
    square_mm: Vec<OfBoard<f64>>,
    /// The camera as `OpenCV` calibrates it: fx,fy,cx,cy in px, then k1,k2,p1,p2,k3 where the lens bends.
    #[arg(long, value_name = "NUMBERS", value_parser = camera_numbers, allow_hyphen_values = true)]
    camera: CameraNumbers,
}

/// A number of one board, by its name, or of all that have none of their own.
#[derive(Debug, Clone, PartialEq)]
struct OfBoard<T> {
    board: Option<String>,
    value: T,
}

fn of_board<T>(text: &str, read: impl Fn(&str) -> Result<T, String>) -> Result<OfBoard<T>, String> {
    match text.split_once('=') {
        Some((board, value)) => Ok(OfBoard { board: Some(board.trim().to_owned()), value: read(value)? }),
        None => Ok(OfBoard { board: None, value: read(text)? }),
    }
}

/// That of a board: its own, else that of all.
fn value_of<T: Copy>(known: &[OfBoard<T>], board: Option<&str>) -> Option<T> {
    let own = known.iter().find(|one| one.board.is_some() && one.board.as_deref() == board);
    own.or_else(|| known.iter().find(|one| one.board.is_none())).map(|one| one.value)
}

fn above_zero(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite() && *value > 0.0);
    value.ok_or_else(|| format!("`{text}` is no length above zero"))
}

/// The most inner corners along a side: no board has more.
const MOST_CORNERS: usize = 500;

fn inner_corners(text: &str) -> Result<(usize, usize), String> {
    let sides = text.split_once(['x', 'X']).and_then(|(columns, rows)| {
        Some((columns.trim().parse::<usize>().ok()?, rows.trim().parse::<usize>().ok()?))
    });
    let known = |side: usize| (2..=MOST_CORNERS).contains(&side);
    sides.filter(|(columns, rows)| known(*columns) && known(*rows)).ok_or_else(|| {
        format!(
            "`{text}` is no number of inner corners along x and y; write 9x6 for a board of 10 x 7 squares"
        )
    })
}

fn camera_numbers(text: &str) -> Result<CameraNumbers, String> {
    let wrong = || {
        format!(
            "`{text}` is no camera; write fx,fy,cx,cy in px, and k1,k2,p1,p2,k3 after them where the lens bends"
        )
    };
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    let numbers = numbers.map_err(|_| wrong())?;
    let (&[fx, fy, cx, cy], lens) = numbers.split_first_chunk::<4>().ok_or_else(wrong)?;
    let mut distortion = [0.0; 5];
    if lens.len() > distortion.len()
        || numbers.iter().any(|number| !number.is_finite())
        || fx <= 0.0
        || fy <= 0.0
    {
        return Err(wrong());
    }
    for (known, number) in distortion.iter_mut().zip(lens) {
        *known = *number;
    }
    Ok(CameraNumbers { focal_px: [fx, fy], principal_px: [cx, cy], distortion })
}

/// The table of poses with the board's pose in each picture.
pub(super) fn run(arguments: &BoardArguments) -> Result<String, Box<dyn Error>> {
    let read = |path: &PathBuf| {
        let name = path.display().to_string();
        match read_text(path, FileKind::TABLE) {
            Ok(text) => Ok((name, text)),
            Err(error) => Err(format!("{name}: {error}")),
        }
    };
    let (poses_name, poses) = read(&arguments.poses)?;
    let (corners_name, corners) = read(&arguments.corners)?;
    let size = |board: Option<&str>| {
        let (columns, rows) = value_of(&arguments.size, board)?;
        Some(BoardCorners { columns, rows, square_mm: value_of(&arguments.square_mm, board)? })
    };
    let poses = NamedText { name: &poses_name, text: &poses };
    let corners = NamedText { name: &corners_name, text: &corners };
    Ok(with_boards(poses, corners, size, &arguments.camera)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_is_four_numbers_and_up_to_five_of_its_lens() {
        let plain = camera_numbers("800, 810,640,360").unwrap();
        assert_eq!(
            (plain.focal_px, plain.principal_px, plain.distortion),
            ([800.0, 810.0], [640.0, 360.0], [0.0; 5])
        );
        assert_eq!(camera_numbers("8,9,1,2,-0.1,0.2").unwrap().distortion, [-0.1, 0.2, 0.0, 0.0, 0.0]);
        for wrong in ["800,810,640", "0,810,640,360", "1,2,3,4,5,6,7,8,9,10", "a,b,c,d", "1,2,3,nan"] {
            assert!(camera_numbers(wrong).is_err_and(|message| message.contains("fx,fy,cx,cy")), "{wrong}");
        }
        assert_eq!(inner_corners("9x6"), Ok((9, 6)));
        assert!(inner_corners("9").is_err() && inner_corners("1x6").is_err() && above_zero("-1").is_err());
    }
}
