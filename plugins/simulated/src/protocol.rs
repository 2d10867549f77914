//! What is said over the world's socket: a JSON value a line, both ways.
//!
//! A client begins with [`Hello`] and is answered with [`Welcome`], or with a refusal that names both versions. From then on it
//! sends [`Call`]s. Each call is answered by any number of lines that report what happens meanwhile ([`Response::Joints`],
//! [`Response::Change`]) and then by exactly one that ends it; every line bears the call's number. `stop` may be sent while a motion
//! is under way, on the same connection or another. A client that goes away stops the motion it began.

use serde::{Deserialize, Serialize};

use crate::joint_values::JointValues;
use crate::world::{ControllerReading, Joint, LineChange, Truth};

/// The version of this protocol; both sides must speak the same.
pub const PROTOCOL: u32 = 1;

/// The longest line either side accepts, bytes.
pub const LONGEST_LINE: usize = 64 * 1024;

/// Pixels of a picture that go in a line.
pub const PIXELS_A_LINE: usize = 30_000;

/// The client's first line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hello {
    /// [`PROTOCOL`], as the client speaks it.
    pub protocol: u32,
    /// Who calls, for messages.
    pub client: String,
}

/// The world's answer to [`Hello`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Welcome {
    /// [`PROTOCOL`], as the world speaks it.
    pub protocol: u32,
    /// The world's title.
    pub world: String,
    /// The world's process.
    pub pid: u32,
    /// Whether the world's time is the wall's.
    pub pace: Pace,
    /// Which arm is in it, as cell files name it.
    pub arm: String,
    /// The same, as people name it.
    pub model: String,
    /// Input lines of its controller.
    pub input_lines: u32,
    /// Output lines of its controller.
    pub output_lines: u32,
    /// How long its brakes take from full speed, ms; 0 for an arm that has none.
    #[serde(default)]
    pub braking_ms: u32,
    /// Its joints, in the order of every list of joint values.
    pub joints: Vec<JointFacts>,
}

/// What a driver of the arm may know of a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointFacts {
    /// Its name.
    pub name: String,
    /// Unit of its values.
    pub unit: JointUnit,
    /// Where its travel begins, rad or mm.
    pub lower: f64,
    /// Where it ends, rad or mm.
    pub upper: f64,
    /// The smallest step, rad or mm; 0 for a continuous drive.
    pub resolution: f64,
    /// The greatest speed, rad/s or mm/s.
    pub top_speed: f64,
    /// Where the controller believed it to be when the world began, rad or mm.
    pub home: f64,
}

/// Unit of a joint's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JointUnit {
    /// It turns.
    Rad,
    /// It slides.
    Mm,
}

/// How the world's time runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pace {
    /// As fast as the wall's.
    Real,
    /// Only while something moves, and then at once.
    Fast,
}

/// One call of a client.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Call {
    /// Chosen by the client; its answers bear it.
    pub id: u64,
    /// What is wanted.
    #[serde(rename = "do")]
    pub command: WorldCommand,
}

/// A value for each joint of the arm, rad or mm; null leaves a joint out.
pub type SomeJoints = Vec<Option<f64>>;

/// What a client may want.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum WorldCommand {
    /// What the controller knows: ends with [`Response::Reading`].
    Read {},
    /// Moves joints; ends with [`Response::Reading`] when the arm is at rest.
    Move {
        /// Where to, or by how much.
        joints: SomeJoints,
        /// Whether `joints` is added to where the joints are.
        #[serde(default)]
        relative: bool,
        /// Fraction of the greatest speed, above 0 and at most 1.
        #[serde(default = "full_speed")]
        speed: f64,
    },
    /// A cycle of a controller that leads its servos along a way of its own: from where they are the joints go evenly to these, in place of where they
    /// were to go. Ends at once with [`Response::Reading`]; the next cycle may come before this one is over.
    Follow {
        /// Where the servos shall be at the end of the cycle, as the controller counts, rad or mm.
        joints: JointValues,
        /// How long the cycle lasts, ms.
        ms: f64,
    },
    /// Stops whatever moves; ends with [`Response::Reading`].
    Stop {},
    /// Sets the output lines; ends with [`Response::Reading`].
    Outputs {
        /// A bit for each line.
        bits: u64,
    },
    /// Has the controller believe that the joints are so; ends with [`Response::Reading`].
    SetZero {
        /// What the joints shall read.
        joints: JointValues,
    },
    /// Hands the arm to its teach pendant or takes it back; ends with [`Response::Reading`].
    Pendant {
        /// Whether the pendant drives.
        on: bool,
    },
    /// The operator presses a key of the pendant. STOP stops the arm and gives it back; ends with [`Response::Reading`].
    Key {
        /// Which key.
        key: PendantKey,
    },
    /// The operator drives the arm with the pendant until its true attitudes look so, going again where play left it short; ends
    /// with [`Response::Reading`].
    Place {
        /// True attitudes.
        joints: SomeJoints,
    },
    /// What is so, whether or not anybody knows it: ends with [`Response::Truth`].
    Look {},
    /// Changes how time runs; ends with [`Response::Reading`].
    Pace {
        /// How time shall run.
        pace: Pace,
    },
    /// Lets time pass; ends with [`Response::Reading`].
    Wait {
        /// How much of the world's time, ms.
        ms: u64,
    },
    /// Drives the motors themselves, as a controller does; ends with [`Response::Reading`] when the arm is at rest.
    Step {
        /// Half-steps of each motor: base, shoulder, elbow, right wrist, left wrist, gripper.
        half_steps: JointValues,
        /// Speed of the motor with the most, half-steps/s.
        rate: f64,
    },
    /// The operator turns the sensor's trim resistor; ends with [`Response::Reading`].
    Trim {
        /// By how much the level at which it fires changes, as a fraction of the most light there can be.
        by: f64,
    },
    /// The operator puts something between the fingers, or takes it away; ends with [`Response::Reading`].
    Hold {
        /// Its width, mm; 0 for nothing.
        width_mm: f64,
    },
    /// The operator turns the trim resistor until the sensor just fires at what it sees; ends with [`Response::Reading`].
    TrimToFire {},
    /// The operator lowers the hand by the shoulder onto a gauge block under the sensor and takes the block away; ends with
    /// [`Response::Reading`].
    RestOnGauge {
        /// The block's height, mm.
        height_mm: f64,
    },
    /// The operator brings the sensor's face over a point with the pendant, as well as he sees; ends with [`Response::Reading`].
    PlaceHand {
        /// Away from the waist's axis, along its zero, mm.
        x_mm: f64,
        /// Across, mm.
        y_mm: f64,
        /// Height over the table, mm; it is felt or gauged, not seen.
        z_mm: f64,
    },
    /// The operator measures; ends with [`Response::Measured`].
    Measure {
        /// With what.
        with: Instrument,
        /// Where the instrument is put; left out where there is one location only.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        at: Option<String>,
        /// Whether it is turned end for end.
        #[serde(default)]
        turned: bool,
        /// Which coordinate a tracker shows.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<Axis>,
    },
    /// The operator hangs a weight on the flange, or puts it into the fingers, in place of what was there; ends with [`Response::Reading`].
    Hang {
        /// kg; 0 takes it away.
        mass_kg: f64,
    },
    /// A measuring arm that is on the target, a borrowed one, reports where a point ahead of the sensor's face truly is, in the target's own
    /// frame; ends with [`Response::Measured`].
    ReadPoint {
        /// Which coordinate: 0 x, 1 y, 2 z.
        axis: u8,
        /// How far ahead of the sensor's face, along its line of sight, mm.
        ahead_mm: f64,
    },
    /// A laser line sensor on the hand shows one coordinate of one point of the profile of a thing; x of the first point takes a new profile, the rest is read from
    /// the last. Ends with [`Response::Measured`].
    ReadProfile {
        /// Of what.
        of: String,
        /// Which point, from 1.
        point: u32,
        /// Which coordinate: x along the sensor's line, z away from it.
        axis: Axis,
    },
    /// The operator drives one joint with the pendant until the bubble of a spirit level is in the middle; ends with
    /// [`Response::Reading`].
    Level {
        /// Which joint.
        joint: String,
        /// Where the level lies.
        at: String,
        /// Whether it is turned end for end.
        #[serde(default)]
        turned: bool,
        /// Whether the joint's reading has to increase (or decrease) as it arrives; left out, as it comes.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rising: Option<bool>,
    },
    /// Switches the light stripe's laser, puts its filter before the lens or takes it away; ends with [`Response::Reading`].
    Shine {
        /// Whether the laser shines; left out, as it is.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        laser: Option<bool>,
        /// Whether the filter is before the lens; left out, as it is.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        filter: Option<bool>,
    },
    /// Has the camera take a picture every so many milliseconds by itself while the arm moves, or only when it is asked; ends with [`Response::Reading`].
    Shutter {
        /// From picture to picture, ms; left out, it takes them when it is asked. What waits is thrown away.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        every_ms: Option<f64>,
    },
    /// Takes a picture with the camera on the hand, or gives the first of those it took by itself; ends with [`Response::Exposed`], after its
    /// [`Response::Pixels`].
    Expose {},
    /// Breaks the seal of a sealed world, so that `look` is answered; ends with [`Response::Revealed`].
    Reveal {},
    /// Lets the world begin again as its file describes it, what is left to chance drawn from this seed; its clock runs on. Ends with
    /// [`Response::Reading`].
    Again {
        /// In place of the file's.
        seed: u64,
    },
    /// Ends the world; ends with [`Response::Done`].
    Shutdown {},
}

fn full_speed() -> f64 {
    1.0
}

/// What the operator measures with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Instrument {
    /// A spirit level. On a TeachMover's hand: its tilt from hanging straight down, outward positive, deg. On a surface of a PUMA: by how
    /// much the end its arrow points to is too high, deg.
    Level,
    /// A ruler, from the table up to the sensor's face; of a PUMA, to the middle of the wrist flange or to the tip of the cage, mm.
    Ruler,
    /// A laser tracker, one coordinate of a reflector at a location on the arm, in a frame that is upright on the arm's foot, mm.
    Tracker,
    /// A camera on the hand, one coordinate of where it sees a board, mm; x takes a new picture, the rest is read from the last.
    Board,
    /// A measuring probe at the tip of the tool: by how much its ball is off the thing named in `at`, mm.
    Probe,
    /// The same camera, one number of how it sees the board turned (a rotation vector), rad.
    BoardTurn,
}

/// A coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Forward.
    X,
    /// To the left.
    Y,
    /// Up.
    Z,
}

/// The keys of the teach pendant, numbered as the controller reports them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[expect(missing_docs, reason = "the names are those printed on the keys")]
pub enum PendantKey {
    Train = 1,
    Pause = 2,
    Grip = 3,
    Out = 4,
    Free = 5,
    Move = 6,
    Stop = 7,
    Step = 8,
    Point = 9,
    Jump = 10,
    Clear = 11,
    Zero = 12,
    Speed = 13,
    Run = 14,
}

/// One line of the world's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The call it belongs to; 0 for a line that could not be read as a call.
    pub id: u64,
    /// What it says.
    pub response: Response,
}

/// What the world says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Response {
    /// On the way: where the joints are.
    Joints(Reading),
    /// On the way: input lines changed.
    Change(Change),
    /// On the way: the next pixels of a picture, two hexadecimal digits each.
    Pixels {
        /// At most [`PIXELS_A_LINE`] of them.
        hex: String,
    },
    /// The end of `expose`: all pixels have come.
    Exposed {
        /// The middle of the exposure, as the camera says, world time, ns.
        time_ns: u64,
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// How many pictures the camera took by itself still wait.
        #[serde(default)]
        waiting: u32,
    },
    /// The end of a call that succeeded: what the controller knows.
    Reading(Reading),
    /// The end of `look`.
    Truth(Box<TruthReport>),
    /// The end of `measure`.
    Measured {
        /// What the instrument reads.
        value: f64,
        /// `deg` or `mm`.
        unit: String,
    },
    /// The end of `reveal`.
    Revealed {
        /// The world file as it was before it was sealed; empty for a world that never was.
        text: String,
    },
    /// The end of a call after which nothing remains to be said.
    Done {},
    /// The end of a call that failed.
    Refused {
        /// Why, and what would be right.
        why: String,
    },
}

/// What the controller knows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// The world's time, ns.
    pub time_ns: u64,
    /// Whether the arm moves.
    pub moving: bool,
    /// Whether the motion asked for was cut short.
    pub stopped: bool,
    /// Joint values, rad or mm.
    pub joints: JointValues,
    /// What each motor's counter reads: a TeachMover's half-steps issued (base, shoulder, elbow, right wrist, left wrist, gripper), other arms'
    /// encoder counts; empty where nobody counts.
    pub half_steps: JointValues,
    /// Levels of the input lines.
    pub inputs: u64,
    /// Levels of the output lines.
    pub outputs: u64,
    /// Whether the gripper's switch is closed.
    pub grip: bool,
    /// Whether the pendant drives.
    pub pendant: bool,
    /// The key pressed last, 0 for none.
    pub key: u32,
}

impl Reading {
    /// From the world's own; whether the pendant drives, its key, and whether a motion was cut short are not the world's to know.
    pub fn of(reading: &ControllerReading, outputs: u64) -> Reading {
        Reading {
            time_ns: reading.time_ns,
            moving: reading.moving,
            stopped: false,
            joints: reading.joints.0.into(),
            half_steps: reading.half_steps.0.into(),
            inputs: reading.inputs,
            outputs,
            grip: reading.grip,
            pendant: false,
            key: 0,
        }
    }
}

/// A change of the input lines.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Counts the changes from 1.
    pub number: u64,
    /// When, world time, ns.
    pub time_ns: u64,
    /// Levels after it.
    pub levels: u64,
    /// The bits that changed.
    pub changed: u64,
    /// The joints at that moment, rad or mm.
    pub joints: JointValues,
    /// They are known to within this, rad or mm.
    pub half_width: JointValues,
}

impl From<LineChange> for Change {
    fn from(change: LineChange) -> Change {
        Change {
            number: change.number,
            time_ns: change.time_ns,
            levels: change.levels,
            changed: change.changed,
            joints: change.joints.0.into(),
            half_width: change.half_width.0.into(),
        }
    }
}

/// What is so.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TruthReport {
    /// The world's time, ns.
    pub time_ns: u64,
    /// Joint values as the controller counts them, rad or mm.
    #[serde(rename = "reckoned")]
    pub counted: JointValues,
    /// True attitudes, rad or mm.
    pub attitudes: JointValues,
    /// Where the wrist is: x, y, z, mm.
    pub wrist_mm: [f64; 3],
    /// Where the sensor's face is: x, y, z, mm; z is its height over the table.
    pub sensor_mm: [f64; 3],
    /// The sensor's signal: mm into the region where an ideal one fires, or the light that comes back.
    pub signal: f64,
    /// Whether the sensor fires.
    pub fired: bool,
    /// Whether the arm rests on something it cannot enter.
    pub touching: bool,
    /// Half-steps issued that the motors did not make.
    pub lost_half_steps: JointValues,
}

impl From<Truth> for TruthReport {
    fn from(truth: Truth) -> TruthReport {
        let coordinates = |point: crate::physics::rigid::Vector| [point.x, point.y, point.z];
        TruthReport {
            time_ns: truth.time_ns,
            counted: truth.counted.0.into(),
            attitudes: truth.attitudes.0.into(),
            wrist_mm: coordinates(truth.pose.wrist),
            sensor_mm: coordinates(truth.pose.tool),
            signal: truth.seen.signal,
            fired: truth.fired,
            touching: truth.touching,
            lost_half_steps: truth.lost.0.into(),
        }
    }
}

/// A list of joint values in which one joint of a TeachMover takes part.
pub fn only(joint: Joint, value: f64) -> SomeJoints {
    Joint::ALL.iter().map(|other| (*other == joint).then_some(value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn there_and_back<T: Serialize + for<'de> Deserialize<'de>>(value: &T) -> T {
        serde_json::from_str(&serde_json::to_string(value).unwrap()).unwrap()
    }

    #[test]
    fn a_call_reads_as_a_person_would_write_it() {
        let line = r#"{"id":3,"do":{"move":{"joints":[null,-0.1,null,null,null,null],"relative":true}}}"#;
        let call: Call = serde_json::from_str(line).unwrap();
        let requested =
            WorldCommand::Move { joints: only(Joint::Shoulder, -0.1), relative: true, speed: 1.0 };
        assert_eq!(call, Call { id: 3, command: requested });
        assert_eq!(there_and_back(&call), call);
        assert_eq!(
            serde_json::from_str::<Call>(r#"{"id":4,"do":{"look":{}}}"#).unwrap().command,
            WorldCommand::Look {}
        );
    }

    #[test]
    fn an_unknown_command_is_named_with_those_there_are() {
        let error = serde_json::from_str::<Call>(r#"{"id":4,"do":{"fly":{}}}"#).unwrap_err().to_string();
        assert!(
            error.starts_with("unknown variant `fly`, expected one of `read`, `move`, `follow`"),
            "{error}"
        );
    }

    #[test]
    fn a_pose_comes_through_to_the_last_digit() {
        let joints = [0.1 + 0.2, -1.0 / 3.0, 1e-13, std::f64::consts::PI, -0.0, 123_456.789_012_345_67];
        let change = Change {
            number: 1,
            time_ns: u64::MAX,
            levels: 1,
            changed: 1,
            joints: joints.into(),
            half_width: [0.0; 6].into(),
        };
        assert_eq!(there_and_back(&change), change);
    }
}
