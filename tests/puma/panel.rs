//! What happens at the controller's panel, as a run of the cell sees it: a panic, power gone, the controller started anew.

use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::WorldCommand;
use serde_json::Value;

use super::cells::Cells;

const PATIENCE: Duration = Duration::from_secs(60);

const CELL: &str = "\
cell: panel
devices:
  arm: {plugin: puma, config: {port: port, calibrate: true}}
robots:
  arm:
    joints: {waist: deg, shoulder: deg, elbow: deg, wrist_roll: deg, wrist_bend: deg, flange: deg}
    model: lab.yaml
procedures: [there.yaml]
answers: confirm.yaml
";

const THERE: &str = "\
procedure: there
steps:
  - {id: there, do: {move: {robot: arm, to_deg: {waist: 60, shoulder: -40, elbow: 150, wrist_roll: 90, flange: 45}, speed: 0.5}}}
  - {id: back, do: {move: {robot: arm, to_deg: {waist: 0, shoulder: -90, elbow: 90, wrist_roll: 0, flange: 0}, speed: 1}}}
";

/// A world and a controller of its arm, each a process, and a cell that knows them by a port alone.
pub(crate) struct Panel {
    pub(crate) cells: Cells,
    world: Child,
    socket: PathBuf,
    controller: Child,
}

impl Panel {
    pub(crate) fn new() -> Self {
        let cells = Cells::new();
        cells.write("there.yaml", THERE);
        cells.write("confirm.yaml", "answers: {}\nconfirm_pose: true\n");
        let (socket, port) = (cells.puma().join("world.socket"), cells.puma().join("port"));
        cells.write("cell.yaml", &CELL.replace("port: port", &format!("port: {}", port.display())));
        let mut world = Command::new(env!("CARGO_BIN_EXE_plumb"));
        world.args(["world", "--file", "world.yaml", "--pace", "real", "--socket"]).arg(&socket);
        let world = world.current_dir(cells.puma()).stdin(Stdio::null()).spawn().unwrap();
        let begin = Instant::now();
        while WorldClient::connect(&socket, "panel").is_err() {
            assert!(begin.elapsed() < PATIENCE, "the world does not listen");
            std::thread::sleep(Duration::from_millis(5));
        }
        let mut controller = Command::new(env!("CARGO_BIN_EXE_plumb"));
        controller
            .args(["emulate", "val2", "--as-fast-as-possible", "--world"])
            .arg(&socket)
            .arg("--link")
            .arg(&port);
        let mut controller =
            controller.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(controller.stdout.take().unwrap()).read_line(&mut line).unwrap();
        assert!(!line.trim().is_empty(), "the controller names its port");
        Self { cells, world, socket, controller }
    }

    /// Somebody does something at the panel.
    pub(crate) fn happens(&mut self, event: &str) {
        writeln!(self.controller.stdin.as_mut().unwrap(), "{event}").unwrap();
    }

    /// Where the world's arm is, deg.
    pub(crate) fn joint_angles(&self) -> [f64; 6] {
        let mut client = WorldClient::connect(&self.socket, "panel").unwrap();
        client.read(WorldCommand::Read {}).unwrap().joints.fixed::<6>().unwrap().map(f64::to_degrees)
    }

    /// Runs the cell, and does something at the panel once the arm moves; its exit code, and what it ended with.
    pub(crate) fn run(&mut self, more: &[&str], when_moving: Option<&str>) -> (Option<i32>, String) {
        let mut run = Command::new(env!("CARGO_BIN_EXE_plumb"));
        run.args(["run", "cell.yaml", "--headless", "--json", "--record", "record"]).args(more);
        let mut run =
            run.current_dir(self.cells.puma()).stdin(Stdio::null()).stdout(Stdio::piped()).spawn().unwrap();
        let (mut last, mut event) = (Value::Null, when_moving);
        for line in BufReader::new(run.stdout.take().unwrap()).lines() {
            last = serde_json::from_str(&line.unwrap()).unwrap();
            if last["event"] == "step_started"
                && let Some(event) = event.take()
            {
                self.wait_for_motion();
                self.happens(event);
            }
        }
        (run.wait().unwrap().code(), last["message"].as_str().unwrap_or_default().to_owned())
    }

    fn wait_for_motion(&self) {
        let mut client = WorldClient::connect(&self.socket, "panel").unwrap();
        let begin = Instant::now();
        while !client.read(WorldCommand::Read {}).unwrap().moving {
            assert!(begin.elapsed() < PATIENCE, "the arm does not move");
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

impl Drop for Panel {
    fn drop(&mut self) {
        if let Ok(mut client) = WorldClient::connect(&self.socket, "panel") {
            let _ = client.call(WorldCommand::Shutdown {}, || false, |_| ());
        }
        for child in [&mut self.controller, &mut self.world] {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
