//! From what was typed to what is true.

use std::ops::RangeInclusive;

use plumb_document::Span;

use super::super::drive::{AXES, HalfSteps, Joint, Joints};
use super::super::mechanism::{ArmGeometry, CableDrag, Droop, Mechanism};
use super::super::motion::Resolution;
use super::super::pose::ArmPose;
use super::super::sensor::{Optics, ProximitySensor, Scene, Spot, Table};
use super::super::target::TTarget;
use super::super::{ArmDescription, Instruments, WorldDescription};
use super::raw::{self, Number};
use super::typed::Typed;
use crate::instrument::Instrument;
use crate::physics::machine::Machine;

/// Rated speeds without load: base, shoulder, elbow, wrists, and 20 mm/s of gripper, half-steps/s.
const RATED_HALF_STEPS_PER_S: [f64; AXES] = [472.0, 405.0, 551.0, 487.0, 487.0, 292.0];

/// Checks one file.
pub(super) struct Checker<'a> {
    pub(super) typed: Typed<'a>,
}

impl Checker<'_> {
    pub(super) fn world(&self, raw: raw::World) -> Option<WorldDescription> {
        let raw::Arm::TeachMover(arm) = raw.arm else {
            self.typed
                .wrong(raw.world.span, "there is another arm in this world, but a TeachMover is wanted here");
            return None;
        };
        let raw::Target::T(target) = raw.target;
        let start = arm.start.span;
        let target = self.target(&target);
        let sensor = self.sensor(&raw.sensor, target.white);
        let scene = Scene { table: self.table(&raw.table), target, sensor };
        let typed = arm;
        let arm = self.teachmover(&typed);
        self.require_firm(&arm.mechanism.machine(), &typed.droop);
        self.require_free(&arm, scene.table.solid, start);
        let instruments = self.instruments(&raw.instruments);
        Some(WorldDescription {
            title: raw.world.value,
            seed: raw.seed,
            arm,
            scene,
            instruments,
            sealed_text: None,
        })
    }

    fn teachmover(&self, raw: &raw::TeachMover) -> ArmDescription {
        let length =
            |key, value: &Option<Number>, default| self.typed.or(key, value, default, 1.0..=2000.0, "mm");
        let geometry = ArmGeometry {
            shoulder_height: length("shoulder_height_mm", &raw.shoulder_height_mm, 195.0),
            upper_arm: length("upper_arm_mm", &raw.upper_arm_mm, 177.8),
            forearm: length("forearm_mm", &raw.forearm_mm, 177.8),
            hand: length("hand_mm", &raw.hand_mm, 109.0),
        };
        ArmDescription {
            mechanism: Mechanism {
                geometry,
                backlash: self.joints(&raw.backlash, 0.0..=20.0),
                drag: self.cable_drag(&raw.cable_drag),
                droop: self.droop(&raw.droop),
            },
            resolution: match raw.resolution {
                raw::Resolution::Continuous => Resolution::Continuous,
                raw::Resolution::HalfStep => Resolution::HalfStep,
            },
            start: self.joints(&raw.start.value, -360.0..=360.0),
            start_within: self.joints(&raw.start_within, 0.0..=90.0),
            zero_error: self.joints(&raw.zero_error, -90.0..=90.0),
            top_rates: self.rates(&raw.top_half_steps_per_s),
            pull_out_rates: raw.pull_out_half_steps_per_s.as_ref().map(|rates| self.rates(rates)),
        }
    }

    fn joints(&self, raw: &raw::JointValues, range: RangeInclusive<f64>) -> Joints {
        let degrees = |key, value| self.typed.or(key, value, 0.0, range.clone(), "deg").to_radians();
        Joints([
            degrees("waist_deg", &raw.waist_deg),
            degrees("shoulder_deg", &raw.shoulder_deg),
            degrees("elbow_deg", &raw.elbow_deg),
            degrees("wrist_pitch_deg", &raw.wrist_pitch_deg),
            degrees("wrist_roll_deg", &raw.wrist_roll_deg),
            self.typed.or("gripper_mm", &raw.gripper_mm, 0.0, -100.0..=100.0, "mm"),
        ])
    }

    fn rates(&self, raw: &raw::MotorRates) -> HalfSteps {
        let motors = [
            ("base", &raw.base),
            ("shoulder", &raw.shoulder),
            ("elbow", &raw.elbow),
            ("right_wrist", &raw.right_wrist),
            ("left_wrist", &raw.left_wrist),
            ("gripper", &raw.gripper),
        ];
        let mut rates = HalfSteps(RATED_HALF_STEPS_PER_S);
        for ((key, value), rate) in motors.into_iter().zip(&mut rates.0) {
            *rate = self.typed.or(key, value, *rate, 1.0..=100_000.0, "half-steps/s");
        }
        rates
    }

    fn cable_drag(&self, raw: &raw::CableDrag) -> CableDrag {
        let fraction = |key, value| self.typed.or(key, value, 0.0, -1.0..=1.0, "deg/deg");
        let gripper = self.typed.or(
            "gripper_mm_per_elbow_deg",
            &raw.gripper_mm_per_elbow_deg,
            0.0,
            -1.0..=1.0,
            "mm/deg",
        );
        CableDrag {
            elbow_by_shoulder: fraction("elbow_deg_per_shoulder_deg", &raw.elbow_deg_per_shoulder_deg),
            wrist_pitch_by_shoulder: fraction(
                "wrist_pitch_deg_per_shoulder_deg",
                &raw.wrist_pitch_deg_per_shoulder_deg,
            ),
            wrist_pitch_by_elbow: fraction(
                "wrist_pitch_deg_per_elbow_deg",
                &raw.wrist_pitch_deg_per_elbow_deg,
            ),
            gripper_by_elbow: gripper.to_degrees(),
        }
    }

    fn droop(&self, raw: &raw::Droop) -> Droop {
        let mass = |key, value| self.typed.or(key, value, 0.0, 0.0..=20.0, "kg");
        let give = |key, value| self.typed.or(key, value, 0.0, 0.0..=5.0, "deg/(N m)").to_radians();
        Droop {
            upper_arm_mass: mass("upper_arm_kg", &raw.upper_arm_kg),
            forearm_mass: mass("forearm_kg", &raw.forearm_kg),
            hand_mass: mass("hand_kg", &raw.hand_kg),
            shoulder_give: give("shoulder_deg_per_nm", &raw.shoulder_deg_per_nm),
            elbow_give: give("elbow_deg_per_nm", &raw.elbow_deg_per_nm),
            wrist_pitch_give: give("wrist_pitch_deg_per_nm", &raw.wrist_pitch_deg_per_nm),
        }
    }

    fn table(&self, raw: &raw::Table) -> Table {
        let reflectance = self.typed.or("reflectance", &raw.reflectance, 0.8, 0.0..=1.0, "");
        Table { solid: raw.solid, reflectance }
    }

    fn target(&self, raw: &raw::TTarget) -> TTarget {
        let line_b_distance = self.typed.number("distance_mm", &raw.line_b.distance_mm, 20.0..=2000.0, "mm");
        let offset = self.typed.number("offset_deg", &raw.line_b.offset_deg, -60.0..=60.0, "deg");
        if offset == 0.0 {
            let problem = "`offset_deg` is 0, but its sign says on which side of line A white lies; give the waist's \
                           angle from line A to where line B is looked for, such as 8 or -8";
            self.typed.wrong(raw.line_b.offset_deg.span, problem);
        }
        let black = self.typed.or("black", &raw.reflectance.black, 0.05, 0.0..=1.0, "");
        let white = self.typed.or("white", &raw.reflectance.white, 0.9, 0.0..=1.0, "");
        if let Some(given) = raw.reflectance.white.as_ref().or(raw.reflectance.black.as_ref())
            && white <= black
        {
            let problem = format!("`white` ({white}) must reflect more than `black` ({black})");
            self.typed.wrong(given.span, &problem);
        }
        let body_radius =
            self.typed.or("radius_mm", &raw.body.radius_mm, line_b_distance + 70.0, 20.0..=2000.0, "mm");
        if let Some(radius) = &raw.body.radius_mm
            && body_radius <= line_b_distance
        {
            let problem = format!(
                "`radius_mm` is {body_radius}, but the body begins at line B, {line_b_distance} mm from the waist's axis; \
                 it must end further out"
            );
            self.typed.wrong(radius.span, &problem);
        }
        TTarget {
            line_a: self.typed.number("line_a_deg", &raw.line_a_deg, -180.0..=180.0, "deg").to_radians(),
            line_b_distance,
            line_b_offset: offset.to_radians(),
            head_depth: self.typed.or("depth_mm", &raw.head.depth_mm, 25.0, 1.0..=line_b_distance, "mm"),
            head_width: self.typed.or("width_mm", &raw.head.width_mm, 120.0, 1.0..=2000.0, "mm"),
            body_radius,
            body_angle: self.typed.or("angle_deg", &raw.body.angle_deg, 12.0, 0.5..=90.0, "deg").to_radians(),
            patch_margin: self.typed.or("patch_margin_mm", &raw.patch_margin_mm, 20.0, 0.0..=1000.0, "mm"),
            black,
            white,
            misplaced: [
                self.typed.or("x_mm", &raw.misplaced.x_mm, 0.0, -500.0..=500.0, "mm"),
                self.typed.or("y_mm", &raw.misplaced.y_mm, 0.0, -500.0..=500.0, "mm"),
            ],
            misturned: self
                .typed
                .or("turn_deg", &raw.misplaced.turn_deg, 0.0, -180.0..=180.0, "deg")
                .to_radians(),
        }
    }

    fn sensor(&self, raw: &raw::Sensor, white: f64) -> ProximitySensor {
        let input_bit = raw.input_bit.as_ref().map_or(0, |bit| bit.value);
        if let Some(bit) = &raw.input_bit
            && input_bit > 6
        {
            let problem = format!("`input_bit` is {input_bit}; the arm has the input bits 0 to 6");
            self.typed.wrong(bit.span, &problem);
        }
        let optics = match &raw.optics {
            raw::Optics::Ideal(ideal) => {
                let height = self.typed.number("height_mm", &ideal.height_mm, 0.01..=200.0, "mm");
                let release_height = self.typed.or(
                    "release_height_mm",
                    &ideal.release_height_mm,
                    height,
                    height..=400.0,
                    "mm",
                );
                Optics::Ideal { height, release_height }
            }
            raw::Optics::Spot(spot) => Optics::Spot(self.spot(spot, white)),
        };
        ProximitySensor { input_bit, optics }
    }

    /// The sensor was trimmed over the target's own white.
    fn spot(&self, raw: &raw::Spot, white: f64) -> Spot {
        let peak_distance = self.typed.number("peak_mm", &raw.peak_mm, 0.1..=200.0, "mm");
        let trimmed_distance =
            self.typed.number("trimmed_to_fire_at_mm", &raw.trimmed_to_fire_at_mm, 0.1..=400.0, "mm");
        if trimmed_distance <= peak_distance {
            let problem = format!(
                "`trimmed_to_fire_at_mm` is {trimmed_distance}, but a hand that comes down meets the most light at \
                 `peak_mm`, {peak_distance}; the sensor must fire above that"
            );
            self.typed.wrong(raw.trimmed_to_fire_at_mm.span, &problem);
        }
        let interval_ms =
            self.typed.or("noise_interval_ms", &raw.noise_interval_ms, 1.0, 0.05..=1000.0, "ms");
        let untrimmed = Spot {
            diameter: self.typed.number("diameter_mm", &raw.diameter_mm, 0.01..=50.0, "mm"),
            peak_distance,
            hysteresis: self.typed.or("hysteresis_percent", &raw.hysteresis_percent, 0.0, 0.0..=90.0, "%")
                / 100.0,
            noise: self.typed.or("noise_percent", &raw.noise_percent, 0.0, 0.0..=50.0, "%") / 100.0,
            noise_knot_ns: (interval_ms * 1e6) as u64,
            firing_level: 0.0,
        };
        Spot { firing_level: untrimmed.response(trimmed_distance) * white, ..untrimmed }
    }

    fn instruments(&self, raw: &raw::Instruments) -> Instruments {
        let level = |key, value| self.typed.or(key, value, 0.0, 0.0..=45.0, "deg").to_radians();
        let ruler = |key, value| self.typed.or(key, value, 0.0, 0.0..=50.0, "mm");
        Instruments {
            level: Instrument {
                error: level("error_deg", &raw.level.error_deg),
                division: level("division_deg", &raw.level.division_deg),
            },
            ruler: Instrument {
                error: ruler("error_mm", &raw.ruler.error_mm),
                division: ruler("division_mm", &raw.ruler.division_mm),
            },
            eye: Instrument { error: ruler("error_mm", &raw.eye.error_mm), division: 0.0 },
        }
    }

    /// The arm must not begin inside the table or past a joint's stop, wherever within its tolerance it was left. Not asked while other numbers are
    /// wrong.
    fn require_free(&self, arm: &ArmDescription, solid_table: bool, span: Span) {
        if !self.typed.problems.is_empty() {
            return;
        }
        let within = arm.start_within;
        let corner = |corner: u32| {
            Joints(std::array::from_fn(|axis| {
                let side = if corner & (1 << axis) == 0 { 1.0 } else { -1.0 };
                arm.start.0[axis] + side * within.0[axis]
            }))
        };
        let machine = arm.mechanism.machine();
        let problem =
            (0..1_u32 << AXES).find_map(|index| hindrance(arm, &machine, &corner(index), solid_table));
        problem.iter().for_each(|problem| self.typed.wrong(span, problem));
    }
}

/// Why the arm cannot start there, if it cannot.
fn hindrance(arm: &ArmDescription, machine: &Machine, start: &Joints, solid_table: bool) -> Option<String> {
    let arm_state = machine.stiff(&start.0);
    let pose = ArmPose::of(&arm_state.link_frames);
    if solid_table && pose.tool.z < 0.0 {
        return Some(format!("the arm would start with its sensor {:.1} mm under the table", -pose.tool.z));
    }
    let opening = start.of(Joint::Gripper);
    let under_table = solid_table && pose.under_table() > 0.0;
    if under_table || arm.mechanism.past_stops(&arm_state.angles, opening, 0.0) > 0.0 || opening < 0.0 {
        let [_, shoulder, elbow, wrist_pitch, ..] = start.0.map(f64::to_degrees);
        return Some(format!(
            "the arm cannot start so, a joint would be past its stop; waist within 90 deg, shoulder -35 to 144, \
             elbow up to 149 below the upper arm (here {:.1}), hand within 90 of the forearm (here {:.1}), gripper 0 \
             to 76.2 mm",
            shoulder - elbow,
            wrist_pitch - elbow,
        ));
    }
    None
}
