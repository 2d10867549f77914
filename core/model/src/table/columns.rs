//! A table in memory: one array a column, rows in the order of the file.

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
    pub(crate) fn empty(&self) -> Self {
        Self { number: self.number, target: self.target.clone(), xyz: Vec::new() }
    }
}

/// A column the contract does not know, kept to test residuals against.
#[derive(Debug, Clone)]
pub struct Covariate {
    /// The column's header.
    pub name: String,
    /// Per row; not a number where empty. Text is numbered in the order of appearance.
    pub values: Vec<f64>,
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
    /// Declared sigma of a position per row, mm, where the table has `std_*`.
    pub std: Option<Vec<[f64; 3]>>,
    /// Height of p1 over the surface named in `on`, mm.
    pub height: Option<Vec<f64>>,
    /// Surfaces named in `on`.
    pub on: Names,
    /// What the arm's own sensor did in a row: it came on, or went off; nothing where that was not logged.
    pub signal: Option<Vec<Option<bool>>>,
    /// Tilts about x and y of the level's frame, rad.
    pub tilt: Option<Vec<[f64; 2]>>,
    /// Levels named in `level`: where the level lay.
    pub level: Names,
    /// Distance of p1 to the point named in `distance_to`, mm.
    pub distance: Option<Vec<f64>>,
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
    /// Side from which each joint last arrived, -1, 0 or +1, row after row, where the table has `approach_*`.
    pub approach: Option<Vec<i8>>,
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

    /// The commanded coordinates of a row (empty if there is no such row).
    pub fn q_of(&self, row: usize) -> &[f64] {
        self.q.get(row * self.joints..(row + 1) * self.joints).unwrap_or(&[])
    }

    /// Side from which a joint arrived in a row; 0 where it was not logged.
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
            let at = |row: &usize| time.get(*row).copied().unwrap_or(f64::NAN);
            order.sort_by(|left, right| at(left).total_cmp(&at(right)));
        }
        order
    }

    /// Notes in the row just begun what it lies on and how far from what it is; no session, no return, no touch.
    pub(crate) fn note(&mut self, on: Option<&str>, distance_to: Option<&str>) {
        self.on.push(on.unwrap_or(""));
        self.distance_to.push(distance_to.unwrap_or(""));
        self.touch.of_row.push(None);
        self.level.push("");
        self.session.push("");
        self.repeat.push("");
    }

    /// Groups of rows that are full returns to one pose (two rows or more).
    pub fn returns(&self) -> Vec<Vec<usize>> {
        let mut groups = vec![Vec::new(); self.repeat.names.len()];
        for (row, name) in self.repeat.of_row.iter().enumerate() {
            if let Some(group) = name.and_then(|name| groups.get_mut(name as usize)) {
                group.push(row);
            }
        }
        groups.retain(|group| group.len() > 1);
        groups
    }
}
