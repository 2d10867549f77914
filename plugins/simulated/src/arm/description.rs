//! What the world of an arm is made of, checked and in its own units.

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::Arc;

use super::drive::Drive;
use crate::instrument::Instrument;
use crate::light::Light;
use crate::physics::description::{ArmDescription, Weight};
use crate::physics::imperfection::Imperfection;
use crate::physics::random::Random;
use crate::physics::rigid::{Rigid, Vector};

/// What hangs on the flange: a PUMA's cage with camera and projector, another arm's tool.
#[derive(Debug, Clone, PartialEq)]
pub struct Tool {
    /// kg.
    pub mass_kg: f64,
    /// Where its weight acts, mm in the flange's frame.
    pub centre: Vector,
    /// How its back lies on the flange, rad about the flange's x, y and z: ideally not turned at all.
    pub lean: [f64; 3],
    /// The point whose position is asked for in the end, mm in the flange's frame.
    pub tip: Vector,
}

/// The table the arm is on and over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tabletop {
    /// Of its top under the origin of the world, mm.
    pub height: f64,
    /// Unit vector upward from it.
    pub normal: Vector,
}

/// A spirit level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpiritLevel {
    /// Scatter and divisions, rad.
    pub instrument: Instrument,
    /// What it shows on a level surface, rad: the error of its own zero.
    pub zero: f64,
    /// How far from level it still shows, rad: a bubble is soon at its end, an inclinometer goes on.
    pub reach: f64,
}

/// Which way the arrow of a level points that lies on a surface of the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LevelDirection {
    /// Along the axis of one joint, as far as it is square to another's.
    AlongAxis {
        /// The joint along whose axis it points.
        along: usize,
        /// The joint to whose axis it is square.
        square_to: usize,
    },
    /// Square to the axes of two joints.
    SquareToAxes(usize, usize),
    /// A direction of the tool on the flange.
    OnTool(Vector),
    /// Fixed to the link after the joint that carries it; given as it points where every joint is at its zero.
    AtZero(Vector),
}

/// A surface of the arm on which a spirit level can lie.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelSurface {
    /// As procedures name it.
    pub name: Cow<'static, str>,
    /// Index of the joint that carries it.
    pub carried_by: usize,
    /// Which way the level's arrow points there.
    pub direction: LevelDirection,
}

/// An arm that can be bought or built: what is known of it on paper.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmOnPaper {
    /// As cell files name it.
    pub name: String,
    /// As people name it.
    pub model: String,
    /// Joints, links and weights.
    pub shape: ArmDescription,
    /// What its controller and its motors are, joint by joint.
    pub drive: Drive,
    /// Where a spirit level can lie.
    pub level_surfaces: Vec<LevelSurface>,
    /// Index of the joint in whose axis the wrist is taken to lie; the flange where there is none.
    pub wrist: Option<usize>,
    /// The most that may hang on the flange beside the tool, kg.
    pub most_hung_kg: f64,
}

/// The camera, the board and how well the one is seen by the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardCamera {
    /// The camera on the flange; it looks along its z.
    pub flange_from_camera: Rigid,
    /// The board in the world.
    pub world_from_board: Rigid,
    /// Standard deviation of each coordinate of the board's origin, mm.
    pub error: f64,
    /// Standard deviation of its turn about each of its axes, rad.
    pub turn_error: f64,
}

/// What a laser line sensor can look at, world, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sight {
    /// A flat face.
    Plane {
        /// A point of it.
        point: Vector,
        /// Unit length.
        normal: Vector,
    },
    /// A ball.
    Ball {
        /// Its centre.
        centre: Vector,
        /// mm.
        radius: f64,
    },
    /// A straight edge, of which the sensor's own program gives the one point where the laser crosses it.
    Edge {
        /// A point of it.
        point: Vector,
        /// Unit length.
        direction: Vector,
    },
}

/// A laser line sensor on the hand, and what lies about.
#[derive(Debug, Clone, PartialEq)]
pub struct LineSensor {
    /// On the flange: x along its line, z away from it.
    pub flange_from_sensor: Rigid,
    /// Half the length of its line, mm.
    pub half_width: f64,
    /// Nearest and farthest that it sees along its z, mm.
    pub reach: [f64; 2],
    /// Standard deviation of each coordinate of a point, mm.
    pub error: f64,
    /// By their names.
    pub sights: Vec<(String, Sight)>,
}

/// A measuring probe at the tip of the tool, and what it can feel.
#[derive(Debug, Clone, PartialEq)]
pub struct TouchProbe {
    /// Radius of its ball, mm.
    pub ball_radius: f64,
    /// How far it gives way, and how near it has to be to be put on, mm.
    pub reach: f64,
    /// How well it is read.
    pub instrument: Instrument,
    /// By their names.
    pub sights: Vec<(String, Sight)>,
}

/// A whole world.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmWorldDescription {
    /// What a user calls it.
    pub title: String,
    /// From which everything that is left to chance is drawn.
    pub seed: u64,
    /// On paper.
    pub paper: ArmOnPaper,
    /// Where the controller believes it to be at the beginning, rad or mm.
    pub start: Vec<f64>,
    /// By how much each joint truly is beyond what is believed, rad or mm.
    pub zero_error: Vec<f64>,
    /// By how much more, either way, drawn from the seed, rad or mm.
    pub zero_error_within: Vec<f64>,
    /// What else is wrong with it.
    pub imperfections: Vec<Imperfection>,
    /// What it carries.
    pub tool: Tool,
    /// What it is on.
    pub table: Tabletop,
    /// On hand.
    pub level: SpiritLevel,
    /// On hand; mm.
    pub ruler: Instrument,
    /// What the rig on the hand sees, where one is carried.
    pub light: Option<Arc<Light>>,
    /// On hand; mm, for each coordinate.
    pub tracker: Instrument,
    /// A camera on the hand that sees a board, where one is carried.
    pub board_camera: Option<BoardCamera>,
    /// A laser line sensor on the hand, where one is carried.
    pub line_sensor: Option<LineSensor>,
    /// A measuring probe at the tip of the tool, where there is one.
    pub touch_probe: Option<TouchProbe>,
    /// Where the controller keeps its calibration from one day to the next, if it does.
    pub calibration: Option<PathBuf>,
    /// The text of the file, if it came under a seal: the truth is hidden until somebody breaks it.
    pub sealed_text: Option<String>,
}

impl ArmWorldDescription {
    /// The error of each joint's zero in this world, rad or mm.
    pub fn drawn_zero_error(&self) -> Vec<f64> {
        // The name of the stream of random numbers is part of every shipped seed.
        let mut random = Random::new(self.seed, "zero errors of a PUMA");
        let drawn = self.zero_error.iter().zip(&self.zero_error_within);
        drawn.map(|(error, within)| error + within * random.between(-1.0, 1.0)).collect()
    }

    /// The arm on paper, with the tool's weight where it sits; whatever else is carried hangs on the middle of the flange.
    pub(super) fn arm(&self) -> ArmDescription {
        let mut arm = self.paper.shape.clone();
        if let Some(last) = arm.joints.len().checked_sub(1) {
            // A weight is placed in the frame of its joint's row, the tool in the flange's.
            let centre = arm.flange.apply(self.tool.centre);
            arm.weights.push(Weight { after: last, mass: self.tool.mass_kg, centre });
        }
        arm.target = Vector::ZERO;
        arm
    }

    /// The arm on paper with its tool, the tool's tip as its target.
    pub fn with_tip(&self) -> ArmDescription {
        let mut arm = self.arm();
        arm.target = self.tool.tip;
        arm
    }

    /// Index of the joint of this name.
    ///
    /// # Errors
    /// A sentence with the names there are.
    pub fn joint_named(&self, name: &str) -> Result<usize, String> {
        self.paper.shape.joint_index(name).ok_or_else(|| {
            let names: Vec<&str> = self.paper.shape.joints.iter().map(|joint| joint.name.as_str()).collect();
            format!("the arm has no joint `{name}`; it has {}", names.join(", "))
        })
    }
}
