//! World files with an arm on a table: YAML a person writes, read as it was typed and then checked. Every key carries its unit.
//!
//! The arm is a PUMA 560 (`arm: {puma560: ...}`), or one that an arm file describes (`arm: {described: {by: FILE, ...}}`, `arm_file.rs`).

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use plumb_document::{Node, Problems, Span, Spanned, typed};
use serde::Deserialize;

use super::description::{ArmOnPaper, ArmWorldDescription, BoardCamera, SpiritLevel, Tabletop, Tool};
use super::puma560;
use crate::instrument::Instrument;
use crate::light::file::RawLight;
use crate::physics::imperfection::{Imperfection, Mechanism};
use crate::physics::machine::{Conditions, Machine};
use crate::physics::rigid::{Rotation, Vector};
use crate::world::file::typed::Typed;
use crate::world::file::{WorldFileError, no_world};

pub(crate) mod arm_file;
mod checker;
mod imperfections;
mod line_sensor;
mod named;
mod placed;
mod urdf;

use checker::{Checker, Number};
use imperfections::RawImperfection;
pub use imperfections::written as imperfection_yaml;
use line_sensor::{RawLineSensor, RawTouchProbe};
use named::JointNumbers;
use placed::RawPlaced;

/// No joint starts further from its zero than this, deg or mm: beyond the stops of any arm.
const FAR: f64 = 5000.0;

/// Where the bubble of a spirit level is at its end, deg.
const END_OF_THE_BUBBLE_DEG: f64 = 10.0;

/// No zero is wrong by more, deg or mm.
const WORST_ZERO: f64 = 20.0;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawWorld {
    world: Spanned<String>,
    #[serde(default)]
    seed: u64,
    calibration: Option<String>,
    arm: RawArm,
    /// What a PUMA's tool is called.
    cage: Option<Spanned<RawTool>>,
    tool: Option<Spanned<RawTool>>,
    #[serde(default)]
    table: RawTable,
    #[serde(default)]
    instruments: RawInstruments,
    light: Option<RawLight>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum RawArm {
    Puma560(Box<RawPuma>),
    Described(Box<RawDescribed>),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPuma {
    resolution: RawResolution,
    start: Option<JointNumbers>,
    #[serde(default)]
    zero_error: JointNumbers,
    #[serde(default)]
    zero_error_within: JointNumbers,
    #[serde(default)]
    base: RawBase,
    #[serde(default)]
    imperfections: Vec<Spanned<RawImperfection>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawDescribed {
    by: Spanned<String>,
    start: Option<JointNumbers>,
    #[serde(default)]
    zero_error: JointNumbers,
    #[serde(default)]
    zero_error_within: JointNumbers,
    #[serde(default)]
    base: RawBase,
    #[serde(default)]
    imperfections: Vec<Spanned<RawImperfection>>,
}

/// What is not as on paper, whichever arm it is.
struct RawFaults {
    start: Option<JointNumbers>,
    zero_error: JointNumbers,
    zero_error_within: JointNumbers,
    base: RawBase,
    imperfections: Vec<Spanned<RawImperfection>>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum RawResolution {
    Continuous,
    Encoder,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBase {
    tilt_x_deg: Option<Number>,
    tilt_y_deg: Option<Number>,
    x_mm: Option<Number>,
    y_mm: Option<Number>,
    z_mm: Option<Number>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTool {
    mass_kg: Option<Number>,
    centre_mm: Option<Spanned<[f64; 3]>>,
    lean_x_deg: Option<Number>,
    lean_y_deg: Option<Number>,
    turn_deg: Option<Number>,
    tip_mm: Option<Spanned<[f64; 3]>>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTable {
    height_mm: Option<Number>,
    tilt_x_deg: Option<Number>,
    tilt_y_deg: Option<Number>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawInstruments {
    #[serde(default)]
    level: RawLevel,
    #[serde(default)]
    ruler: RawRuler,
    #[serde(default)]
    tracker: RawRuler,
    board_camera: Option<RawBoardCamera>,
    line_sensor: Option<RawLineSensor>,
    touch_probe: Option<RawTouchProbe>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBoardCamera {
    camera: RawPlaced,
    board: RawPlaced,
    error_mm: Option<Number>,
    error_deg: Option<Number>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLevel {
    error_deg: Option<Number>,
    division_deg: Option<Number>,
    zero_deg: Option<Number>,
    reach_deg: Option<Number>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawRuler {
    error_mm: Option<Number>,
    division_mm: Option<Number>,
}

/// What a world file may leave out, for one kind of arm.
struct Defaults {
    tool: Tool,
    /// The heaviest tool that is believed, kg.
    most_tool_kg: f64,
    table_height: f64,
}

/// A PUMA's cage, and the table on which it is as Agin (1985) has it.
const PUMA: Defaults = Defaults {
    tool: Tool {
        mass_kg: 1.05,
        centre: Vector::new(0.0, 0.0, 50.8),
        lean: [0.0; 3],
        tip: Vector::new(40.0, 0.0, 120.0),
    },
    most_tool_kg: 5.0,
    table_height: -671.8,
};

/// Nothing on the flange, and a table at the height of the base.
const DESCRIBED: Defaults = Defaults {
    tool: Tool { mass_kg: 0.0, centre: Vector::ZERO, lean: [0.0; 3], tip: Vector::ZERO },
    most_tool_kg: 50.0,
    table_height: 0.0,
};

/// Checks an open world file, whose text is `text` and its tree `root`.
pub(crate) fn read(
    file: &Path,
    text: &str,
    root: &Node,
    problems: Problems,
) -> Result<ArmWorldDescription, WorldFileError> {
    let described = of_tree(Typed { file, problems: &problems }, root);
    problems.into_result(file, text)?;
    described.unwrap_or_else(|| Err(no_world(file)))
}

/// The JSON Schema of a world with another arm than a TeachMover.
pub(crate) fn schema() -> serde_json::Value {
    plumb_document::schema_of::<RawWorld>()
}

/// What comes of a part: nothing after a error about the world file, or the error of another file that it names.
type Read<T> = Option<Result<T, WorldFileError>>;

/// A world out of its tree.
fn of_tree(checked: Typed<'_>, root: &Node) -> Read<ArmWorldDescription> {
    let raw: RawWorld = typed(root, "a world", checked.problems)?;
    let (paper, faults, defaults) = match arm(checked, &raw.world, raw.arm)? {
        Ok(parts) => parts,
        Err(error) => return Some(Err(error)),
    };
    let checker = Checker { typed: checked, paper: &paper };
    let mut imperfections = checker.base(&faults.base);
    imperfections
        .extend(faults.imperfections.iter().filter_map(|one| checker.imperfection(&one.value, one.span)));
    let described = ArmWorldDescription {
        title: raw.world.value,
        seed: raw.seed,
        start: match &faults.start {
            Some(start) => checker.joints(start, -FAR..=FAR),
            None => paper.drive.joints.iter().map(|joint| joint.home).collect(),
        },
        zero_error: checker.joints(&faults.zero_error, -WORST_ZERO..=WORST_ZERO),
        zero_error_within: checker.joints(&faults.zero_error_within, 0.0..=WORST_ZERO),
        imperfections,
        tool: checker.tool(raw.tool.as_ref().or(raw.cage.as_ref()), &defaults),
        table: checker.table(&raw.table, defaults.table_height),
        level: checker.level(&raw.instruments.level),
        ruler: checker.ruler(&raw.instruments.ruler),
        light: raw.light.as_ref().and_then(|light| light.check(raw.seed, checked.problems)).map(Arc::new),
        tracker: checker.ruler(&raw.instruments.tracker),
        board_camera: raw.instruments.board_camera.as_ref().map(|camera| checker.board_camera(camera)),
        line_sensor: raw.instruments.line_sensor.as_ref().map(|sensor| checker.line_sensor(sensor)),
        touch_probe: raw.instruments.touch_probe.as_ref().map(|probe| checker.touch_probe(probe)),
        calibration: raw.calibration.map(|name| checked.file.with_file_name(name)),
        sealed_text: None,
        paper: paper.clone(),
    };
    checker.require_equilibrium(&described, raw.world.span);
    Some(Ok(described))
}

/// The arm on paper, what is wrong with this one, and what may be left out.
fn arm(checked: Typed<'_>, title: &Spanned<String>, raw: RawArm) -> Read<(ArmOnPaper, RawFaults, Defaults)> {
    match raw {
        RawArm::Puma560(raw) => {
            let paper = puma560::on_paper().map(|paper| paper.map_err(|error| error.to_string()));
            let mut paper = paper
                .unwrap_or_else(|| Err("the program does not know the PUMA 560".to_owned()))
                .map_err(|problem| checked.wrong(title.span, &problem))
                .ok()?;
            paper.drive.whole_counts = matches!(raw.resolution, RawResolution::Encoder);
            let RawPuma { start, zero_error, zero_error_within, base, imperfections, .. } = *raw;
            Some(Ok((paper, RawFaults { start, zero_error, zero_error_within, base, imperfections }, PUMA)))
        }
        RawArm::Described(raw) => {
            let paper = match arm_file::read(checked, &raw.by)? {
                Ok(paper) => paper,
                Err(error) => return Some(Err(error)),
            };
            let RawDescribed { start, zero_error, zero_error_within, base, imperfections, .. } = *raw;
            let faults = RawFaults { start, zero_error, zero_error_within, base, imperfections };
            Some(Ok((paper, faults, DESCRIBED)))
        }
    }
}

impl Checker<'_> {
    /// The arm must be at rest with its load where it begins (a PUMA stretched out): what is too soft there is a mistake of the file. Not asked while
    /// other numbers are wrong.
    fn require_equilibrium(&self, world: &ArmWorldDescription, span: Span) {
        if !self.typed.problems.is_empty() {
            return;
        }
        let mut machine = Machine::new(&world.arm(), &world.imperfections);
        let stretched = [0.0, 0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0];
        let pose = if world.paper.name == puma560::NAME { &stretched[..] } else { &world.start };
        machine.go(pose, 0.0);
        let conditions = Conditions { time_s: 0.0, temperature_c: 20.0, payload_kg: 0.0 };
        if let Err(error) = machine.equilibrium(&conditions) {
            self.typed.wrong(span, &error.to_string());
        }
    }

    /// One value for each joint, rad or mm: 0 where the file names none.
    fn joints(&self, raw: &JointNumbers, range: RangeInclusive<f64>) -> Vec<f64> {
        raw.values(self.typed, &self.paper.drive.joints, range)
    }

    fn base(&self, raw: &RawBase) -> Vec<Imperfection> {
        let tilt = |key, value, axis: [f64; 3]| {
            let size = self.typed.or(key, value, 0.0, -5.0..=5.0, "deg").to_radians();
            Imperfection { mechanism: Mechanism::BaseTilt { axis }, size }
        };
        let shift = |key, value, direction: [f64; 3]| {
            let size = self.typed.or(key, value, 0.0, -500.0..=500.0, "mm");
            Imperfection { mechanism: Mechanism::BasePosition { direction }, size }
        };
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let moved = [
            tilt("tilt_x_deg", &raw.tilt_x_deg, x),
            tilt("tilt_y_deg", &raw.tilt_y_deg, y),
            shift("x_mm", &raw.x_mm, x),
            shift("y_mm", &raw.y_mm, y),
            shift("z_mm", &raw.z_mm, z),
        ];
        moved.into_iter().filter(|one| one.size != 0.0).collect()
    }

    fn tool(&self, raw: Option<&Spanned<RawTool>>, defaults: &Defaults) -> Tool {
        let default = &defaults.tool;
        let Some(Spanned { value: raw, .. }) = raw else { return default.clone() };
        let masses = 0.0..=defaults.most_tool_kg;
        let lean = |key, value| self.typed.or(key, value, 0.0, -10.0..=10.0, "deg").to_radians();
        Tool {
            mass_kg: self.typed.or("mass_kg", &raw.mass_kg, default.mass_kg, masses, "kg"),
            centre: self.point("centre_mm", raw.centre_mm.as_ref(), default.centre),
            lean: [
                lean("lean_x_deg", &raw.lean_x_deg),
                lean("lean_y_deg", &raw.lean_y_deg),
                lean("turn_deg", &raw.turn_deg),
            ],
            tip: self.point("tip_mm", raw.tip_mm.as_ref(), default.tip),
        }
    }

    /// A point of the tool, mm in the flange's frame.
    fn point(&self, key: &str, raw: Option<&Spanned<[f64; 3]>>, default: Vector) -> Vector {
        match raw {
            Some(point) if point.value.iter().any(|part| part.abs() > 1000.0) => {
                let problem =
                    format!("`{key}` is too far away; three numbers, each within 1000 mm of the flange");
                self.typed.wrong(point.span, &problem);
                default
            }
            Some(point) => Vector::from(point.value),
            None => default,
        }
    }

    fn table(&self, raw: &RawTable, height: f64) -> Tabletop {
        let tilt = |key, value| self.typed.or(key, value, 0.0, -5.0..=5.0, "deg").to_radians();
        let turned = Rotation::about(Vector::X, tilt("tilt_x_deg", &raw.tilt_x_deg))
            * Rotation::about(Vector::Y, tilt("tilt_y_deg", &raw.tilt_y_deg));
        Tabletop {
            height: self.typed.or("height_mm", &raw.height_mm, height, -2000.0..=0.0, "mm"),
            normal: turned.z,
        }
    }

    fn level(&self, raw: &RawLevel) -> SpiritLevel {
        let degrees = |key, value, most: f64| self.typed.or(key, value, 0.0, 0.0..=most, "deg").to_radians();
        let instrument = Instrument {
            error: degrees("error_deg", &raw.error_deg, 5.0),
            division: degrees("division_deg", &raw.division_deg, 5.0),
        };
        let zero = self.typed.or("zero_deg", &raw.zero_deg, 0.0, -5.0..=5.0, "deg").to_radians();
        let reach = self.typed.or("reach_deg", &raw.reach_deg, END_OF_THE_BUBBLE_DEG, 0.1..=89.0, "deg");
        SpiritLevel { instrument, zero, reach: reach.to_radians() }
    }

    fn board_camera(&self, raw: &RawBoardCamera) -> BoardCamera {
        BoardCamera {
            flange_from_camera: self.placed("camera", &raw.camera, 1000.0),
            world_from_board: self.placed("board", &raw.board, 10_000.0),
            error: self.typed.or("error_mm", &raw.error_mm, 0.0, 0.0..=50.0, "mm"),
            turn_error: self.typed.or("error_deg", &raw.error_deg, 0.0, 0.0..=5.0, "deg").to_radians(),
        }
    }

    fn ruler(&self, raw: &RawRuler) -> Instrument {
        Instrument {
            error: self.typed.or("error_mm", &raw.error_mm, 0.0, 0.0..=50.0, "mm"),
            division: self.typed.or("division_mm", &raw.division_mm, 0.0, 0.0..=50.0, "mm"),
        }
    }
}
