//! What can be wrong with an arm: the catalogue of mechanisms, each with where it sits and how large it is.
//!
//! A size is given in rad, mm, kg, N m, K and s, as the mechanism has it; `unit` names it. What each mechanism does is described where it is done: in the
//! drive ([`super::drive`]), in what yields ([`super::elastic`]), in the shape, by time and temperature ([`super::slow_change`]) or in the instrument
//! ([`super::campaign::instrument`]).

use super::description::{ArmDescription, Motion};

/// The quantity of a row that warms up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Warming {
    /// The joint's zero, rad.
    Zero,
    /// The link's length, mm.
    Length,
    /// The link's offset, mm.
    Offset,
}

impl Warming {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Zero => "zero",
            Self::Length => "length",
            Self::Offset => "offset",
        }
    }
}

/// How an arm deviates from the one on paper. Numbers beside the site are secondary: what matters is the size beside the mechanism.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "each mechanism's line tells what its numbers are")]
pub enum Mechanism {
    /// The joint reads zero elsewhere; rad.
    JointZero { joint: usize },
    /// The transmission ratio differs; rad per rad.
    JointGain { joint: usize },
    /// Length of the common normal; mm.
    LinkLength { joint: usize },
    /// Offset along the axis; mm.
    LinkOffset { joint: usize },
    /// Twist about the common normal; rad.
    LinkTwist { joint: usize },
    /// The joint's own axis leans about the y of the frame it turns in; rad.
    AxisSkew { joint: usize },
    /// The base is turned about an axis of the world; rad.
    BaseTilt { axis: [f64; 3] },
    /// The base is elsewhere along a direction; mm.
    BasePosition { direction: [f64; 3] },
    /// The target sits elsewhere along a direction of the flange; mm.
    ToolOffset { direction: [f64; 3] },
    /// The drive yields to the moment of gravity; rad/(N m).
    JointCompliance { joint: usize },
    /// The drive yields, less and less beyond a moment of `knee` N m; rad/(N m) at rest.
    JointStiffening { joint: usize, knee: f64 },
    /// A wheel turning `per_turn` times for a turn of the joint runs out of true; rad at the joint.
    JointHarmonic { joint: usize, per_turn: f64, phase: f64 },
    /// The face on which a screw of this pitch (mm) bears runs out, so that it goes to and fro `per_turn` times a turn; mm, the amplitude.
    ScrewWave { joint: usize, pitch: f64, per_turn: f64, phase: f64 },
    /// The guideway of a slide is twisted, so that its carriage rolls about its travel; rad for a mm.
    AxisRoll { joint: usize },
    /// The guideway is bowed upright: its carriage rises along an arc of this curvature; rad for a mm.
    AxisPitch { joint: usize },
    /// The guideway is bowed sideways, to the left of its travel; rad for a mm.
    AxisYaw { joint: usize },
    /// Play of the gears; rad, the whole width.
    JointBacklash { joint: usize },
    /// The drive creeps into place: it lags by a fraction of the last moves, forgotten with time; rad per rad.
    JointSettling { joint: usize, forgetting_s: f64 },
    /// Viscous friction winds the drive up in proportion to its speed in the last move, and dry friction holds it so; rad at full speed.
    JointLag { joint: usize },
    /// Turning `driver` drags `joint`; rad per rad.
    JointCoupling { joint: usize, driver: usize },
    /// Cables that run over `driver`, behind the play, drag `joint` along; rad per rad.
    CableDrag { joint: usize, driver: usize },
    /// The joint jumps at a time, as when the motor loses steps; rad, in its own sense.
    JointStep { joint: usize, at_s: f64 },
    /// The link after the joint bends as a beam; 1/(N m2), the reciprocal of its bending stiffness.
    LinkSag { joint: usize },
    /// The link after the joint twists about its own line as a shaft; 1/(N m2), the reciprocal of its torsional stiffness.
    LinkTorsion { joint: usize },
    /// The link of the row grows with temperature; 1/K.
    ThermalGrowth { joint: usize },
    /// Something of the row moves while the machine warms up; rad or mm in the end.
    WarmUp { joint: usize, of: Warming, time_constant_s: f64 },
    /// The base creeps along a direction; mm per hour.
    Drift { direction: [f64; 3] },
    /// The instrument's length along one axis (0, 1, 2) is wrong; mm per mm.
    InstrumentScale { axis: usize },
    /// The instrument is out of level about a horizontal direction (rad from x); rad.
    InstrumentTilt { direction: f64 },
    /// Outside the library: the joint hangs in detents of irregular spacing near `spacing` rad; rad, the depth.
    StickSlip { joint: usize, spacing: f64, pattern: u64 },
    /// Outside the library: gears worn in one place have play there, around `worn_at` within `spread` rad; rad, the greatest width.
    WornGear { joint: usize, worn_at: f64, spread: f64 },
    /// Outside the library: a cable run over the joint and the next one is slack for `slack` rad of their sum and then pulls; rad per rad.
    CableWindUp { joint: usize, slack: f64 },
    /// Outside the library: the base rocks on uneven feet about a horizontal direction (rad from x), over within `softness` N m; rad each way.
    RockingBase { direction: f64, softness: f64 },
    /// Not repeatable: a loose coupling sits in one of two positions for no recorded reason; rad.
    LooseCoupling { joint: usize, pattern: u64 },
}

/// A mechanism at work.
#[derive(Debug, Clone, PartialEq)]
pub struct Imperfection {
    /// What.
    pub mechanism: Mechanism,
    /// How much, in the mechanism's unit.
    pub size: f64,
}

/// What kind of answer a mechanism calls for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// An effect of the lab's library.
    Library,
    /// No effect of the library does this.
    Outside,
    /// The machine does not repeat.
    NotRepeatable,
}

impl Mechanism {
    /// Name: of the lab's effect where there is one.
    pub fn name(&self) -> &'static str {
        match self {
            Self::JointZero { .. } => "joint_zero",
            Self::JointGain { .. } => "joint_gain",
            Self::LinkLength { .. } => "link_length",
            Self::LinkOffset { .. } => "link_offset",
            Self::LinkTwist { .. } => "link_twist",
            Self::AxisSkew { .. } => "axis_skew",
            Self::BaseTilt { .. } => "base_tilt",
            Self::BasePosition { .. } => "base_position",
            Self::ToolOffset { .. } => "tool_offset",
            Self::JointCompliance { .. } => "joint_compliance",
            Self::JointStiffening { .. } => "joint_stiffening",
            Self::JointHarmonic { .. } => "joint_harmonic",
            Self::ScrewWave { .. } => "screw_wave",
            Self::AxisRoll { .. } => "axis_roll",
            Self::AxisPitch { .. } => "axis_pitch",
            Self::AxisYaw { .. } => "axis_yaw",
            Self::JointBacklash { .. } => "joint_backlash",
            Self::JointSettling { .. } => "joint_settling",
            Self::JointLag { .. } => "joint_lag",
            Self::JointCoupling { .. } | Self::CableDrag { .. } => "joint_coupling",
            Self::JointStep { .. } => "joint_step",
            Self::LinkSag { .. } => "link_sag",
            Self::LinkTorsion { .. } => "link_torsion",
            Self::ThermalGrowth { .. } => "thermal_growth",
            Self::WarmUp { .. } => "warm_up",
            Self::Drift { .. } => "drift",
            Self::InstrumentScale { .. } => "scale",
            Self::InstrumentTilt { .. } => "instrument_tilt",
            Self::StickSlip { .. } => "stick_slip",
            Self::WornGear { .. } => "worn_gear",
            Self::CableWindUp { .. } => "cable_wind_up",
            Self::RockingBase { .. } => "rocking_base",
            Self::LooseCoupling { .. } => "loose_coupling",
        }
    }

    /// Whether the lab's library has it.
    pub fn kind(&self) -> Kind {
        match self {
            Self::StickSlip { .. }
            | Self::WornGear { .. }
            | Self::CableWindUp { .. }
            | Self::RockingBase { .. } => Kind::Outside,
            Self::LooseCoupling { .. } => Kind::NotRepeatable,
            _ => Kind::Library,
        }
    }

    /// Unit of the size.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::LinkLength { .. }
            | Self::LinkOffset { .. }
            | Self::BasePosition { .. }
            | Self::ToolOffset { .. }
            | Self::ScrewWave { .. } => "mm",
            Self::AxisRoll { .. } | Self::AxisPitch { .. } | Self::AxisYaw { .. } => "rad/mm",
            Self::WarmUp { of: Warming::Length | Warming::Offset, .. } => "mm",
            Self::JointGain { .. }
            | Self::JointSettling { .. }
            | Self::JointCoupling { .. }
            | Self::CableDrag { .. }
            | Self::CableWindUp { .. } => "rad/rad",
            Self::JointCompliance { .. } | Self::JointStiffening { .. } => "rad/(N m)",
            Self::LinkSag { .. } | Self::LinkTorsion { .. } => "1/(N m2)",
            Self::ThermalGrowth { .. } => "1/K",
            Self::Drift { .. } => "mm/h",
            Self::InstrumentScale { .. } => "mm/mm",
            _ => "rad",
        }
    }

    /// The joint whose row holds what changes, where it is a joint.
    pub fn joint(&self) -> Option<usize> {
        match *self {
            Self::JointZero { joint }
            | Self::JointGain { joint }
            | Self::LinkLength { joint }
            | Self::LinkOffset { joint }
            | Self::LinkTwist { joint }
            | Self::AxisSkew { joint }
            | Self::JointCompliance { joint }
            | Self::JointStiffening { joint, .. }
            | Self::JointHarmonic { joint, .. }
            | Self::ScrewWave { joint, .. }
            | Self::AxisRoll { joint }
            | Self::AxisPitch { joint }
            | Self::AxisYaw { joint }
            | Self::JointBacklash { joint }
            | Self::JointSettling { joint, .. }
            | Self::JointLag { joint }
            | Self::JointCoupling { joint, .. }
            | Self::CableDrag { joint, .. }
            | Self::JointStep { joint, .. }
            | Self::LinkSag { joint }
            | Self::LinkTorsion { joint }
            | Self::ThermalGrowth { joint }
            | Self::WarmUp { joint, .. }
            | Self::StickSlip { joint, .. }
            | Self::WornGear { joint, .. }
            | Self::CableWindUp { joint, .. }
            | Self::LooseCoupling { joint, .. } => Some(joint),
            Self::BaseTilt { .. }
            | Self::BasePosition { .. }
            | Self::ToolOffset { .. }
            | Self::Drift { .. }
            | Self::InstrumentScale { .. }
            | Self::InstrumentTilt { .. }
            | Self::RockingBase { .. } => None,
        }
    }

    /// The site as the lab's files name it: a joint's name, `base`, `p1`, an axis.
    pub fn site(&self, arm: &ArmDescription) -> String {
        match *self {
            Self::ToolOffset { .. } => "p1".to_owned(),
            Self::InstrumentScale { axis } => ["x", "y", "z"].get(axis).copied().unwrap_or("z").to_owned(),
            Self::InstrumentTilt { .. } => "instrument".to_owned(),
            _ => self.joint().map_or_else(|| "base".to_owned(), |joint| arm.joint_name(joint).to_owned()),
        }
    }

    /// Unit of the size on this arm: what is an angle of a joint that turns is a length of one that slides.
    pub fn unit_on(&self, arm: &ArmDescription) -> &'static str {
        let slides = self
            .joint()
            .and_then(|joint| arm.joints.get(joint))
            .is_some_and(|joint| joint.motion == Motion::Slides);
        let of_the_coordinate = matches!(
            self,
            Self::JointZero { .. }
                | Self::JointBacklash { .. }
                | Self::JointStep { .. }
                | Self::WarmUp { of: Warming::Zero, .. }
        );
        match (slides && of_the_coordinate, slides, self) {
            (true, ..) => "mm",
            (_, true, Self::JointCompliance { .. }) => "mm/N",
            _ => self.unit(),
        }
    }

    /// The greatest size anyone would believe of a working machine.
    pub fn greatest_plausible(&self, arm: &ArmDescription) -> f64 {
        match self.unit_on(arm) {
            "mm" => 10.0,
            "mm/h" => 20.0,
            // A degree a metre.
            "rad/mm" => 1.75e-5,
            "mm/mm" => 0.01,
            "rad/rad" => 0.05,
            "rad/(N m)" | "rad" => 0.05,
            "1/K" => 2e-4,
            // An open channel of 4 mm aluminium, 60 mm wide: G J = 26e9 Pa * 0.18 m * (4 mm)^3 / 3 = 100 N m2. A closed tube is hundreds of times as stiff.
            _ if matches!(self, Self::LinkTorsion { .. }) => 1e-2,
            _ => 1e-3,
        }
    }

    /// A size that moves an arm just so that it can be computed: small enough to be linear.
    pub fn small_size(&self) -> f64 {
        match self.unit() {
            "rad/(N m)" => 1e-6,
            "1/(N m2)" => 1e-7,
            "1/K" => 1e-5,
            "rad/mm" => 1e-7,
            "mm" | "mm/h" => 0.1,
            _ => 1e-4,
        }
    }
}
