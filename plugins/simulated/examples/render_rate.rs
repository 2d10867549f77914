//! How many pictures a second the world takes, on one core: `render_rate FILE...` with the `light:` of world files.

use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use plumb_simulated::light::Switches;
use plumb_simulated::light::file::read_light;
use plumb_simulated::light::surface::pose;

fn main() -> Result<(), Box<dyn Error>> {
    for file in std::env::args().skip(1) {
        let light = read_light(Path::new(&file), &std::fs::read_to_string(&file)?, 1)?;
        let switches = Switches { laser: true, filter: true };
        let begin = Instant::now();
        let mut pictures = 0;
        while begin.elapsed().as_secs_f64() < 2.0 {
            let over = pose([300.0 + pictures as f64 * 0.1, 0.0, 360.0], [std::f64::consts::PI, 0.0, 0.0]);
            black_box(light.picture(&over, switches, pictures));
            pictures += 1;
        }
        let rate = pictures as f64 / begin.elapsed().as_secs_f64();
        println!("{file}: {} x {}, {rate:.0} pictures a second", light.camera.width, light.camera.height);
    }
    Ok(())
}
