//! From a camera's frame to points on another process's subscriber: how long it takes, and whether memory stays as it is.

use std::fs;
use std::time::{Duration, Instant};

use plumb_bus::ReceiveError;
use plumb_host::WiredInput;
use plumb_plugin::{FrameHeader, StripeHeader};
use serde_json::json;

use crate::parts::{TestFolder, plugin};
use crate::statistics::{quantile, us};
use crate::{LONG, Measured};

/// The paper's camera, and one of today.
const SIZES: [(u32, u32); 2] = [(256, 256), (1280, 1024)];

/// Pictures that are shown in turn.
const PICTURES: usize = 16;

pub(crate) fn measure(count: usize) -> Measured {
    for (width, height) in SIZES {
        // The larger camera has a twentieth of the pictures: so has it a second.
        let count = if width == 256 { count } else { (count / 20).max(100) };
        of_size(width, height, count)?;
    }
    Ok(())
}

fn of_size(width: u32, height: u32, count: usize) -> Measured {
    let folder = TestFolder::new()?;
    let (camera, sensor) = (plugin("simulated-camera")?, plugin("light-stripe")?);
    let stream = |plugin: &plumb_host::Plugin, name: &str| {
        let found = plugin.manifest.streams.iter().find(|stream| stream.name == name).cloned();
        found.ok_or_else(|| format!("no stream {name}"))
    };
    let (frames, points) = (stream(&camera, "frames")?, stream(&sensor, "points")?);
    let mut publisher = folder.bus()?.publisher("camera", &frames)?;
    let wired = WiredInput { input: "frames".to_owned(), device: "camera".to_owned(), stream: frames };
    let config = json!({"threshold": {"fixed": 60}});
    let host = folder.host("stripe", &sensor, config, vec![wired])?;
    let device = host.sensor()?;
    let mut subscriber = folder.bus()?.subscriber("stripe", &points)?;
    let bell = folder.bus()?.stream_listener("stripe", &points)?;
    device.activate()?;
    device.arm()?;
    let pictures: Vec<Vec<u8>> = (0..PICTURES).map(|number| picture(width, height, number)).collect();
    let (mut times, mut memory) = (Vec::with_capacity(count), Vec::new());
    let tenth = (count / 10).max(1);
    let mut rows = 0;
    for (number, pixels) in pictures.iter().cycle().take(count).enumerate() {
        let header = FrameHeader { time_ns: number as u64 + 1, width, height, ..FrameHeader::default() };
        let mut loan = publisher.loan(header.message_bytes())?;
        header.write(loan.bytes_mut())?.copy_from_slice(pixels);
        let began = Instant::now();
        publisher.send(loan)?;
        let deadline = began + LONG;
        rows = loop {
            let got = subscriber
                .receive_with(|message| StripeHeader::read(message).map(|(_, points)| points.len()));
            match got {
                Ok(Some(rows)) => break rows?,
                Ok(None) if Instant::now() > deadline => return Err("no points came of a picture".into()),
                Ok(None) => {
                    bell.wait(Duration::from_millis(20))?;
                }
                Err(ReceiveError::Lost { .. }) => return Err("points were lost".into()),
                Err(error) => return Err(error.into()),
            }
        };
        times.push(began.elapsed());
        if (number + 1) % tenth == 0 {
            memory.push(resident(host.process()));
        }
    }
    let total: Duration = times.iter().sum();
    let [median, most, worst] = [0.5, 0.95, 1.0].map(|fraction| us(quantile(&mut times, fraction)));
    println!(
        "{width} x {height}: {count} frames, {rows} points each: median {median:.0} us, 95 % within {most:.0} us, worst {worst:.0} us; {:.0} a second",
        count as f64 / total.as_secs_f64()
    );
    let grown = memory.last().zip(memory.first()).map_or(0, |(last, first)| last - first);
    let kilobytes: Vec<String> = memory.iter().map(ToString::to_string).collect();
    println!(
        "    memory of the sensor's host, kB, every tenth of the way: {}; grown by {grown}",
        kilobytes.join(" ")
    );
    drop((device, subscriber, bell, publisher));
    host.finish(LONG);
    Ok(())
}

/// A stripe from top to bottom over dark noise.
fn picture(width: u32, height: u32, number: usize) -> Vec<u8> {
    let mut chance = number as u32 + 1;
    let mut pixels = Vec::with_capacity((width * height) as usize);
    for row in 0..height {
        let middle = 0.4 * f64::from(width) + 0.1 * f64::from(row) + number as f64 / 16.0;
        for column in 0..width {
            chance = chance.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let away = (f64::from(column) - middle) / 1.6;
            let light = 180.0 * (-0.5 * away * away).exp();
            pixels.push(light as u8 + 8 + (chance >> 28) as u8);
        }
    }
    pixels
}

/// Memory a process has, kB.
fn resident(process: u32) -> i64 {
    let text = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap_or_default();
    line.split_whitespace().next().and_then(|number| number.parse().ok()).unwrap_or(0)
}
