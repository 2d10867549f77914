//! The sensor's arithmetic against pictures the simulated world takes: what is measured lies on the surfaces that were there.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use plumb_light_stripe::extract::{Extractor, Image, NoStripe, Noise, Pieces, Settings, Threshold};
use plumb_light_stripe::geometry::{Camera, Collineation, Distortion, Rig, StripePlane};
use plumb_simulated::light::file::read_light;
use plumb_simulated::light::surface::{Form, Surface, pose};
use plumb_simulated::light::{Light, Switches};
use plumb_simulated::physics::rigid::{Rigid, Vector};

const ON: Switches = Switches { laser: true, filter: true };

/// The flange looks down from here: its x ahead, its z at the table, mm and deg.
const DOWN: [f64; 3] = [180.0, 0.0, 0.0];

fn light(text: &str) -> Light {
    read_light(std::path::Path::new("light.yaml"), text, 1).unwrap()
}

fn paper() -> Light {
    light(include_str!("data/paper.light.yaml"))
}

fn modern() -> Light {
    light(include_str!("data/modern.light.yaml"))
}

/// The rig as drawings have it: the sensor's own geometry, from the same numbers.
fn drawn(light: &Light) -> Rig {
    let [fx_px, fy_px] = light.camera.focal;
    let [cx_px, cy_px] = light.camera.principal;
    let ([k1, k2, k3], [p1, p2]) = (light.camera.radial, light.camera.decentring);
    let (width_px, height_px) = (light.camera.width as u32, light.camera.height as u32);
    let toward = (100.0_f64 / 300.0).atan();
    let normal = Vector3::new(toward.cos(), 0.0, toward.sin());
    let flange_from_camera =
        Isometry3::from_parts(Translation3::new(-30.0, 0.0, 60.0), UnitQuaternion::identity());
    Rig {
        contains: Default::default(),
        name: "drawn".to_owned(),
        camera: Camera {
            width_px,
            height_px,
            fx_px,
            fy_px,
            cx_px,
            cy_px,
            distortion: Distortion { k1, k2, p1, p2, k3 },
        },
        flange_from_camera,
        plane: StripePlane::new(normal, -normal.dot(&Vector3::new(70.0, 0.0, 60.0))).unwrap(),
        bow_per_mm: 0.0,
    }
}

fn settings(light: &Light) -> Settings {
    let noise = Noise {
        dark: light.camera.dark_noise as f32,
        per_level: light.camera.noise_per_level as f32,
        speckle_px: 0.0,
    };
    Settings {
        threshold: Threshold::Fixed(30),
        noise,
        pieces: Pieces::All,
        least_rows: 4,
        ..Settings::default()
    }
}

/// A measured point and its standard uncertainty, mm.
type Measured = (Point3<f64>, f64);

fn measure(
    light: &Light,
    rig: &Rig,
    world_from_flange: &Rigid,
    number: u64,
) -> Result<Vec<Measured>, NoStripe> {
    let picture = light.picture(world_from_flange, ON, number);
    let image = Image::new(picture.width, picture.height, &picture.pixels).unwrap();
    let mut extractor = Extractor::new();
    let profile = extractor.extract(&image, &settings(light))?;
    let k: Collineation = rig.collineation().unwrap();
    let points = profile.points.iter().map(|point| {
        let pixel =
            rig.camera.straighten(Vector2::new(f64::from(point.centre), f64::from(point.row))).unwrap();
        let in_flange = k.point(pixel).unwrap();
        let sigma = k.per_column(pixel).unwrap().norm() * f64::from(point.sigma);
        let in_world = world_from_flange.apply(Vector::new(in_flange.x, in_flange.y, in_flange.z));
        (Point3::new(in_world.x, in_world.y, in_world.z), sigma)
    });
    Ok(points.collect())
}

fn over(x: f64, y: f64, z: f64) -> Rigid {
    pose([x, y, z], DOWN.map(f64::to_radians))
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = values.map(|value| value * value).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn a_plane_is_measured_to_what_each_point_says_of_itself() {
    for (light, most) in [(paper(), 0.1), (modern(), 0.1)] {
        let rig = drawn(&light);
        let points = measure(&light, &rig, &over(300.0, 0.0, 360.0), 1).unwrap();
        assert!(points.len() * 10 > light.camera.height * 9, "{} points", points.len());
        let scatter = rms(points.iter().map(|(point, _)| point.z));
        let message = rms(points.iter().map(|(_, sigma)| *sigma));
        println!("{} rows: {scatter:.4} mm from the plane, the points say {message:.4}", light.camera.height);
        assert!(scatter < most, "{scatter} mm");
        if light.projector.speckle == 0.0 {
            assert!((0.6..1.6).contains(&(message / scatter)), "{message} against {scatter}");
        }
    }
}

#[test]
fn a_bent_lens_is_undone_before_the_collineation() {
    let mut light = modern();
    light.projector.speckle = 0.0;
    light.camera.radial = [-0.08, 0.02, 0.0];
    light.camera.decentring = [0.001, -0.0005];
    let rig = drawn(&light);
    let mut straight = rig.clone();
    straight.camera.distortion = Distortion::default();
    let away = |rig: &Rig| {
        rms(measure(&light, rig, &over(300.0, 0.0, 330.0), 1).unwrap().iter().map(|(point, _)| point.z))
    };
    let (with, without) = (away(&rig), away(&straight));
    assert!(with < 0.03 && without > 4.0 * with, "{with} mm with, {without} mm without");
}

#[test]
fn points_lie_on_step_pyramid_and_sphere() {
    let surface = |form: Form| Surface { form, reflectance: 0.6, spot: None };
    let apex = Vector::new(300.0, 0.0, 60.0);
    let (centre, radius) = (Vector::new(300.0, 0.0, 40.0), 40.0);
    type Distance = Box<dyn Fn(Point3<f64>) -> f64>;
    let cases: [(&str, Form, Distance); 3] = [
        (
            "step",
            Form::block(Vector::new(300.0, 0.0, 15.0), [120.0, 40.0, 30.0], 0.0),
            Box::new(|point| if point.y.abs() < 20.0 { point.z - 30.0 } else { point.z }),
        ),
        (
            "pyramid",
            Form::pyramid(apex, 90.0, 60.0, 0.3),
            Box::new(move |point| {
                let (sine, cosine) = 0.3_f64.sin_cos();
                let (x, y) = (point.x - 300.0, point.y);
                let out = (x * cosine + y * sine).abs().max((y * cosine - x * sine).abs());
                let to_face = (out * 60.0 + (point.z - 60.0) * 45.0) / 75.0;
                if point.z.abs() < to_face.abs() { point.z } else { to_face }
            }),
        ),
        (
            "sphere",
            Form::Sphere { centre, radius },
            Box::new(move |point| {
                let to_ball = (point - Point3::new(centre.x, centre.y, centre.z)).norm() - radius;
                if to_ball.abs() < point.z.abs() { to_ball } else { point.z }
            }),
        ),
    ];
    for (name, form, distance) in cases {
        let mut light = paper();
        light.surfaces.push(surface(form));
        let rig = drawn(&light);
        let (mut all, mut raised) = (Vec::new(), 0);
        for step in 0..12 {
            let x = 270.0 + 5.0 * f64::from(step);
            for (point, _) in measure(&light, &rig, &over(x, 3.0, 360.0), step as u64).unwrap() {
                raised += usize::from(point.z > 5.0);
                all.push(distance(point));
            }
        }
        let scatter = rms(all.iter().copied());
        let worst = all.iter().fold(0.0_f64, |worst, away| worst.max(away.abs()));
        println!("{name}: {} points, {raised} on it, {scatter:.3} mm rms, worst {worst:.2} mm", all.len());
        assert!(raised > 300, "{name}: {raised}");
        assert!(scatter < 0.25, "{name}: {scatter} mm");
    }
}

#[test]
fn a_hidden_part_of_the_stripe_is_not_seen() {
    let mut light = paper();
    // A wall between the lens and the light on the table.
    let wall = Form::block(Vector::new(285.0, 0.0, 60.0), [2.0, 30.0, 120.0], 0.0);
    light.surfaces.push(Surface { form: wall, reflectance: 0.0, spot: None });
    let points = measure(&light, &drawn(&light), &over(300.0, 0.0, 360.0), 1).unwrap();
    assert!(points.iter().all(|(point, _)| point.y.abs() > 10.0), "behind the wall nothing is seen");
    assert!(
        points.iter().any(|(point, _)| point.y > 20.0) && points.iter().any(|(point, _)| point.y < -20.0)
    );
}

#[test]
fn without_the_filter_the_room_swamps_the_stripe_and_the_laser_off_leaves_dark() {
    let light = paper();
    let see = |switches: Switches| {
        let picture = light.picture(&over(300.0, 0.0, 360.0), switches, 1);
        let image = Image::new(picture.width, picture.height, &picture.pixels).unwrap();
        Extractor::new().extract(&image, &settings(&light)).map(|_| ())
    };
    assert_eq!(see(ON), Ok(()));
    assert!(matches!(see(Switches { filter: false, ..ON }), Err(NoStripe::Bright { .. })));
    assert!(matches!(see(Switches { laser: false, ..ON }), Err(NoStripe::Dark { .. })));
}

#[test]
fn the_same_exposure_is_the_same_picture_and_another_is_not() {
    let light = modern();
    let take = |number| light.picture(&over(300.0, 0.0, 360.0), ON, number).pixels;
    assert!(take(1) == take(1));
    assert!(take(1) != take(2));
}
