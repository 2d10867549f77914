//! The mechanics of the simulated arms, against cases whose answer is known otherwise.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use plumb_simulated::physics::arms;
use plumb_simulated::physics::description::{ArmDescription, GRAVITY};
use plumb_simulated::physics::drive::{Detents, EccentricWheel, Play, Settling};
use plumb_simulated::physics::imperfection::{Imperfection, Mechanism, Warming};
use plumb_simulated::physics::machine::{ArmState, Conditions, Machine};
use plumb_simulated::physics::random::Random;
use plumb_simulated::physics::rigid::Vector;
use plumb_simulated::physics::shape::Shape;
use plumb_simulated::physics::transmission::Transmission;

const QUIET: Conditions = Conditions { time_s: 0.0, temperature_c: 20.0, payload_kg: 0.0 };

fn pendulum() -> ArmDescription {
    // Axis level along y; at zero the rod points along x and falls towards positive angles.
    let text = "arm: pendulum\nconvention: distal\njoints:\n  - {name: post, alpha_deg: -90}\n  - {name: pivot, a_mm: 500}\n\
                links:\n  - {after: pivot, mass_kg: 3, centre_mm: [-100, 0, 0]}\ntargets: {p1: {}}\n";
    ArmDescription::from_yaml(text).unwrap()
}

fn equilibrium(
    arm: &ArmDescription,
    imperfections: &[(Mechanism, f64)],
    angles: &[f64],
    conditions: &Conditions,
) -> ArmState {
    let imperfections: Vec<Imperfection> = imperfections
        .iter()
        .map(|(mechanism, size)| Imperfection { mechanism: mechanism.clone(), size: *size })
        .collect();
    let mut machine = Machine::new(arm, &imperfections);
    machine.go(angles, conditions.time_s);
    machine.equilibrium(conditions).unwrap()
}

#[test]
fn a_springy_pendulum_rests_where_spring_and_weight_balance() {
    // Rod of 0.4 m to its 3 kg: theta = commanded + c m g r cos(theta), here at a compliance soft enough that the bent pose matters.
    let compliance = 0.02;
    for commanded in [-1.2, -0.3, 0.0, 0.8, 1.5] {
        let arm_state = equilibrium(
            &pendulum(),
            &[(Mechanism::JointCompliance { joint: 1 }, compliance)],
            &[0.4, commanded],
            &QUIET,
        );
        let balance = |theta: f64| commanded + compliance * 3.0 * GRAVITY * 0.4 * theta.cos() - theta;
        let (mut low, mut high) = (commanded - 2.0, commanded + 2.0);
        while high - low > 1e-14 {
            let middle = 0.5 * (low + high);
            if balance(middle) > 0.0 {
                low = middle
            } else {
                high = middle
            }
            if middle == low && middle == high {
                break;
            }
        }
        assert!(
            (arm_state.angles[1] - low).abs() < 1e-12,
            "commanded {commanded}: {} against {low}",
            arm_state.angles[1]
        );
        assert_eq!(arm_state.angles[0], 0.4, "gravity has no moment about a vertical axis");
    }
}

#[test]
fn a_spring_too_soft_for_its_weight_is_an_error() {
    let imperfections = [Imperfection { mechanism: Mechanism::JointCompliance { joint: 1 }, size: 5.0 }];
    let mut machine = Machine::new(&pendulum(), &imperfections);
    machine.go(&[0.0, 1.0], 0.0);
    let message = machine.equilibrium(&Conditions { payload_kg: 2.0, ..QUIET }).unwrap_err().to_string();
    assert!(
        message
            .starts_with("the arm finds no equilibrium under 2 kg: its springs are too soft for its weight"),
        "{message}"
    );
}

#[test]
fn a_sagging_link_bends_as_the_cantilever_of_the_textbook() {
    // 10 kg at the end of a level rod of 0.5 m without other weight: F L^3 / 3EI down, and F L^2 / 2EI of turn.
    let mut arm = pendulum();
    arm.weights.clear();
    let flexibility = 1e-7;
    let load = Conditions { payload_kg: 10.0, ..QUIET };
    let arm_state = equilibrium(&arm, &[(Mechanism::LinkSag { joint: 1 }, flexibility)], &[0.0, 0.0], &load);
    let force = 10.0 * GRAVITY;
    let drop_mm = force * 0.5_f64.powi(3) / 3.0 * flexibility * 1e3;
    let turn = force * 0.5_f64.powi(2) / 2.0 * flexibility;
    assert!(
        (arm_state.link_frames.target.z + drop_mm).abs() < 1e-6 * drop_mm,
        "{} against {drop_mm}",
        arm_state.link_frames.target.z
    );
    let sloped = -arm_state.link_frames.world_from_flange.rotation.x.z;
    assert!((sloped - turn).abs() < 1e-6 * turn, "{sloped} against {turn}");
}

#[test]
fn a_twisted_link_turns_as_the_shaft_of_the_textbook() {
    // 10 kg hang 200 mm beside the end of a level rod of 0.5 m without other weight: T L / GJ about the rod.
    let mut arm = pendulum();
    arm.weights.clear();
    // The flange's z is the pivot's axis, which lies level, square to the rod.
    arm.target = Vector::new(0.0, 0.0, 200.0);
    let flexibility = 1e-4;
    let load = Conditions { payload_kg: 10.0, ..QUIET };
    let drop = |imperfections: &[(Mechanism, f64)]| {
        let arm_state = equilibrium(&arm, imperfections, &[0.0, 0.0], &load);
        (-arm_state.link_frames.target.z, arm_state.link_frames.target.x)
    };
    let angle = 10.0 * GRAVITY * 0.2 * 0.5 * flexibility;
    let (down, ahead) = drop(&[(Mechanism::LinkTorsion { joint: 1 }, flexibility)]);
    assert!((down - 200.0 * angle).abs() < 1e-3 * down, "{down} mm against {} mm", 200.0 * angle);
    assert!((ahead - 500.0).abs() < 1e-9, "about the rod's own line: {ahead}");
    // The post is along its joint's axis, about which gravity has no moment.
    let (down, _) = drop(&[(Mechanism::LinkTorsion { joint: 0 }, flexibility)]);
    assert!(down.abs() < 1e-9, "{down}");
}

#[test]
fn an_eccentric_wheel_follows_the_law_of_sines() {
    // Brute force: centre of the track beside the axis, reading point fixed on the track, angle read off the disc.
    let (eccentricity, phase) = (0.08, 0.7);
    let wheel = EccentricWheel { joint: 0, eccentricity, per_turn: 1.0, phase };
    for step in 0..50 {
        let angle = -3.0 + 0.12 * f64::from(step);
        let centre = Vector::new((angle + phase).cos(), (angle + phase).sin(), 0.0) * eccentricity;
        // The reading head rides on the track along the x axis of the housing: the point of the unit circle about the centre with y = 0.
        let head_x = centre.x + (1.0 - centre.y * centre.y).sqrt();
        let seen_from_centre = (0.0 - centre.y).atan2(head_x - centre.x);
        let read = angle - seen_from_centre;
        assert!((read - angle - wheel.reads_too_much(angle)).abs() < 1e-12, "at {angle}");
        assert!((wheel.true_angle(read) - angle).abs() < 1e-12, "at {angle}");
    }
}

#[test]
fn a_slightly_eccentric_disc_errs_by_412_e_over_d_arcseconds() {
    // Encoder makers: greatest error in arcseconds is 412 times eccentricity (micrometres) over track diameter (mm).
    let (micrometres, diameter) = (5.0, 80.0);
    let wheel = EccentricWheel {
        joint: 0,
        eccentricity: micrometres * 1e-3 / (0.5 * diameter),
        per_turn: 1.0,
        phase: 0.0,
    };
    let greatest = wheel.reads_too_much(std::f64::consts::FRAC_PI_2).to_degrees() * 3600.0;
    assert!((greatest / (412.0 * micrometres / diameter) - 1.0).abs() < 2e-3, "{greatest} arcseconds");
}

#[test]
fn a_pinion_out_of_true_errs_once_for_each_of_its_turns() {
    let wheel = EccentricWheel { joint: 0, eccentricity: 0.02, per_turn: 20.0, phase: 0.3 };
    let turn = std::f64::consts::TAU / 20.0;
    assert!((wheel.reads_too_much(0.05) - wheel.reads_too_much(0.05 + turn)).abs() < 1e-12);
    assert!((wheel.reads_too_much(0.05) + wheel.reads_too_much(0.05 + 0.5 * turn)).abs() < 1e-12);
}

#[test]
fn play_is_a_hysteresis_that_depends_on_turning_points_only() {
    let width = 0.02;
    let mut random = Random::new(11, "play");
    let path: Vec<f64> = (0..200).map(|_| random.between(-1.0, 1.0)).collect();
    let mut coarse = Play::even(0, width);
    let mut fine = Play::even(0, width);
    let mut last = path[0];
    for point in path {
        let after = coarse.follow(point);
        for step in 1..=7 {
            fine.follow(last + (point - last) * f64::from(step) / 7.0);
        }
        // Rate independence: how many steps a straight move is cut into is no matter.
        assert!((after - fine.follow(point)).abs() < 1e-12);
        // The driven side is never further than half the width away, and exactly that far after a long move.
        assert!((after - point).abs() <= 0.5 * width + 1e-15);
        if (point - last).abs() > width {
            assert!((after - (point - 0.5 * width * (point - last).signum())).abs() < 1e-12);
        }
        last = point;
    }
}

#[test]
fn a_move_within_the_play_does_not_reach_the_joint() {
    let mut play = Play::even(0, 0.02);
    play.follow(0.0);
    let arrived = play.follow(0.5);
    assert_eq!(play.follow(0.5 - 0.019), arrived);
    assert!(play.follow(0.5 - 0.03) < arrived);
}

#[test]
fn worn_gears_have_play_only_where_they_are_worn() {
    let play = Play::worn(0, 0.01, 1.0, 0.2);
    assert_eq!(play.width_at(1.0), 0.01);
    assert!(play.width_at(2.0) < 1e-6);
}

#[test]
fn creep_is_proportional_to_the_last_move_and_forgotten() {
    let mut belt = Settling::new(0, 0.001, 10.0);
    belt.follow(0.0, 0.0);
    assert!((belt.follow(1.0, 100.0) - 0.999).abs() < 1e-12);
    // Ten time constants later without a move, nothing of it is left.
    assert!((belt.follow(1.0, 200.0) - 1.0).abs() < 1e-7);
    assert!((belt.follow(-1.0, 300.0) + 0.998).abs() < 1e-6);
}

#[test]
fn detents_hold_back_as_much_as_they_push_ahead() {
    let detents = Detents::new(0, 0.002, 0.1, [-2.0, 2.0], 5);
    let errors: Vec<f64> =
        (0..4000).map(|step| detents.error(-1.9 + 0.00095 * f64::from(step), 1.0)).collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    assert!(mean.abs() < 1e-5, "{mean}");
    assert!(errors.iter().all(|error| error.abs() <= 0.002 + 1e-12));
}

#[test]
fn heat_and_time_change_the_shape_as_they_should() {
    let arm = pendulum();
    let warm = Conditions { temperature_c: 30.0, ..QUIET };
    let grown = equilibrium(&arm, &[(Mechanism::ThermalGrowth { joint: 1 }, 1.2e-5)], &[0.0, 0.0], &warm);
    assert!((grown.link_frames.target.x - 500.0 * (1.0 + 1.2e-4)).abs() < 1e-9);
    let mechanism = Mechanism::WarmUp { joint: 1, of: Warming::Length, time_constant_s: 600.0 };
    let later = Conditions { time_s: 600.0, ..QUIET };
    let warmed = equilibrium(&arm, &[(mechanism, 0.5)], &[0.0, 0.0], &later);
    assert!((warmed.link_frames.target.x - 500.0 - 0.5 * (1.0 - (-1.0_f64).exp())).abs() < 1e-9);
}

#[test]
fn a_joint_that_jumped_stays_where_it_is() {
    let arm = pendulum();
    let lost = [Imperfection { mechanism: Mechanism::JointStep { joint: 0, at_s: 50.0 }, size: 0.01 }];
    let mut machine = Machine::new(&arm, &lost);
    let mut angle = |time_s: f64| {
        machine.go(&[0.3, 0.0], time_s);
        machine.equilibrium(&QUIET).unwrap().angles[0]
    };
    assert_eq!([angle(10.0), angle(49.0)], [0.3, 0.3]);
    assert_eq!([angle(50.0), angle(900.0)], [0.31, 0.31]);
}

#[test]
fn gravity_moments_are_the_slope_of_the_potential_energy() {
    for (name, _) in arms::ARMS {
        let arm = arms::by_name(name).unwrap().unwrap();
        let body = Shape::nominal(&arm).arm();
        let mut random = Random::new(3, name);
        let angles: Vec<f64> = arm.joints.iter().map(|_| random.between(-1.5, 1.5)).collect();
        let payload = 0.7;
        let energy = |angles: &[f64]| {
            let link_frames = body.link_frames(angles, &[], plumb_simulated::physics::rigid::Rigid::IDENTITY);
            let all = body.loads(&link_frames, payload)[0];
            GRAVITY * all.first_moment.z * 1e-3
        };
        let link_frames = body.link_frames(&angles, &[], plumb_simulated::physics::rigid::Rigid::IDENTITY);
        let moments = body.gravity_moments(&link_frames, &body.loads(&link_frames, payload));
        for joint in 0..angles.len() {
            let moved = |by: f64| {
                let mut angles = angles.clone();
                angles[joint] += by;
                energy(&angles)
            };
            let slope = -(moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!(
                (moments[joint] - slope).abs() < 1e-5,
                "{name}, joint {joint}: {} against {slope}",
                moments[joint]
            );
        }
    }
}

#[test]
fn every_arm_of_the_program_can_be_read() {
    for (name, _) in arms::ARMS {
        let arm = arms::by_name(name).unwrap().unwrap();
        assert_eq!(arm.name, name);
        assert!(!arm.weights.is_empty(), "{name} has no weights, so gravity would not show");
    }
    assert!(arms::by_name("hal").is_none());
}

/// Two level links of 400 and 300 mm with 2 and 1 kg at their ends, and what yields in their drives.
fn two_links(transmission: Transmission) -> Machine {
    let text = "arm: links\nconvention: distal\njoints:\n  - {name: post, alpha_deg: 90}\n  - {name: upper, a_mm: 400}\n  - {name: fore, a_mm: 300}\n\
                links:\n  - {after: upper, mass_kg: 2, centre_mm: [0, 0, 0]}\n  - {after: fore, mass_kg: 1, centre_mm: [0, 0, 0]}\ntargets: {p1: {}}\n";
    let arm = ArmDescription { transmission, ..ArmDescription::from_yaml(text).unwrap() };
    let imperfections = [
        (Mechanism::JointBacklash { joint: 1 }, 0.02),
        (Mechanism::CableDrag { joint: 2, driver: 1 }, 0.05),
        (Mechanism::JointCompliance { joint: 1 }, 0.001),
        (Mechanism::JointCompliance { joint: 2 }, 0.002),
    ];
    let imperfections = imperfections.map(|(mechanism, size)| Imperfection { mechanism, size });
    Machine::new(&arm, &imperfections)
}

/// Cables that hold the forearm's attitude: its joint turns by what the upper arm does not.
fn attitudes() -> Transmission {
    let rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 1.0]];
    Transmission::Matrix(rows.map(Vec::from).to_vec())
}

#[test]
fn a_drive_that_holds_an_attitude_takes_its_moment_past_the_joint_before() {
    let sag = |transmission| {
        let mut machine = two_links(transmission);
        machine.go(&[0.0; 3], 0.0);
        machine.equilibrium(&QUIET).unwrap().drives
    };
    let balance = |lever: f64, give: f64, att: f64| give * GRAVITY * lever * att.cos();
    let held = sag(attitudes());
    assert!((held[1] + balance(3.0 * 0.4, 0.001, held[1])).abs() < 1e-12, "only the weight at its own end");
    assert!((held[2] + balance(0.3, 0.002, held[2])).abs() < 1e-12);
    let direct = sag(Transmission::Direct);
    let forearm = balance(0.3, 0.001, direct[1] + direct[2]);
    assert!(
        (direct[1] + balance(3.0 * 0.4, 0.001, direct[1]) + forearm).abs() < 1e-12,
        "the forearm's moment too"
    );
}

#[test]
fn a_copy_of_a_machine_remembers_its_play_and_goes_its_own_way() {
    let mut machine = two_links(attitudes());
    machine.go(&[0.0; 3], 0.0);
    machine.go(&[0.0, 0.5, 0.0], 1.0);
    let mut copy = machine.clone();
    copy.go(&[0.0, 0.485, 0.0], 2.0);
    assert_eq!(copy.driven()[1], 0.49, "within the gap it rests where the first machine came to");
    copy.go(&[0.0, 0.1, 0.0], 3.0);
    assert!((copy.driven()[1] - 0.11).abs() < 1e-15);
    assert_eq!(machine.driven()[1], 0.49);
    assert!((machine.driven()[2] - 0.05 * 0.49).abs() < 1e-15, "what is behind the play drags the cable");
}

#[test]
fn the_command_for_a_state_of_the_arm_leads_there() {
    let load = Conditions { payload_kg: 0.7, ..QUIET };
    for goal in [[0.3, -0.4, 0.9], [0.0, 0.0, 0.0], [-1.2, 1.1, -0.6]] {
        let mut machine = two_links(attitudes());
        machine.go(&machine.command_for(&goal, &load), 0.0);
        let arm_state = machine.equilibrium(&load).unwrap();
        for (drive, goal) in arm_state.drives.iter().zip(goal) {
            assert!((drive - goal).abs() < 1e-13, "{drive} {goal}");
        }
        let stiff = machine.stiff(&goal);
        assert!((stiff.link_frames.target - arm_state.link_frames.target).norm() < 1e-9);
    }
}
