//! How long a stop takes at 9600 baud, to the last half-step of the emulated controller; with a driver that works, hangs, or crashes. From the key in the
//! terminal through both serial drivers.
//!
//! The whole way is in these figures: the bell on the bus, the host process, the plugin, and a pseudo-terminal whose bytes keep the line's
//! time. Stops come at random moments of long moves.

use std::error::Error;
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use plumb_host::{HostProcess, RobotClient, StopHandle, StopOutcome};
use plumb_plugin::Motion;
use plumb_simulated::emulate::teachmover::{BareMotors, Emulator, LineOptions};
use plumb_simulated::physics::random::Random;
use serde_json::json;

use crate::parts::{TestFolder, plugin};
use crate::statistics::{ms, quantile};
use crate::stop_key::stops_by_key;
use crate::{LONG, Measured};

/// The gripper's index among the joints: the one in mm.
const GRIPPER: usize = 5;

/// The moves that are stopped: what to call them, and by how much each joint goes (degrees, and mm).
const MOVES: [(&str, [f64; 6]); 3] = [
    ("one joint", [60.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    ("three joints", [50.0, 30.0, -40.0, 0.0, 0.0, 0.0]),
    ("six joints", [50.0, 30.0, -40.0, 30.0, 60.0, 20.0]),
];

/// Where the arm is when the controller is switched on: degrees, and mm.
const HOME: [f64; 6] = [0.0, 0.0, -45.0, -60.0, 0.0, 30.0];

/// How long after a stop the last half-step is looked for.
const SETTLED: Duration = Duration::from_millis(300);

/// How long a robot may take to confirm a stop before its host is killed: what its plugin states, and the engine's grace.
const CONFIRMED_WITHIN: Duration = Duration::from_millis(500);

/// What became of the stops of one kind of move.
#[derive(Default)]
struct Figures {
    /// From the stop to the last half-step; zero where none came after it.
    latencies: Vec<Duration>,
    turned: Duration,
    elapsed: Duration,
}

pub(crate) fn measure(stops: usize) -> Measured {
    println!("9600 baud, speed code 220, pieces cut for a stop within 100 ms");
    println!("{:<48}{:>9}{:>9}{:>9}{:>9}{:>15}", "", "median", "95 %", "worst", "<= 100", "share moving");
    let mut random = Random::new(1, "moments of stops");
    // What a user does comes first.
    for (name, folder) in [("PUMA over VAL-II", "puma"), ("TeachMover", "teachmover")] {
        let by_key = stops_by_key(folder, stops, &mut random)?;
        let figures = Figures { latencies: by_key, ..Figures::default() };
        print(&format!("Esc in the terminal, one joint, {name}"), figures);
    }
    for (name, by) in MOVES {
        let figures = Bench::start()?.measure(by, stops, &mut random)?;
        print(&format!("stop rung, {name}"), figures);
    }
    for (name, signal) in
        [("plugin hangs, then the stop", Signal::SIGSTOP), ("plugin crashes, no stop", Signal::SIGABRT)]
    {
        let mut figures = Figures::default();
        for _ in 0..stops.div_ceil(3) {
            Bench::start()?.lose_the_host(signal, &mut random, &mut figures)?;
        }
        print(name, figures);
    }
    println!(
        "After each of the last two the host was gone, and no half-step was made in the second that followed."
    );
    Ok(())
}

/// A controller, and the driver in its host.
struct Bench {
    emulator: Emulator,
    host: HostProcess,
    robot: RobotClient,
    _folder: TestFolder,
}

impl Bench {
    fn start() -> Result<Self, Box<dyn Error>> {
        let options = LineOptions { baud: Some(9600), ..LineOptions::default() };
        let emulator = Emulator::start(options, Box::new(BareMotors::new(false, 40.0)))?;
        let folder = TestFolder::new()?;
        let [waist_deg, shoulder_deg, elbow_deg, wrist_pitch_deg, wrist_roll_deg, gripper_mm] = HOME;
        let config = json!({
            "port": emulator.status().port,
            "registers_zero": {
                "waist_deg": waist_deg, "shoulder_deg": shoulder_deg, "elbow_deg": elbow_deg,
                "wrist_pitch_deg": wrist_pitch_deg, "wrist_roll_deg": wrist_roll_deg, "gripper_mm": gripper_mm,
            },
        });
        let host = folder.host("arm", &plugin("teachmover")?, config, Vec::new())?;
        let robot = host.robot()?;
        Ok(Self { emulator, host, robot, _folder: folder })
    }

    /// Lets the driver's host hang or crash in the middle of a move, and stops it.
    fn lose_the_host(self, signal: Signal, random: &mut Random, figures: &mut Figures) -> Measured {
        let Self { emulator, host, robot, _folder } = self;
        robot.activate()?;
        let motion = motion(MOVES[0].1, &robot)?;
        let (stop, process) = (host.stop_handle()?, Pid::from_raw(i32::try_from(host.process())?));
        let wait = Duration::from_secs_f64(random.between(0.3, 1.2));
        let lost = std::thread::spawn(move || {
            std::thread::sleep(wait);
            let asked = Instant::now();
            let sent = kill(process, signal);
            (asked, sent, stop.stop(CONFIRMED_WITHIN))
        });
        let moved = robot.move_joints(&motion, LONG);
        let (asked, sent, outcome) = lost.join().map_err(|_| "the stopper panicked")?;
        sent?;
        if moved.is_ok() || !matches!(outcome, StopOutcome::Killed | StopOutcome::HostGone) {
            return Err(format!("the host lives on: {outcome:?}").into());
        }
        std::thread::sleep(Duration::from_secs(1));
        let last = emulator.status().last_half_step.ok_or("nothing moved")?;
        std::thread::sleep(Duration::from_millis(200));
        if emulator.status().last_half_step != Some(last) {
            return Err("the arm moves although its host is gone".into());
        }
        figures.latencies.push(last.saturating_duration_since(asked));
        drop(robot);
        host.finish(LONG);
        Ok(emulator.stop()?)
    }

    fn measure(self, by: [f64; 6], stops: usize, random: &mut Random) -> Result<Figures, Box<dyn Error>> {
        let mut figures = Figures::default();
        for _ in 0..stops {
            let wait = Duration::from_secs_f64(random.between(0.15, 1.2));
            self.stop_once(by, wait, &mut figures)?;
        }
        let Self { emulator, host, robot, _folder } = self;
        drop(robot);
        host.finish(LONG);
        emulator.stop()?;
        Ok(figures)
    }

    fn stop_once(&self, by: [f64; 6], wait: Duration, figures: &mut Figures) -> Result<(), Box<dyn Error>> {
        self.robot.activate()?;
        let motion = motion(by, &self.robot)?;
        let before = self.emulator.status().turned;
        let began = Instant::now();
        let stopper = stop_after(wait, self.host.stop_handle()?);
        let stopped = self.robot.move_joints(&motion, LONG);
        figures.elapsed += began.elapsed();
        let asked = stopper.join().map_err(|_| "the stopper panicked")?;
        match stopped {
            Err(error) if error.is_stop() => {}
            other => return Err(format!("the move was not stopped: {other:?}").into()),
        }
        std::thread::sleep(SETTLED);
        let status = self.emulator.status();
        figures.turned += status.turned.saturating_sub(before);
        let last = status.last_half_step.ok_or("nothing moved")?;
        figures.latencies.push(last.saturating_duration_since(asked));
        Ok(())
    }
}

/// Rings the stop after a while, and reports when.
fn stop_after(wait: Duration, stop: StopHandle) -> std::thread::JoinHandle<Instant> {
    std::thread::spawn(move || {
        std::thread::sleep(wait);
        let asked = Instant::now();
        stop.request();
        asked
    })
}

/// A move to whichever end of the way is further, so that no move ends before it is stopped.
fn motion(by: [f64; 6], robot: &RobotClient) -> Result<Motion, Box<dyn Error>> {
    let here = robot.read_joints()?.joints;
    let moving: Vec<usize> =
        (0..by.len()).filter(|joint| by.get(*joint).is_some_and(|by| *by != 0.0)).collect();
    let way = |joint: usize| {
        let (from, by) = (HOME.get(joint).copied()?, by.get(joint).copied()?);
        Some(in_units(joint, from)..in_units(joint, from + by))
    };
    let first = moving.first().copied().and_then(|joint| Some((here.get(joint)?, way(joint)?)));
    let (value, range) = first.ok_or("a move of no joint")?;
    let outward = (value - range.start).abs() < (value - range.end).abs();
    let mut target = here;
    for joint in &moving {
        let range = way(*joint).ok_or("a joint the arm has not")?;
        target.set(*joint, if outward { range.end } else { range.start });
    }
    let mask = moving.iter().fold(0, |mask, joint| mask | 1 << joint);
    Ok(Motion::absolute(target, 1.0).only(mask))
}

/// Degrees as rad; the gripper's mm as they are.
fn in_units(joint: usize, value: f64) -> f64 {
    if joint == GRIPPER { value } else { value.to_radians() }
}

fn print(name: &str, mut figures: Figures) {
    let within = figures.latencies.iter().filter(|latency| **latency <= Duration::from_millis(100)).count();
    let within = 100.0 * within as f64 / figures.latencies.len().max(1) as f64;
    let [median, most, worst] =
        [0.5, 0.95, 1.0].map(|fraction| ms(quantile(&mut figures.latencies, fraction)));
    let fraction = match figures.elapsed.is_zero() {
        true => String::new(),
        false => format!("{:.1} %", 100.0 * figures.turned.as_secs_f64() / figures.elapsed.as_secs_f64()),
    };
    println!("{name:<48}{median:>6.1} ms{most:>6.1} ms{worst:>6.1} ms{within:>7.1} %{fraction:>15}");
}
