//! Yang and Siegel's initialization, driven step by step through the world's own interface.

use std::path::Path;

use plumb_simulated::world::{AXES, Joint, Joints, LineChange, MotionOrder, World, file};

fn world_file(name: &str) -> World {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../workcells/teachmover").join(name);
    World::new(file::read(&path).unwrap())
}

fn only(joint: Joint, value: f64) -> [Option<f64>; AXES] {
    let mut joints = [None; AXES];
    joints[joint.place()] = Some(value);
    joints
}

fn go(world: &mut World, joints: [Option<f64>; AXES], relative: bool) {
    world.begin(&MotionOrder { joints, relative, speed: 1.0 }).unwrap();
    world.finish_motion();
}

/// Moves one joint, two degrees at a time and by at most `by_deg`, until the line rises or falls, and returns to where it did.
fn search(world: &mut World, joint: Joint, by_deg: f64, rises: bool) -> LineChange {
    let chunk = 2_f64.copysign(by_deg);
    for _ in 0..(by_deg / chunk).ceil() as u32 {
        let before = world.latest_change();
        go(world, only(joint, chunk.to_radians()), true);
        let changes = world.changes_after(before);
        if let Some(found) = changes.into_iter().find(|change| (change.levels & change.changed != 0) == rises)
        {
            go(world, found.joints.0.map(Some), false);
            return found;
        }
    }
    panic!("nothing found within {by_deg} deg of {}: {:?}", joint.name(), world.truth());
}

/// Height of the wrist (Y_wg of the paper, mm) after each cycle of the paper's shoulder and elbow initialization.
fn wrist_heights(world: &mut World, cycles: usize) -> Vec<f64> {
    let back = 5_f64.to_radians();
    let mut heights = Vec::new();
    for _ in 0..cycles {
        search(world, Joint::Shoulder, -40.0, true);
        search(world, Joint::Elbow, -40.0, false);
        heights.push(world.truth().pose.wrist.z);
        let mut away = only(Joint::Shoulder, back);
        away[Joint::Elbow.place()] = Some(back);
        go(world, away, true);
    }
    heights
}

#[test]
fn the_procedure_gives_table_2_1_to_the_last_digit_printed() {
    let mut world = world_file("world-no-table.yaml");
    let heights = wrist_heights(&mut world, 12);
    let limit = heights[11];
    assert!((limit - 116.9583).abs() < 5e-5, "limit {limit}");
    let errors_micron: Vec<f64> = heights.iter().map(|height| (height - limit) * 1e3).collect();
    for (found, (printed, digit)) in errors_micron.iter().zip([
        (-10138.6, 0.1),
        (178.24, 0.01),
        (-5.6352, 0.0001),
        (0.17658, 0.00001),
        (-5.535e-3, 0.001e-3),
        (1.735e-4, 0.001e-4),
        (-5.437e-6, 0.05e-6),
    ]) {
        assert!(
            (found - printed).abs() < 0.51 * digit,
            "found {found}, printed {printed}: {errors_micron:?}"
        );
    }
}

#[test]
fn the_way_of_table_2_1_passes_under_the_table() {
    let mut world = world_file("world-no-table.yaml");
    search(&mut world, Joint::Shoulder, -40.0, true);
    let straight_down = Joints([0.0, 0.0, -std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0]).of(Joint::Elbow);
    go(&mut world, only(Joint::Elbow, straight_down), false);
    let depth = -world.truth().pose.tool.z;
    assert!((depth - 2.7).abs() < 0.05, "{depth} mm under the table");
}
