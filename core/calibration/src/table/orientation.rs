//! Orientations in a table: unit quaternions or rotation vectors, and what is wrong with those that are neither.
//!
//! A quaternion is `w + xi + yj + zk` after Hamilton, of the turn that takes the body's axes to those of the instrument that measured it; a rotation vector is the axis of
//! that turn times its angle (Diebel, Representing Attitude, 2006, sections 6 and 7; OpenCV's `rvec`).

use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};

/// By how much the length of a quaternion may differ from 1: four numbers written with two decimals differ by no more.
pub const UNIT_TOLERANCE: f64 = 0.01;

/// The longest rotation vector, rad: a turn and what rounding adds. A longer one is likely in degrees.
const LONGEST_ROTATION: f64 = std::f64::consts::TAU * 1.01;

/// What an orientation (or a board's position) is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Body {
    /// A target, by its number from 0: its axes as an instrument sees them.
    Target(usize),
    /// A board, as a camera on the arm sees it.
    Board,
    /// The flange in the base, in place of joints.
    Flange,
}

impl Body {
    /// What its columns begin with: `p1`, `board`.
    pub fn name(self) -> String {
        match self {
            Self::Target(number) => format!("p{}", number + 1),
            Self::Board => "board".to_owned(),
            Self::Flange => "flange".to_owned(),
        }
    }
}

/// How an orientation is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OrientationForm {
    /// `qw`, `qx`, `qy`, `qz`.
    Quaternion,
    /// `rx`, `ry`, `rz`.
    RotationVector,
}

impl OrientationForm {
    /// What the columns of its numbers end in.
    fn parts(self) -> &'static [&'static str] {
        match self {
            Self::Quaternion => &["qw", "qx", "qy", "qz"],
            Self::RotationVector => &["rx", "ry", "rz"],
        }
    }

    fn noun(self) -> &'static str {
        match self {
            Self::Quaternion => "quaternion",
            Self::RotationVector => "rotation vector",
        }
    }

    /// `p1_qw, p1_qx, p1_qy and p1_qz`.
    fn columns(self, body: Body) -> String {
        let unit = if self == Self::Quaternion { "" } else { "_rad" };
        let mut names: Vec<String> =
            self.parts().iter().map(|part| format!("{}_{part}{unit}", body.name())).collect();
        let last = names.pop().unwrap_or_default();
        format!("{} and {last}", names.join(", "))
    }
}

/// The measured orientations of one body.
#[derive(Debug, Clone)]
pub struct OrientationColumns {
    /// Whose.
    pub body: Body,
    /// How they are written.
    pub form: OrientationForm,
    /// Per row: the turn from the body's axes to those of the instrument that measured it; nothing where it was not measured.
    pub rotations: Vec<Option<Rotation3<f64>>>,
    /// Whether the rows are poses to come: what will be measured is what is believed.
    pub to_come: bool,
    /// The numbers of the row that is being read.
    cells: [f64; 4],
}

impl OrientationColumns {
    /// Without rows.
    pub fn new(body: Body, form: OrientationForm) -> Self {
        Self { body, form, rotations: Vec::new(), to_come: false, cells: [f64::NAN; 4] }
    }

    /// The same columns without rows.
    pub fn empty(&self) -> Self {
        Self::new(self.body, self.form)
    }

    /// What was measured in a row, where that would be `believed` of a pose to come.
    pub(crate) fn measured(&self, row: usize, believed: &Rotation3<f64>) -> Option<Rotation3<f64>> {
        if self.to_come { Some(*believed) } else { self.rotations.get(row).copied().flatten() }
    }

    /// Whether a row has it.
    pub(crate) fn is_in(&self, row: usize) -> bool {
        self.to_come || self.rotations.get(row).is_some_and(Option::is_some)
    }

    /// Notes one number of the row that is being read.
    pub(super) fn set(&mut self, part: usize, value: f64) {
        if let Some(cell) = self.cells.get_mut(part) {
            *cell = value;
        }
    }

    /// Ends the row that is being read.
    ///
    /// # Errors
    /// What is wrong with its numbers.
    pub(super) fn end_row(&mut self) -> Result<(), String> {
        let cells = std::mem::replace(&mut self.cells, [f64::NAN; 4]);
        let numbers = cells.get(..self.form.parts().len()).unwrap_or(&cells);
        let known = numbers.iter().filter(|number| number.is_finite()).count();
        if known != 0 && known != numbers.len() {
            return Err(format!(
                "the {} has {known} of its {} numbers; give all of them, or leave all empty",
                self.form.noun(),
                numbers.len()
            ));
        }
        self.rotations.push(match known {
            0 => None,
            _ => Some(turn(self.form, cells)?),
        });
        Ok(())
    }
}

/// The rotation that some numbers mean.
fn turn(form: OrientationForm, [first, second, third, fourth]: [f64; 4]) -> Result<Rotation3<f64>, String> {
    match form {
        OrientationForm::Quaternion => {
            let quaternion = Quaternion::new(first, second, third, fourth);
            let length = quaternion.norm();
            if length == 0.0 {
                return Err("a quaternion of four zeros is no orientation; leave the cells empty if nothing was measured".to_owned());
            }
            // Rounded digits leave a length near one; other columns, or degrees, do not.
            if (length - 1.0).abs() > UNIT_TOLERANCE {
                return Err(format!(
                    "the quaternion has length {length:.4}; that of an orientation has length 1, within {UNIT_TOLERANCE}: see whether these are the right \
                     columns, and divide by the length if they are"
                ));
            }
            Ok(UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix())
        }
        OrientationForm::RotationVector => {
            let vector = Vector3::new(first, second, third);
            if vector.norm() > LONGEST_ROTATION {
                return Err(format!(
                    "the rotation vector is {:.1} rad long, more than a whole turn; if its numbers are degrees, the columns end in _deg",
                    vector.norm()
                ));
            }
            Ok(Rotation3::new(vector))
        }
    }
}

/// Which numbers of which orientation the columns of a header hold, with the index of each among them.
pub(super) type RotationPart = (usize, Body, OrientationForm, usize);

/// The orientations of a header's columns, without rows.
///
/// # Errors
/// The index of a column among the header's, from 0, and what is wrong there: an orientation that lacks a number, or is given twice.
pub(super) fn orientations(parts: &[RotationPart]) -> Result<Vec<OrientationColumns>, (usize, String)> {
    let mut found: Vec<OrientationColumns> = Vec::new();
    for &(column, body, form, _) in parts {
        match found.iter().find(|known| known.body == body) {
            Some(known) if known.form != form => {
                let name = body.name();
                return Err((
                    column,
                    format!(
                        "the orientation of {name} is given twice, as a {} and as a {}; keep one (--columns NAME= leaves a column out)",
                        known.form.noun(),
                        form.noun()
                    ),
                ));
            }
            Some(_) => {}
            None => found.push(OrientationColumns::new(body, form)),
        }
    }
    for &(column, body, form, _) in parts {
        let given: Vec<usize> =
            parts.iter().filter(|(_, other, ..)| *other == body).map(|(.., part)| *part).collect();
        if let Some(missing) = (0..form.parts().len()).find(|part| !given.contains(part)) {
            let lost = form.parts().get(missing).copied().unwrap_or_default();
            return Err((
                column,
                format!(
                    "the {} of {} lacks its {lost}; it needs the columns {}",
                    form.noun(),
                    body.name(),
                    form.columns(body)
                ),
            ));
        }
    }
    Ok(found)
}

/// The numbers of a rotation as a quaternion, `w` first and not negative.
pub fn quaternion(rotation: &Rotation3<f64>) -> [f64; 4] {
    let quaternion = UnitQuaternion::from_rotation_matrix(rotation);
    // A quaternion and its negative are one orientation: one of them is written.
    let sign = if quaternion.w < 0.0 { -1.0 } else { 1.0 };
    [quaternion.w, quaternion.i, quaternion.j, quaternion.k].map(|part| part * sign)
}

#[cfg(test)]
mod tests {
    use super::super::Table;

    fn read(text: &str) -> Table {
        Table::parse("t.csv", text).unwrap()
    }

    #[test]
    fn a_quaternion_and_its_rotation_vector_are_the_same_orientation() {
        // 90 degrees about z: x of the body is along y.
        let quaternion = read("q1_deg,p1_qw,p1_qx,p1_qy,p1_qz\n1,0.7071068,0,0,0.7071068\n");
        let vector = read("q1_deg,p1_rx_deg,p1_ry_deg,p1_rz_deg\n1,0,0,90\n");
        let radians = read("q1_deg,rvec_x_rad,rvec_y_rad,rvec_z_rad\n1,0,0,1.5707963\n");
        let turns = [&quaternion, &vector, &radians].map(|table| table.orientations[0].rotations[0].unwrap());
        for rotation in turns {
            let x = rotation * nalgebra::Vector3::x();
            assert!((x - nalgebra::Vector3::y()).norm() < 1e-6, "{x}");
        }
        assert_eq!(radians.orientations[0].body.name(), "board");
    }

    #[test]
    fn empty_cells_are_no_orientation_and_a_table_that_is_written_reads_as_it_was() {
        let text = "q1_deg,p1_x_mm,p1_qw,p1_qx,p1_qy,p1_qz,board_x_mm,board_y_mm,board_z_mm,board_rx_rad,board_ry_rad,board_rz_rad\n\
                    1,5,0.5,-0.5,0.5,0.5,1,2,300,0.1,-0.2,3\n2,6,,,,,,,,,,\n";
        let table = read(text);
        assert!(table.orientations.iter().all(|columns| columns.rotations[1].is_none()));
        assert_eq!(table.board.as_ref().unwrap()[0], [1.0, 2.0, 300.0]);
        let again = read(&super::super::table_text(&table));
        for (one, other) in table.orientations.iter().zip(&again.orientations) {
            let (one, other) = (one.rotations[0].unwrap(), other.rotations[0].unwrap());
            assert!(one.angle_to(&other) < 1e-7);
            assert!(again.orientations[0].rotations[1].is_none());
        }
        assert_eq!(again.board.unwrap()[0], [1.0, 2.0, 300.0]);
    }

    #[test]
    fn what_is_no_orientation_is_refused_with_its_place_and_what_would_be_right() {
        let quaternion = "q1_deg,p1_qw,p1_qx,p1_qy,p1_qz\n1,";
        let vector = "q1_deg,p1_rx_rad,p1_ry_rad,p1_rz_rad\n1,";
        for (text, parts) in [
            ("q1_deg,p1_qw,p1_qx,p1_qy\n1,1,0,0\n".to_owned(), ["column 2 (`p1_qw`)", "lacks its qz"]),
            (
                format!("{quaternion}0,0,0,0\n"),
                ["line 2, column 2 (`p1_qw`)", "four zeros is no orientation"],
            ),
            (format!("{quaternion}1,0.5,0,0\n"), ["has length 1.1180", "within 0.01"]),
            (format!("{quaternion}1,0,,0\n"), ["has 3 of its 4 numbers", "leave all empty"]),
            (format!("{vector}0,90,0\n"), ["90.0 rad long", "end in _deg"]),
            ("q1_deg,p1_rx,p1_ry_rad,p1_rz_rad\n1,0,0,0\n".to_owned(), ["column 2 (`p1_rx`)", "p1_rx_rad"]),
            (
                "q1_deg,p1_qw,p1_qx,p1_qy,p1_qz,p1_rx_rad,p1_ry_rad,p1_rz_rad\n1,1,0,0,0,0,0,0\n".to_owned(),
                ["column 6 (`p1_rx_rad`)", "given twice, as a quaternion and as a rotation vector"],
            ),
            ("q1_deg,board_rx_rad,board_ry_rad\n1,0,0\n".to_owned(), ["board lacks its rz", "board_rz_rad"]),
            ("q1_deg,tvec_x,tvec_y_mm\n1,0,0\n".to_owned(), ["the unit is missing", "tvec_x_mm"]),
        ] {
            let message = Table::parse("t.csv", &text).unwrap_err().to_string();
            assert!(parts.iter().all(|part| message.contains(part)), "{text:?}: {message}");
        }
    }
}
