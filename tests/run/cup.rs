//! Cup and spoon as the program scans them, held against the forms their world file gives them.

use std::fs;

use crate::lab::Lab;

/// Farther from every surface, mm, a point would be one of none: an average over the jump from one to another.
const BESIDE_MM: f64 = 0.5;

/// A point in a frame that is at `middle` and is turned about the vertical.
fn seen_from(point: [f64; 3], middle: [f64; 3], yaw_deg: f64) -> [f64; 3] {
    let [x, y, z] = [0, 1, 2].map(|axis| point[axis] - middle[axis]);
    let (sine, cosine) = yaw_deg.to_radians().sin_cos();
    [x * cosine + y * sine, y * cosine - x * sine, z]
}

/// How far a point is from a block's surface.
fn from_block(point: [f64; 3], middle: [f64; 3], edges: [f64; 3], yaw_deg: f64) -> f64 {
    let point = seen_from(point, middle, yaw_deg);
    let beyond = [0, 1, 2].map(|axis| point[axis].abs() - edges[axis] / 2.0);
    let outside = beyond.iter().map(|way| way.max(0.0).powi(2)).sum::<f64>().sqrt();
    (outside + beyond.into_iter().fold(f64::NEG_INFINITY, f64::max).min(0.0)).abs()
}

/// How far a point near an ellipsoid is from its surface, to first order.
fn from_ellipsoid(point: [f64; 3], middle: [f64; 3], half_axes: [f64; 3], yaw_deg: f64) -> f64 {
    let point = seen_from(point, middle, yaw_deg);
    let norm = |power: i32| {
        [0, 1, 2].iter().map(|axis| (point[*axis] / half_axes[*axis].powi(power)).powi(2)).sum::<f64>().sqrt()
    };
    (norm(1) * (norm(1) - 1.0) / norm(2)).abs()
}

/// How far a point is from the nearest of the surfaces of `cup.world.yaml`.
fn from_scene([x, y, z]: [f64; 3]) -> f64 {
    let point = [x, y, z];
    let wall = (x.hypot(y - 530.0) - 34.0).hypot((-300.0 - z).max(z + 238.0).max(0.0));
    let handle = [[44.0, 530.0, -252.0], [44.0, 530.0, -284.0]]
        .map(|bar| from_block(point, bar, [22.0, 8.0, 6.0], 0.0));
    let others = [
        (z + 300.0).abs(),
        wall,
        from_ellipsoid(point, [0.0, 530.0, -297.0], [33.5, 33.5, 3.0], 0.0),
        from_block(point, [53.0, 530.0, -268.0], [6.0, 8.0, 36.0], 0.0),
        from_block(point, [12.0, 522.0, -236.5], [96.0, 7.0, 3.0], 12.0),
        from_ellipsoid(point, [-50.0, 508.8, -235.0], [21.0, 14.0, 5.0], 12.0),
    ];
    others.into_iter().chain(handle).fold(f64::INFINITY, f64::min)
}

/// The positions of a cloud's points, mm.
fn points(ply: &[u8]) -> Vec<[f64; 3]> {
    let end = b"end_header\n";
    let head = ply.windows(end.len()).position(|bytes| bytes == end).unwrap() + end.len();
    let properties = String::from_utf8_lossy(&ply[..head]).matches("property float").count();
    let bytes_of_point = 4 * properties + 3;
    let float = |bytes: &[u8]| f64::from(f32::from_le_bytes(bytes.try_into().unwrap()));
    ply[head..]
        .chunks_exact(bytes_of_point)
        .map(|point| [0, 4, 8].map(|at| float(&point[at..at + 4])))
        .collect()
}

#[test]
fn no_point_of_cup_and_spoon_lies_beside_their_surfaces_not_even_at_their_edges() {
    let lab = Lab::of("light-stripe");
    let output = lab.plumb(&["run", "cup.yaml", "scan-cup", "--headless", "--record", "record"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let points = points(&fs::read(lab.path("record/run-1/cup.ply")).unwrap());
    assert!(points.len() > 5000, "{} points", points.len());
    let beside: Vec<_> = points.iter().filter(|point| from_scene(**point) > BESIDE_MM).collect();
    assert!(beside.is_empty(), "{beside:?}");
    let on_the_spoon = points.iter().filter(|[_, _, z]| *z > -237.0).count();
    assert!(on_the_spoon > 200, "{on_the_spoon} points of the spoon");
}

#[test]
fn stripes_are_taken_on_demand_in_one_run_and_a_position_that_cannot_be_read_is_asked_about() {
    let lab = Lab::of("light-stripe");
    lab.write("demand.yaml", "answers:\n  ask: ['60 530 -280', '-20 500 -250 17 90 25', end]\n");
    let run = |answers: &str| {
        lab.plumb(&["run", "cup.yaml", "stripes", "--headless", "--answers", answers, "--record", "record"])
    };
    let output = run("demand.yaml");
    assert_eq!(output.code(), 0, "{}", output.all());
    for stripe in ["stripe.ply", "stripe-2.ply"] {
        assert!(lab.path("record/run-1").join(stripe).exists(), "{stripe}");
    }
    assert!(!lab.path("record/run-1/stripe-3.ply").exists());
    for (asked, expected) in
        [("here", "float"), ("60 530", "three numbers at least"), ("1 2 3 60", "the tilt is 0 to 45")]
    {
        lab.write("wrong.yaml", &format!("answers:\n  ask: ['{asked}', end]\n"));
        let output = run("wrong.yaml");
        assert!(output.code() == 2 && output.all().contains(expected), "{asked}: {}", output.all());
    }
}
