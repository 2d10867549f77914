//! How long a stop takes at 9600 baud: from the stop being rung, as a key rings it, to the last half-step of the emulated controller.
//!
//! The whole way is in these figures: the bell on the bus, the host process, the plugin, and a pseudo-terminal whose bytes keep the line's
//! time. Stops come at random moments of long moves. Run on a machine that has nothing else to do:
//!
//! ```console
//! $ cargo build --release && cargo run --release -p plumb --example stop_latency -- 200
//! ```

use std::error::Error;
use std::path::Path;
use std::time::{Duration, Instant};

use plumb_bus::{Bus, Domain};
use plumb_host::{HostArguments, HostCommand, HostProcess, Plugin, RobotClient, StopHandle};
use plumb_plugin::Motion;
use plumb_simulated::emulate::teachmover::{BareMotors, Emulator, EmulatorOptions};
use plumb_simulated::physics::random::Random;
use serde_json::json;

/// The gripper's place among the joints: the one in mm.
const GRIPPER: usize = 5;

/// The moves that are stopped: what to call them, and by how much each joint goes (degrees, and mm).
const MOVES: [(&str, [f64; 6]); 3] = [
    ("one joint", [60.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    ("three joints", [50.0, 30.0, -40.0, 0.0, 0.0, 0.0]),
    ("six joints", [50.0, 30.0, -40.0, 30.0, 60.0, 20.0]),
];

/// Where the arm stands when the controller is switched on: degrees, and mm.
const HOME: [f64; 6] = [0.0, 0.0, -45.0, -60.0, 0.0, 30.0];

/// How long after a stop the last half-step is looked for.
const SETTLED: Duration = Duration::from_millis(300);

/// Longer than any of these moves takes.
const LONG: Duration = Duration::from_secs(60);

/// What became of the stops of one kind of move.
struct Figures {
    /// From the stop to the last half-step; zero where none came after it.
    latencies: Vec<Duration>,
    turned: Duration,
    elapsed: Duration,
}

fn main() -> Result<(), Box<dyn Error>> {
    let stops = std::env::args().nth(1).map_or(Ok(100), |count| count.parse())?;
    println!("{stops} stops each, 9600 baud, speed code 220, pieces cut for a stop within 100 ms");
    println!("{:<14}{:>9}{:>9}{:>9}{:>9}{:>18}", "move", "median", "95 %", "worst", "<= 100", "share moving");
    let mut random = Random::new(1, "moments of stops");
    for (name, by) in MOVES {
        let figures = Bench::start()?.measure(by, stops, &mut random)?;
        print(name, figures);
    }
    Ok(())
}

/// A controller, and the driver in its host.
struct Bench {
    emulator: Emulator,
    host: HostProcess,
    robot: RobotClient,
    domain: Domain,
    _folder: tempfile::TempDir,
}

impl Bench {
    fn start() -> Result<Self, Box<dyn Error>> {
        let options = EmulatorOptions { baud: Some(9600), ..EmulatorOptions::default() };
        let emulator = Emulator::start(options, Box::new(BareMotors::new(false, 40.0)))?;
        let folder = tempfile::tempdir()?;
        let domain =
            Domain::new(&format!("plumbstop_{}_", std::process::id()), &folder.path().join("domain"))?;
        let bus = Bus::open(&domain, "stop latency")?;
        let mut arguments = HostArguments::new("arm", &domain, &plugin()?);
        let [waist_deg, shoulder_deg, elbow_deg, wrist_pitch_deg, wrist_roll_deg, gripper_mm] = HOME;
        arguments.config = json!({
            "port": emulator.standing().port,
            "registers_zero": {
                "waist_deg": waist_deg, "shoulder_deg": shoulder_deg, "elbow_deg": elbow_deg,
                "wrist_pitch_deg": wrist_pitch_deg, "wrist_roll_deg": wrist_roll_deg, "gripper_mm": gripper_mm,
            },
        });
        let program = std::env::current_exe()?.with_file_name("../plumb");
        let host = HostProcess::spawn(&bus, &arguments, HostCommand::new(program, ["host"]))?;
        let robot = host.robot()?;
        Ok(Self { emulator, host, robot, domain, _folder: folder })
    }

    fn measure(self, by: [f64; 6], stops: usize, random: &mut Random) -> Result<Figures, Box<dyn Error>> {
        let mut figures = Figures { latencies: Vec::new(), turned: Duration::ZERO, elapsed: Duration::ZERO };
        for _ in 0..stops {
            let wait = Duration::from_secs_f64(random.between(0.15, 1.2));
            self.stop_once(by, wait, &mut figures)?;
        }
        figures.latencies.sort();
        let Self { emulator, host, robot, domain, .. } = self;
        drop(robot);
        host.finish(LONG);
        emulator.stop()?;
        domain.remove()?;
        Ok(figures)
    }

    fn stop_once(&self, by: [f64; 6], wait: Duration, figures: &mut Figures) -> Result<(), Box<dyn Error>> {
        self.robot.activate()?;
        let motion = motion(by, &self.robot)?;
        let before = self.emulator.standing().turned;
        let began = Instant::now();
        let stopper = stop_after(wait, self.host.stop_handle()?);
        let stopped = self.robot.move_joints(&motion, LONG);
        figures.elapsed += began.elapsed();
        let asked = stopper.join().map_err(|_| "the stopper panicked")?;
        match stopped {
            Err(error) if error.is_stopped() => {}
            other => return Err(format!("the move was not stopped: {other:?}").into()),
        }
        std::thread::sleep(SETTLED);
        let standing = self.emulator.standing();
        figures.turned += standing.turned.saturating_sub(before);
        let last = standing.last_half_step.ok_or("nothing moved")?;
        figures.latencies.push(last.saturating_duration_since(asked));
        Ok(())
    }
}

/// Rings the stop after a while, and tells when.
fn stop_after(wait: Duration, stop: StopHandle) -> std::thread::JoinHandle<Instant> {
    std::thread::spawn(move || {
        std::thread::sleep(wait);
        let asked = Instant::now();
        stop.ring();
        asked
    })
}

fn plugin() -> Result<Plugin, Box<dyn Error>> {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("../plugins/teachmover/plugin.yaml");
    let library = std::env::current_exe()?.with_file_name("../deps/libplumb_teachmover.so");
    Ok(Plugin::at_library(&manifest, &library)?)
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

fn print(name: &str, figures: Figures) {
    let at = |share: f64| {
        let place = ((figures.latencies.len() as f64 * share).ceil() as usize).saturating_sub(1);
        figures.latencies.get(place).copied().unwrap_or_default()
    };
    let within = figures.latencies.iter().filter(|latency| **latency <= Duration::from_millis(100)).count();
    println!(
        "{name:<14}{:>6.1} ms{:>6.1} ms{:>6.1} ms{:>7.1} %{:>16.1} %",
        ms(at(0.5)),
        ms(at(0.95)),
        ms(at(1.0)),
        100.0 * within as f64 / figures.latencies.len().max(1) as f64,
        100.0 * figures.turned.as_secs_f64() / figures.elapsed.as_secs_f64(),
    );
}

fn ms(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}
