//! A robot that reports its state a thousand times a second, a sensor that takes it in, and an orchestrator that watches.

use std::fs;
use std::time::{Duration, Instant};

use plumb_bus::ReceiveError;
use plumb_host::WiredInput;
use plumb_plugin::{JointState, JointVector, Motion};
use serde_json::json;

use crate::parts::{TestFolder, plugin, steady_robot};
use crate::{LONG, Measured};

pub(crate) fn measure(count: usize) -> Measured {
    let folder = TestFolder::new()?;
    let steady = steady_robot()?;
    let stream = |name: &str| {
        let found = steady.manifest.streams.iter().find(|stream| stream.name == name).cloned();
        found.ok_or_else(|| format!("no stream {name}"))
    };
    let robot_host = folder.host("arm", &steady, serde_json::Value::Null, Vec::new())?;
    let line = WiredInput { input: "line".to_owned(), device: "arm".to_owned(), stream: stream("inputs")? };
    let sensor_host = folder.host("eye", &plugin("ir-proximity")?, json!({"bit": 0}), vec![line])?;
    let (robot, sensor) = (robot_host.robot()?, sensor_host.sensor()?);
    let mut subscriber = folder.bus()?.subscriber("arm", &stream("joints")?)?;
    let bell = folder.bus()?.stream_listener("arm", &stream("joints")?)?;
    robot.activate()?;
    sensor.activate()?;
    sensor.arm()?;
    let processes = [std::process::id(), robot_host.process(), sensor_host.process()];
    let before = processes.map(processor_time);
    let began = Instant::now();
    let mut motion = Motion::relative(JointVector::zeros(1), 1.0);
    motion.target.set(0, count as f64);
    let limit = Duration::from_millis(count as u64) + LONG;
    let (mut received, mut lost) = (0_u64, 0_u64);
    let ended = std::thread::scope(|scope| {
        let moving = scope.spawn(|| robot.move_joints(&motion, limit));
        loop {
            let finished = moving.is_finished();
            let waited = bell.wait(Duration::from_millis(50));
            loop {
                match subscriber.receive::<JointState>() {
                    Ok(Some(_)) => received += 1,
                    Ok(None) => break,
                    Err(ReceiveError::Lost { count, .. }) => lost += count,
                    Err(error) => return Err(error.to_string()),
                }
            }
            waited.map_err(|error| error.to_string())?;
            if finished {
                let moved = moving.join().map_err(|_| "the mover panicked".to_owned())?;
                return moved.map_err(|error| error.to_string());
            }
        }
    })?;
    let took = began.elapsed();
    // It has seen every message up to the end of the move, or this is an error.
    sensor.read(ended.time_ns, LONG)?;
    let after = processes.map(processor_time);
    println!("messages watched by the orchestrator {received}, lost {lost}; none lost at the sensor");
    println!(
        "{:.0} messages a second over {:.1} s",
        received as f64 / took.as_secs_f64(),
        took.as_secs_f64()
    );
    for (name, (before, after)) in
        ["orchestrator", "robot's host", "sensor's host"].iter().zip(before.iter().zip(after))
    {
        let fraction = 100.0 * after.saturating_sub(*before).as_secs_f64() / took.as_secs_f64();
        println!("{name:<16}{fraction:>7.1} % of a core");
    }
    drop((robot, sensor, subscriber, bell));
    sensor_host.finish(LONG);
    robot_host.finish(LONG);
    Ok(())
}

/// What a process has had of the processor so far.
fn processor_time(process: u32) -> Duration {
    // In ticks of a hundredth of a second: the 14th and 15th word, counted from after the name.
    let text = fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    let words = text.rsplit_once(')').map(|(_, rest)| rest.split_whitespace()).into_iter().flatten();
    let ticks: u64 = words.skip(11).take(2).filter_map(|word| word.parse::<u64>().ok()).sum();
    Duration::from_millis(10 * ticks)
}
