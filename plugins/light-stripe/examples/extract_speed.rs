//! How long a picture takes, in rounds that another program may interleave with its own: `against_opencv.py` does.
//!
//! `extract_speed FOLDER` reads the pictures of a folder once, then for every line on its standard input works on all of them, one after the
//! other in one thread, and prints the microseconds of each: `centroid` or `binary` (threshold to centreline), `read` (the brightest pixel, as
//! quickly as the memory gives them away), or `points` (millions of points a second through the collineation).

use std::error::Error;
use std::hint::black_box;
use std::io::{BufRead, Write, stdin, stdout};
use std::path::Path;
use std::time::Instant;

use nalgebra::{Isometry3, Vector3};
use plumb_light_stripe::extract::{Centre, Extractor, Settings, Threshold, instruction_set};
use plumb_light_stripe::frame::read_picture;
use plumb_light_stripe::geometry::{Camera, Collineation, Distortion, StripePlane};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("give the folder of pictures")?;
    let mut paths = std::fs::read_dir(Path::new(&folder))?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<Vec<_>, _>>()?;
    paths.sort();
    let pictures = paths.iter().map(|path| read_picture(path, None)).collect::<Result<Vec<_>, _>>()?;
    let mut extractor = Extractor::new();
    println!("{}", instruction_set().name());
    for line in stdin().lock().lines() {
        let what = line?;
        if what == "points" {
            println!("{}", points_a_second()? / 1e6);
            stdout().flush()?;
            continue;
        }
        let centre = if what == "binary" { Centre::Binary } else { Centre::Centroid };
        let settings = Settings { threshold: Threshold::Fixed(60), centre, ..Settings::default() };
        let mut times = Vec::new();
        for picture in &pictures {
            let image = picture.image()?;
            let begin = Instant::now();
            if what == "read" {
                black_box(image.pixels().iter().fold(0, |brightest: u8, pixel| brightest.max(*pixel)));
            } else {
                // A frame in which no stripe is found costs what it costs.
                let _ = black_box(extractor.extract(&image, &settings).map(|profile| profile.points.len()));
            }
            times.push(format!("{:.3}", begin.elapsed().as_secs_f64() * 1e6));
        }
        println!("{}", times.join(" "));
        stdout().flush()?;
    }
    Ok(())
}

fn points_a_second() -> Result<f64, Box<dyn Error>> {
    let camera = Camera {
        width_px: 1280,
        height_px: 1024,
        fx_px: 2400.0,
        fy_px: 2400.0,
        cx_px: 640.0,
        cy_px: 512.0,
        distortion: Distortion::default(),
    };
    let plane = StripePlane::new(Vector3::new(0.95, 0.0, 0.31), -100.0).ok_or("no plane")?;
    let k = Collineation::from_plane(&Isometry3::identity(), &camera.ray_from_pixel(), &plane)?;
    let u: Vec<f32> = (0..1024).map(|row| 600.0 + 0.1 * row as f32).collect();
    let v: Vec<f32> = (0..1024).map(|row| row as f32).collect();
    let (mut x, mut y, mut z) = (vec![0.0_f32; 1024], vec![0.0_f32; 1024], vec![0.0_f32; 1024]);
    let begin = Instant::now();
    for _ in 0..20_000 {
        k.points(black_box(&u), black_box(&v), &mut x, &mut y, &mut z);
        black_box((&x, &y, &z));
    }
    Ok(20_000.0 * 1024.0 / begin.elapsed().as_secs_f64())
}
