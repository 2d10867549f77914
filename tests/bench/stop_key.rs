//! From Esc in a terminal to the last half-step of the arm, through the whole program: screens, engine, bus, host, driver, line, controller.

use std::error::Error;
use std::io::{Read as _, Write};
use std::time::{Duration, Instant};

use plumb_simulated::client::WorldClient;
use plumb_simulated::physics::random::Random;
use plumb_simulated::protocol::WorldCommand;
use portable_pty::{Child, CommandBuilder, PtySize, native_pty_system};

use crate::LONG;
use crate::parts::{Cells, PROGRAM};

/// How long after Esc the last step is looked for: long enough that a late one shows how late it is.
const SETTLED: Duration = Duration::from_millis(1500);

/// Presses Esc at random moments while the arm of a folder's serial cell moves; the times to the last step of its motors or encoders.
pub(crate) fn stops_by_key(
    folder: &str,
    count: usize,
    random: &mut Random,
) -> Result<Vec<Duration>, Box<dyn Error>> {
    let mut operator = Operator::sit_down(folder)?;
    let mut latencies = Vec::new();
    while latencies.len() < count {
        operator.until_moving()?;
        std::thread::sleep(Duration::from_secs_f64(random.between(0.05, 0.6)));
        latencies.extend(operator.stop()?);
    }
    Ok(latencies)
}

/// How long to wait before `r` is pressed, again and again.
const RESUMED: Duration = Duration::from_millis(200);

/// Somebody before the screens of a run of long moves.
struct Operator {
    child: Box<dyn Child + Send + Sync>,
    keys: Box<dyn Write + Send>,
    world: WorldClient,
    _cells: Cells,
}

impl Operator {
    fn sit_down(folder: &str) -> Result<Self, Box<dyn Error>> {
        let cells = Cells::of(folder)?;
        let moves = "          - {id: out, do: {move: {robot: arm, by_deg: {waist: 60}, speed: 1}}}\n          - {id: back, do: {move: {robot: arm, by_deg: {waist: -60}, speed: 1}}}\n";
        std::fs::write(
            cells.path("procedures/to-and-fro.yaml"),
            format!(
                "procedure: to-and-fro\nfinds_zeros: [arm]\nsteps:\n  - id: many\n    do:\n      repeat:\n        times: 200\n        steps:\n{moves}"
            ),
        )?;
        cells.edit("cell-serial.yaml", "procedures: [", "procedures: [procedures/to-and-fro.yaml, ")?;
        let size = PtySize { rows: 40, cols: 120, ..PtySize::default() };
        let pair = native_pty_system().openpty(size)?;
        let mut command = CommandBuilder::new(PROGRAM);
        command.args(["run", "cell-serial.yaml", "to-and-fro", "--pace", "real"]);
        command.cwd(cells.path("."));
        command.env("XDG_STATE_HOME", cells.path("state"));
        command.env("TERM", "xterm-256color");
        let child = pair.slave.spawn_command(command)?;
        let mut screen = pair.master.try_clone_reader()?;
        std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            while screen.read(&mut bytes).is_ok_and(|count| count > 0) {}
        });
        let keys = pair.master.take_writer()?;
        // Kept open for as long as the program lives.
        std::mem::forget(pair.master);
        let socket = cells.world_socket("cell-serial.yaml")?;
        let began = Instant::now();
        let world = loop {
            match WorldClient::connect(&socket, "bench") {
                Ok(world) => break world,
                Err(error) if began.elapsed() > LONG => return Err(error.into()),
                Err(_) => std::thread::sleep(Duration::from_millis(20)),
            }
        };
        Ok(Self { child, keys, world, _cells: cells })
    }

    fn press(&mut self, key: &str) -> Result<(), Box<dyn Error>> {
        self.keys.write_all(key.as_bytes())?;
        Ok(self.keys.flush()?)
    }

    fn motors(&mut self) -> Result<[f64; 6], Box<dyn Error>> {
        self.world.read(WorldCommand::Read {})?.half_steps.fixed().ok_or_else(|| "no TeachMover".into())
    }

    /// Waits until the arm moves. A run that has not come to rest yet takes no `r`, so that it is pressed again.
    fn until_moving(&mut self) -> Result<(), Box<dyn Error>> {
        let (began, from) = (Instant::now(), self.motors()?);
        let mut pressed = began;
        while self.motors()? == from {
            if began.elapsed() > LONG {
                return Err("the arm does not move".into());
            }
            if pressed.elapsed() > RESUMED {
                self.press("r")?;
                pressed = Instant::now();
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(())
    }

    /// Esc; from there to the last half-step. Nothing when the arm was at rest between two moves.
    fn stop(&mut self) -> Result<Option<Duration>, Box<dyn Error>> {
        let mut former = self.motors()?;
        let pressed = Instant::now();
        self.press("\u{1b}")?;
        let mut last = None;
        while pressed.elapsed() < SETTLED {
            let now = self.motors()?;
            if now != former {
                (former, last) = (now, Some(pressed.elapsed()));
            }
            std::thread::sleep(Duration::from_micros(500));
        }
        Ok(Some(last.unwrap_or_default()))
    }
}

impl Drop for Operator {
    fn drop(&mut self) {
        // Aborted as a person would, so that devices and world go with it.
        for key in ["a", "y"] {
            let _ = self.press(key);
            std::thread::sleep(Duration::from_millis(300));
        }
        let _ = self.press("q");
        let began = Instant::now();
        while began.elapsed() < Duration::from_secs(10) && matches!(self.child.try_wait(), Ok(None)) {
            std::thread::sleep(Duration::from_millis(20));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
