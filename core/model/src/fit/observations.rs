//! What a table says, as equations: one for every number that was measured.

use plumb_kinematics::Motion;
use thiserror::Error;

use crate::file::{Model, SurfaceShape};
use crate::table::Table;

/// What one equation compares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reading {
    /// A coordinate of a target (target, axis), mm.
    Position(u16, u8),
    /// A coordinate of the touching target against the place it touches (place, axis), mm.
    Touch(u32, u8),
    /// The distance of p1 from a surface, mm.
    Surface(u16),
    /// The sensor triggered over a surface: p1 lay on it, or stood above by the sensor's trigger height.
    Trigger(u16),
    /// Tilt about x (0) or y (1) of a level's frame (level, axis), rad.
    Tilt(u16, u8),
    /// The distance of p1 to a point, mm.
    Distance(u16),
}

impl Reading {
    /// Whether the equation is in millimetres (else radians).
    pub fn is_length(self) -> bool {
        !matches!(self, Self::Tilt(..))
    }
}

/// One equation: reading, measured value, declared sigma (1 where none is declared).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Equation {
    /// What is compared.
    pub reading: Reading,
    /// mm or rad; zero for touching and lying on a surface.
    pub measured: f64,
    /// mm or rad, 1 sigma.
    pub sigma: f64,
}

/// A known distance between two touched places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlaceDistance {
    pub(crate) first: usize,
    pub(crate) second: usize,
    pub(crate) length: f64,
    pub(crate) sigma: f64,
}

/// All equations of a table, row by row.
#[derive(Debug, Clone, Default)]
pub struct Observations {
    /// First equation of each row, and one past the last at the end.
    pub(crate) starts: Vec<u32>,
    pub(crate) equations: Vec<Equation>,
    pub(crate) place_distances: Vec<PlaceDistance>,
    /// Names of touched places, as in the table.
    pub(crate) places: Vec<String>,
    /// Whether every equation's sigma was declared.
    pub(crate) declared: bool,
}

/// Why a table and a model do not go together.
#[derive(Debug, Error, PartialEq)]
pub enum ObservationsError {
    /// Different numbers of joints.
    #[error("{table}: the table has {found} joints (q1 ... q{found}) and the arm {arm} has {expected}")]
    JointCount {
        /// The table.
        table: String,
        /// Joints in it.
        found: usize,
        /// The arm.
        arm: String,
        /// Joints it has.
        expected: usize,
    },
    /// A slide given as an angle, or a turning joint as a length.
    #[error(
        "{table}: column `{column}`: joint `{joint}` of the arm {arm} {}: give it as {}",
        if *.slides { "slides" } else { "turns" },
        joint_headers(*.number, *.slides)
    )]
    JointUnit {
        /// The table.
        table: String,
        /// Its column.
        column: String,
        /// The arm.
        arm: String,
        /// The joint.
        joint: String,
        /// Its place among the joints of the table, from 1.
        number: usize,
        /// Whether it slides; else it turns.
        slides: bool,
    },
    /// A target the model does not have.
    #[error(
        "{table}: column `{target}_x` ... measures a target the model does not have; add `{target}` under `targets:`"
    )]
    UnknownTarget {
        /// The table.
        table: String,
        /// The target.
        target: String,
    },
    /// Something named in a row that the model does not have.
    #[error(
        "{table}: line {line}: `{name}` in column `{column}` is not in the model's `surfaces:`{suggestion}"
    )]
    UnknownSurface {
        /// The table.
        table: String,
        /// Line of the file.
        line: u32,
        /// What was written.
        name: String,
        /// `on` or `distance_to`.
        column: &'static str,
        /// What may have been meant.
        suggestion: String,
    },
    /// A row that needs something the model does not say.
    #[error("{table}: {reason}")]
    Incomplete {
        /// The table.
        table: String,
        /// What is missing and where it goes.
        reason: String,
    },
    /// No number was measured at all.
    #[error(
        "{table}: nothing was measured; the table needs p1_x_mm ..., height_mm, on, tilt_x_deg, distance_mm or touch"
    )]
    Nothing {
        /// The table.
        table: String,
    },
}

impl Observations {
    /// Reads the equations off a table.
    ///
    /// # Errors
    /// See [`ObservationsError`].
    pub fn new(model: &Model, table: &Table) -> Result<Self, ObservationsError> {
        if table.joints != model.chain.len() {
            return Err(ObservationsError::JointCount {
                table: table.source.clone(),
                found: table.joints,
                arm: model.arm.clone(),
                expected: model.chain.len(),
            });
        }
        check_joint_units(model, table)?;
        let mut builder = Builder::new(model, table)?;
        let mut observations =
            Self { starts: vec![0], declared: true, places: table.touch.names.clone(), ..Self::default() };
        for row in 0..table.len() {
            builder.row(row, &mut observations)?;
            observations.starts.push(observations.equations.len() as u32);
        }
        if observations.equations.is_empty() {
            return Err(ObservationsError::Nothing { table: table.source.clone() });
        }
        builder.place_distances(&mut observations)?;
        Ok(observations)
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Where a row's equations stand in the list.
    pub fn range(&self, row: usize) -> std::ops::Range<usize> {
        let at = |index: usize| self.starts.get(index).map_or(0, |start| *start as usize);
        at(row)..at(row + 1)
    }

    /// A row's equations.
    pub fn of_row(&self, row: usize) -> &[Equation] {
        self.equations.get(self.range(row)).unwrap_or(&[])
    }

    /// All equations.
    pub fn equations(&self) -> &[Equation] {
        &self.equations
    }
}

struct Builder<'a> {
    model: &'a Model,
    table: &'a Table,
    /// Per position column: target in the model, declared sigma.
    targets: Vec<(u16, Option<f64>)>,
    touch_target: Option<usize>,
}

impl<'a> Builder<'a> {
    fn new(model: &'a Model, table: &'a Table) -> Result<Self, ObservationsError> {
        let mut targets = Vec::new();
        for columns in &table.positions {
            let Some(index) = model.target_position(&columns.target) else {
                return Err(ObservationsError::UnknownTarget {
                    table: table.source.clone(),
                    target: columns.target.clone(),
                });
            };
            targets.push((index as u16, declared_position(model, &columns.target)));
        }
        let touch_target = model.touch.as_ref().map_or(Some("p1"), |touch| Some(touch.target.as_str()));
        let touch_target = touch_target.and_then(|name| model.target_position(name));
        Ok(Self { model, table, targets, touch_target })
    }

    fn incomplete(&self, reason: String) -> ObservationsError {
        ObservationsError::Incomplete { table: self.table.source.clone(), reason }
    }

    fn row(&mut self, row: usize, out: &mut Observations) -> Result<(), ObservationsError> {
        let mut push = |reading: Reading, measured: f64, sigma: Option<f64>| {
            out.declared &= sigma.is_some();
            out.equations.push(Equation { reading, measured, sigma: sigma.unwrap_or(1.0) });
        };
        let std = self.table.std.as_ref().and_then(|std| std.get(row)).copied().unwrap_or([f64::NAN; 3]);
        for (columns, (target, declared)) in self.table.positions.iter().zip(&self.targets) {
            let xyz = columns.xyz.get(row).copied().unwrap_or([f64::NAN; 3]);
            for (axis, (value, std)) in xyz.into_iter().zip(std).enumerate() {
                if value.is_finite() {
                    let sigma =
                        if std.is_finite() { Some(std.max(declared.unwrap_or(0.0))) } else { *declared };
                    push(Reading::Position(*target, axis as u8), value, sigma);
                }
            }
        }
        let noise = &self.model.noise;
        if let Some(place) = self.table.touch.of_row.get(row).copied().flatten() {
            if self.touch_target.is_none() {
                return Err(self.incomplete("column `touch` needs a target p1 in the model".to_owned()));
            }
            for axis in 0..3 {
                push(Reading::Touch(place, axis), 0.0, noise.touch);
            }
        }
        let cell = |column: &Option<Vec<f64>>| {
            column.as_ref().and_then(|column| column.get(row)).copied().unwrap_or(f64::NAN)
        };
        let height = cell(&self.table.height);
        if let Some(surface) = self.surface(row, "on")? {
            match height.is_finite() {
                true => push(Reading::Surface(surface), height, noise.height),
                false => push(Reading::Trigger(surface), 0.0, noise.height),
            }
        } else if height.is_finite() {
            match self
                .model
                .surfaces
                .iter()
                .position(|surface| matches!(surface.shape, SurfaceShape::Plane { .. }))
            {
                Some(surface) => push(Reading::Surface(surface as u16), height, noise.height),
                None => {
                    let reason = "column `height_mm` needs a plane in the model's `surfaces:` and its name in column `on`";
                    return Err(self.incomplete(reason.to_owned()));
                }
            }
        }
        for (axis, tilt) in
            self.table.tilt.as_ref().and_then(|tilt| tilt.get(row)).copied().into_iter().flatten().enumerate()
        {
            if tilt.is_finite() {
                push(Reading::Tilt(self.level(row)?, axis as u8), tilt, noise.tilt);
            }
        }
        let distance = cell(&self.table.distance);
        if distance.is_finite() {
            match self.surface(row, "distance_to")? {
                Some(point) => push(Reading::Distance(point), distance, noise.distance),
                None => {
                    let line = self.table.lines.get(row).copied().unwrap_or(0);
                    return Err(self.incomplete(format!(
                        "line {line}: a distance needs `distance_to`, the name of a point"
                    )));
                }
            }
        }
        Ok(())
    }

    fn surface(&self, row: usize, column: &'static str) -> Result<Option<u16>, ObservationsError> {
        let names = if column == "on" { &self.table.on } else { &self.table.distance_to };
        let Some(name) = names.name(row) else { return Ok(None) };
        if self.model.targets.is_empty() {
            return Err(self.incomplete(format!("column `{column}` needs a target p1 in the model")));
        }
        match self.model.surface_position(name) {
            Some(index) => Ok(Some(index as u16)),
            None => Err(ObservationsError::UnknownSurface {
                table: self.table.source.clone(),
                line: self.table.lines.get(row).copied().unwrap_or(0),
                name: name.to_owned(),
                column,
                suggestion: crate::file::suggestion(
                    name,
                    self.model.surfaces.iter().map(|surface| surface.name.as_str()),
                ),
            }),
        }
    }

    /// Where the level lay in a row.
    fn level(&self, row: usize) -> Result<u16, ObservationsError> {
        let named = self.table.level.name(row);
        if let Some(level) = self.model.level_position(named) {
            return Ok(level as u16);
        }
        let names: Vec<&str> = self.model.levels.iter().filter_map(|level| level.name.as_deref()).collect();
        let line = self.table.lines.get(row).copied().unwrap_or(0);
        Err(self.incomplete(match named {
            _ if self.model.levels.is_empty() => {
                "columns `tilt_*` need `level:` in the model, or `levels:` for several".to_owned()
            }
            Some(name) => format!(
                "line {line}: `{name}` in column `level` is not in the model's `levels:`{}",
                crate::file::suggestion(name, names.iter().copied())
            ),
            None => format!(
                "line {line}: say in column `level` which of the model's levels it is: {}",
                names.join(", ")
            ),
        }))
    }

    fn place_distances(&self, out: &mut Observations) -> Result<(), ObservationsError> {
        let Some(touch) = &self.model.touch else { return Ok(()) };
        for distance in &touch.distances {
            let place = |name: &String| self.table.touch.names.iter().position(|known| known == name);
            let [first, second] = &distance.between;
            if let (Some(first), Some(second)) = (place(first), place(second)) {
                if first == second {
                    return Err(self
                        .incomplete(format!("touch distance between `{}` and itself", distance.between[0])));
                }
                let sigma = self.model.noise.touch.unwrap_or(1.0) * 0.1;
                out.place_distances.push(PlaceDistance { first, second, length: distance.length, sigma });
            }
        }
        Ok(())
    }
}

/// A slide's column in degrees, or a turning joint's in millimetres, would be taken for another place without a word.
fn check_joint_units(model: &Model, table: &Table) -> Result<(), ObservationsError> {
    for (number, (joint, (column, is_length))) in
        model.chain.joints.iter().zip(&table.coordinate_columns).enumerate()
    {
        let slides = joint.motion == Motion::Slides;
        if slides == *is_length {
            continue;
        }
        return Err(ObservationsError::JointUnit {
            table: table.source.clone(),
            column: column.clone(),
            arm: model.arm.clone(),
            joint: joint.name.clone(),
            number: number + 1,
            slides,
        });
    }
    Ok(())
}

/// The headers that a joint's column may have: `number` counts from 1, and a slide's are lengths.
fn joint_headers(number: usize, slides: bool) -> String {
    let units: &[&str] = if slides { &["mm", "m", "in"] } else { &["deg", "rad"] };
    let headers: Vec<String> = units.iter().map(|unit| format!("`q{number}_{unit}`")).collect();
    headers.join(" or ")
}

fn declared_position(model: &Model, target: &str) -> Option<f64> {
    model.noise.positions.iter().find(|(name, _)| name == target).map(|(_, sigma)| *sigma)
}
