//! A table in memory: one array a column, rows in the order of the file.

use nalgebra::Rotation3;

use super::orientation::{Body, OrientationColumns};
use super::profile::ProfileColumns;
use super::scalar::{Scalar, ScalarColumn};
use super::stretch::Stretch;

/// Names met in a text column, each given a number in the order of first appearance.
#[derive(Debug, Clone, Default)]
pub struct Names {
    /// The distinct names.
    pub names: Vec<String>,
    /// Per row: which name, if the cell was not empty.
    pub of_row: Vec<Option<u32>>,
}

impl Names {
    /// The name of a row's cell.
    pub fn name(&self, row: usize) -> Option<&str> {
        let index = *self.of_row.get(row)?.as_ref()?;
        self.names.get(index as usize).map(String::as_str)
    }

    pub(super) fn push(&mut self, text: &str) {
        if text.is_empty() {
            self.of_row.push(None);
            return;
        }
        let index = match self.names.iter().position(|known| known == text) {
            Some(index) => index,
            None => {
                self.names.push(text.to_owned());
                self.names.len() - 1
            }
        };
        self.of_row.push(Some(index as u32));
    }
}

/// The measured positions of one target: mm; not a number where a coordinate was not measured.
#[derive(Debug, Clone)]
pub struct PositionColumns {
    /// The target's number, from 0.
    pub number: usize,
    /// The target's name, `p1`, `p2`, ...
    pub target: String,
    /// Per row: x, y, z in mm.
    pub xyz: Vec<[f64; 3]>,
}

impl PositionColumns {
    /// The same columns without rows.
    pub fn empty(&self) -> Self {
        Self { number: self.number, target: self.target.clone(), xyz: Vec::new() }
    }
}

/// Different words a column may hold for residuals to be tested against it: with more, hardly any level has rows enough.
pub const MOST_LEVELS: usize = 12;

/// A column the contract does not know, kept to test residuals against.
#[derive(Debug, Clone)]
pub struct Covariate {
    /// The column's header.
    pub name: String,
    /// Its cells.
    pub values: CovariateValues,
}

/// The cells of a covariate, one a row.
#[derive(Debug, Clone)]
pub enum CovariateValues {
    /// Numbers; not a number where empty.
    Numeric(Vec<f64>),
    /// Words: which level each row has, nothing where empty. Levels are in the order of first appearance; beyond
    /// [`MOST_LEVELS`] one more means all the rest.
    Categorical {
        /// The words.
        levels: Vec<String>,
        /// The level of each row.
        of_row: Vec<Option<u16>>,
    },
}

impl Covariate {
    /// A column without rows.
    pub(super) fn empty(name: &str) -> Self {
        Self { name: name.to_owned(), values: CovariateValues::Numeric(Vec::new()) }
    }

    /// A row's number: of words, the index of their level. Not a number where empty.
    pub fn number(&self, row: usize) -> f64 {
        match &self.values {
            CovariateValues::Numeric(values) => values.get(row).copied().unwrap_or(f64::NAN),
            CovariateValues::Categorical { of_row, .. } => {
                of_row.get(row).copied().flatten().map_or(f64::NAN, f64::from)
            }
        }
    }

    /// The words of a column of words; none of a column of numbers.
    pub fn levels(&self) -> &[String] {
        match &self.values {
            CovariateValues::Numeric(_) => &[],
            CovariateValues::Categorical { levels, .. } => levels,
        }
    }

    /// Whether it holds more different words than can be tested against.
    pub fn has_too_many_levels(&self) -> bool {
        self.levels().len() > MOST_LEVELS
    }

    /// Appends a cell: a number where all cells so far were numbers, else a word.
    pub(super) fn push(&mut self, cell: &str, number: Option<f64>) {
        if let CovariateValues::Numeric(values) = &mut self.values {
            match number {
                Some(number) => values.push(number),
                None if cell.is_empty() => values.push(f64::NAN),
                None => {
                    // The first word makes words of the numbers before it.
                    let before = std::mem::take(values);
                    self.values = CovariateValues::Categorical { levels: Vec::new(), of_row: Vec::new() };
                    for number in before {
                        self.push_word(&if number.is_nan() { String::new() } else { format!("{number}") });
                    }
                    self.push_word(cell);
                }
            }
        } else {
            self.push_word(cell);
        }
    }

    fn push_word(&mut self, word: &str) {
        let CovariateValues::Categorical { levels, of_row } = &mut self.values else { return };
        if word.is_empty() {
            of_row.push(None);
            return;
        }
        let known = levels.iter().position(|level| level == word);
        let level = known.unwrap_or_else(|| {
            // One level more than can be tested says that there are too many; what is in it does not matter.
            if levels.len() <= MOST_LEVELS {
                levels.push(word.to_owned());
            }
            levels.len() - 1
        });
        of_row.push(u16::try_from(level).ok());
    }
}

/// A measurement table. Lengths mm, angles rad, time s, temperature deg C, load kg. A missing cell is not a number.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// Where it was read from, for messages.
    pub source: String,
    /// What the file says of itself in lines that begin with `#`, without that sign: where it comes from.
    pub comments: Vec<String>,
    /// Number of joints: `q1 ... qn`.
    pub joints: usize,
    /// The header of each joint's column as it was read, and whether its unit is one of length; empty for a table that was made in memory.
    pub coordinate_columns: Vec<(String, bool)>,
    /// Commanded coordinates, row after row: rad, or mm of a joint that slides.
    pub q: Vec<f64>,
    /// Line of the file each row came from.
    pub lines: Vec<u32>,
    /// Measured positions.
    pub positions: Vec<PositionColumns>,
    /// Measured orientations.
    pub orientations: Vec<OrientationColumns>,
    /// Where a camera on the arm sees a board's origin, per row: x, y, z in mm, frame of the camera.
    pub board: Option<Vec<[f64; 3]>>,
    /// Boards named in `board`: which of several a camera on the arm sees.
    pub board_seen: Names,
    /// Points of the profile that a laser line sensor on the arm sees, in the order of their numbers.
    pub profiles: Vec<ProfileColumns>,
    /// Declared sigma of a position per row, mm, where the table has `std_*`.
    pub std: Option<Vec<[f64; 3]>>,
    /// Columns of one number a row that kinds of measurement read: heights, distances.
    pub scalars: Vec<ScalarColumn>,
    /// Surfaces named in `on`.
    pub on: Names,
    /// What the arm's own sensor did in a row: it came on, or went off; nothing where that was not logged.
    pub signal: Option<Vec<Option<bool>>>,
    /// Tilts about x and y of the level's frame, rad.
    pub tilt: Option<Vec<[f64; 2]>>,
    /// Levels named in `level`: where the level lay.
    pub level: Names,
    /// Points named in `distance_to`.
    pub distance_to: Names,
    /// Places named in `touch`.
    pub touch: Names,
    /// Time, s.
    pub time: Option<Vec<f64>>,
    /// Temperature, deg C.
    pub temperature: Option<Vec<f64>>,
    /// Load carried, kg.
    pub payload: Option<Vec<f64>>,
    /// Sessions.
    pub session: Names,
    /// The way in which each joint last arrived, row after row, where the table has `approach_*`: +1 moving so that its coordinate grew (from below), -1 so that it
    /// fell (from above), 0 where that is not known. The one place that says what the sign means; plugins, worlds, cells, reports and exports keep to it.
    pub approach: Option<Vec<i8>>,
    /// How fast each joint went, rad/s or mm/s, row after row; nothing where not logged.
    pub speed: Option<Vec<f64>>,
    /// Stretches of light stripes, in the order of their rows.
    pub stretches: Vec<Stretch>,
    /// Returns to one pose share an id.
    pub repeat: Names,
    /// Columns kept to test against.
    pub covariates: Vec<Covariate>,
    /// What the reader noticed and the user should know.
    pub warnings: Vec<String>,
}

impl Table {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.lines.len()
    }

    /// True when there is no row.
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// The values of a column of one number, mm or rad, if the table has it; of the first target's, where targets have columns of their own.
    pub fn scalar(&self, scalar: &Scalar) -> Option<&[f64]> {
        self.scalars.iter().find(|column| column.scalar == scalar).map(|column| column.values.as_slice())
    }

    /// The values of a target's column of one number, mm or rad, by the target's number from 0, if the table has it.
    pub fn scalar_of(&self, scalar: &Scalar, target: usize) -> Option<&[f64]> {
        let mut columns = self.scalars.iter();
        let column = columns.find(|column| column.scalar == scalar && column.target == Some(target));
        column.map(|column| column.values.as_slice())
    }

    /// The same as [`scalar`](Self::scalar), to be changed.
    pub fn scalar_mut(&mut self, scalar: &Scalar) -> Option<&mut Vec<f64>> {
        self.scalars.iter_mut().find(|column| column.scalar == scalar).map(|column| &mut column.values)
    }

    /// The commanded coordinates of a row (empty if there is no such row).
    pub fn q_of(&self, row: usize) -> &[f64] {
        self.q.get(row * self.joints..(row + 1) * self.joints).unwrap_or(&[])
    }

    /// The way in which a joint arrived in a row, as in [`approach`](Self::approach); 0 where it was not logged.
    pub fn approach_of(&self, row: usize, joint: usize) -> i8 {
        self.approach.as_ref().and_then(|sides| sides.get(row * self.joints + joint)).copied().unwrap_or(0)
    }

    /// Whether the sensor came on in a row, rather than went off; nothing where that was not logged.
    pub fn came_on(&self, row: usize) -> Option<bool> {
        self.signal.as_ref().and_then(|signals| signals.get(row)).copied().flatten()
    }

    /// Rows in the order of time where the table has it, else in the order of the file.
    pub fn order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.len()).collect();
        if let Some(time) = &self.time {
            // Rows without a time come last, in the order of the file: what is not a number is beyond all that are.
            order.sort_by(|left, right| {
                let [left, right] = [left, right].map(|row| time.get(*row).copied().unwrap_or(f64::NAN));
                left.total_cmp(&right)
            });
        }
        order
    }

    /// The row before each row in the order of time; nothing for the first.
    pub fn rows_before(&self) -> Vec<Option<usize>> {
        let mut before = vec![None; self.len()];
        let order = self.order();
        for (earlier, later) in order.iter().zip(order.iter().skip(1)) {
            if let Some(entry) = before.get_mut(*later) {
                *entry = Some(*earlier);
            }
        }
        before
    }

    /// Notes in the row just begun what it lies on and how far from what it is; no session, no return, no touch.
    pub fn note(&mut self, on: Option<&str>, distance_to: Option<&str>) {
        self.on.push(on.unwrap_or(""));
        self.distance_to.push(distance_to.unwrap_or(""));
        self.touch.of_row.push(None);
        self.level.push("");
        self.session.push("");
        self.repeat.push("");
    }

    /// The stretches of a row, by their indices; they are in the order of their rows.
    pub fn stretches_of(&self, row: usize) -> std::ops::Range<usize> {
        // They are in order: two halvings find them, however many there are.
        let first = self.stretches.partition_point(|stretch| stretch.row < row);
        let end = self.stretches.partition_point(|stretch| stretch.row <= row);
        first..end
    }

    /// The orientation of a body in a row, from its axes to those of the instrument that measured it.
    pub fn rotation_of(&self, body: Body, row: usize) -> Option<Rotation3<f64>> {
        self.orientations_as(body)?.rotations.get(row).copied().flatten()
    }

    /// The orientations of a body, if the table has them.
    pub fn orientations_as(&self, body: Body) -> Option<&OrientationColumns> {
        self.orientations.iter().find(|columns| columns.body == body)
    }

    /// The orientations of the target of this name, if the table has them.
    pub fn orientations_of(&self, target: &str) -> Option<&OrientationColumns> {
        self.orientations.iter().find(|columns| columns.body != Body::Board && columns.body.name() == target)
    }

    /// Whether a camera on the arm saw a board in a row.
    pub fn sees_a_board_in(&self, row: usize) -> bool {
        let placed = self
            .board
            .as_ref()
            .and_then(|board| board.get(row))
            .is_some_and(|xyz| xyz.iter().any(|part| part.is_finite()));
        placed || self.orientations_as(Body::Board).is_some_and(|columns| columns.is_in(row))
    }

    /// Whether some row has a board, or would.
    pub fn sees_a_board(&self) -> bool {
        self.board.is_some() || self.orientations.iter().any(|columns| columns.body == Body::Board)
    }

    /// Whether a laser line sensor saw any point in a row.
    pub fn has_profile(&self, row: usize) -> bool {
        let seen = |columns: &ProfileColumns| {
            columns.xz.get(row).is_some_and(|[x, z]| x.is_finite() && z.is_finite())
        };
        self.profiles.iter().any(seen)
    }

    /// Whether stretches of light stripes were measured.
    pub fn is_of_stripes(&self) -> bool {
        !self.stretches.is_empty()
    }

    /// How fast the joints went in a row, rad/s or mm/s; empty where not logged.
    pub fn speed_of(&self, row: usize) -> &[f64] {
        let speeds = self.speed.as_deref().unwrap_or(&[]);
        speeds.get(row * self.joints..(row + 1) * self.joints).unwrap_or(&[])
    }

    /// Groups of rows that are full returns to one pose (two rows or more).
    pub fn returns(&self) -> Vec<Vec<usize>> {
        let mut groups = vec![Vec::new(); self.repeat.names.len()];
        for (row, name) in self.repeat.of_row.iter().enumerate() {
            if let Some(group) = name.and_then(|name| groups.get_mut(name as usize)) {
                group.push(row);
            }
        }
        // A single visit says nothing of how well the arm comes back.
        groups.retain(|group| group.len() > 1);
        groups
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covariate(cells: &[&str]) -> Covariate {
        let mut covariate = Covariate::empty("fixture");
        for cell in cells {
            covariate.push(cell, cell.parse().ok());
        }
        covariate
    }

    #[test]
    fn words_are_levels_in_the_order_they_appear_and_empty_cells_have_none() {
        let fixture = covariate(&["left", "right", "", "left", "rear"]);
        assert_eq!(fixture.levels(), ["left", "right", "rear"]);
        let numbers: Vec<f64> = (0..5).map(|row| fixture.number(row)).collect();
        assert_eq!(numbers[..2], [0.0, 1.0]);
        assert!(numbers[2].is_nan());
        assert_eq!(numbers[3..], [0.0, 2.0]);
        assert!(!fixture.has_too_many_levels());
    }

    #[test]
    fn a_word_among_numbers_makes_words_of_them_and_numbers_alone_stay_numbers() {
        let mixed = covariate(&["1.5", "", "spare", "1.5"]);
        assert_eq!(mixed.levels(), ["1.5", "spare"]);
        assert_eq!(mixed.number(3), 0.0);
        let numbers = covariate(&["1.5", "", "2"]);
        assert!(numbers.levels().is_empty() && numbers.number(1).is_nan());
        assert_eq!(numbers.number(2), 2.0);
    }

    #[test]
    fn twelve_words_can_be_tested_against_and_thirteen_cannot() {
        let words: Vec<String> = (0..40).map(|index| format!("w{index}")).collect();
        let of = |count: usize| covariate(&words.iter().take(count).map(String::as_str).collect::<Vec<_>>());
        assert!(!of(MOST_LEVELS).has_too_many_levels() && of(MOST_LEVELS + 1).has_too_many_levels());
        assert_eq!(of(40).levels().len(), MOST_LEVELS + 1);
    }

    #[test]
    fn stretches_are_found_by_their_row() {
        let at = |row| Stretch::new(row, 0, Vec::new(), 1.0);
        let table = Table { stretches: vec![at(1), at(1), at(4)], ..Table::default() };
        assert_eq!([0, 1, 2, 4, 5].map(|row| table.stretches_of(row)), [0..0, 0..2, 2..2, 2..3, 3..3]);
    }
}
