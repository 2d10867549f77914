//! A UR5 through the whole program: its driver reads RTDE and sends URScript, to an emulated controller over the arm of a simulated world.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::WorldCommand;

const PATIENCE: Duration = Duration::from_secs(60);

/// A user's copy of the shipped cell.
struct Cells {
    folder: tempfile::TempDir,
}

impl Drop for Cells {
    /// Puts away what a run that can be resumed keeps.
    fn drop(&mut self) {
        for cell in ["cell-rtde.yaml", "cell-line.yaml"].map(|cell| self.path(cell)) {
            if cell.exists() {
                self.plumb(&["doctor", "--clean", &cell.display().to_string()]);
            }
        }
    }
}

impl Cells {
    fn shipped() -> Self {
        let cells = Self { folder: tempfile::Builder::new().prefix("plumb-ur5-").tempdir().unwrap() };
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../workcells/ur5");
        fs::create_dir(cells.path("procedures")).unwrap();
        for part in ["", "procedures"] {
            let files = fs::read_dir(from.join(part)).unwrap().flatten();
            for file in files.filter(|file| file.path().is_file()) {
                fs::copy(file.path(), cells.path(part).join(file.file_name())).unwrap();
            }
        }
        cells
    }

    fn path(&self, file: &str) -> PathBuf {
        self.folder.path().join(file)
    }

    fn write(&self, file: &str, text: &str) {
        fs::write(self.path(file), text).unwrap();
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        command.args(arguments).current_dir(self.folder.path()).stdin(Stdio::null());
        command.env("XDG_STATE_HOME", self.path("state")).env("NO_COLOR", "1");
        command
    }

    /// Exit code, and all that was said.
    fn plumb(&self, arguments: &[&str]) -> (Option<i32>, String) {
        let output = self.command(arguments).output().unwrap();
        (output.status.code(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
    }

    /// What a command says that must succeed.
    fn printed(&self, arguments: &[&str]) -> String {
        let (code, printed) = self.plumb(arguments);
        assert_eq!(code, Some(0), "plumb {arguments:?}: {printed}");
        printed
    }

    /// The true error of the tip that a procedure measures, root mean square, mm.
    fn true_error(&self, procedure: &str) -> f64 {
        let printed = self.printed(&["run", "cell-rtde.yaml", procedure, "--headless"]);
        let line = printed.lines().find(|line| line.contains("The error over all ")).unwrap();
        line.split("rms = ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap()
    }
}

/// A program that prints where it listens on its first line.
struct Listening {
    child: Child,
    output: BufReader<ChildStdout>,
    first: String,
}

impl Listening {
    fn start(mut command: Command) -> Self {
        let mut child =
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let output = BufReader::new(child.stdout.take().unwrap());
        Self { child, output, first: String::new() }
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
        line.trim().to_owned()
    }

    fn type_line(&mut self, line: &str) {
        writeln!(self.child.stdin.as_mut().unwrap(), "{line}").unwrap();
    }

    fn wait_until_it_moves(&mut self) {
        let begin = Instant::now();
        loop {
            self.type_line("status");
            if self.line().contains(" moving, ") {
                return;
            }
            assert!(begin.elapsed() < PATIENCE, "the arm does not move");
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

impl Drop for Listening {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The world of the shipped cell and an emulated controller over it, apart from any run.
fn world_and_controller(cells: &Cells) -> (Listening, Listening) {
    let socket = cells.path("world.socket");
    let mut command = cells.command(&["world", "--file", "world.yaml", "--pace", "real", "--socket"]);
    command.arg(&socket);
    let world = Listening::start(command);
    let begin = Instant::now();
    while WorldClient::connect(&socket, "test").is_err() {
        assert!(begin.elapsed() < PATIENCE, "the world does not listen");
        std::thread::sleep(Duration::from_millis(5));
    }
    let mut command = cells.command(&["emulate", "universal-robots", "--world"]);
    command.arg(&socket);
    let mut controller = Listening::start(command);
    controller.first = controller.line();
    (world, controller)
}

#[test]
fn sixty_poses_by_rtde_name_what_the_arm_hides_and_compensated_targets_bring_the_true_error_down() {
    let cells = Cells::shipped();
    let before = cells.true_error("verify");
    // A program's joint targets as its drawing has them: the file that is shipped.
    let export = ["model", "export", "ur5.model.yaml", "--as", "targets", "--poses", "program.csv"];
    let drawn = cells.command(&export).output().unwrap().stdout;
    assert_eq!(String::from_utf8(drawn).unwrap(), fs::read_to_string(cells.path("targets.csv")).unwrap());
    let sent_as_drawn = cells.true_error("send-targets");
    cells.printed(&["run", "cell-rtde.yaml", "measure-tip", "--headless"]);
    let table = cells.printed(&["show", "3", "--table"]);
    let rows =
        table.lines().filter(|line| line.starts_with(|first: char| first.is_ascii_digit() || first == '-'));
    assert_eq!(rows.count(), 60, "{table}");
    cells.write("table.csv", &table);
    let diagnosis = cells.printed(&["model", "diagnose", "ur5.model.yaml", "--data", "table.csv"]);
    let verdict = diagnosis.lines().rev().find(|line| !line.is_empty()).unwrap();
    assert!(verdict.starts_with("NAMED.") && verdict.contains("joint_compliance(lift)"), "{diagnosis}");
    cells.printed(&["model", "grow", "ur5.model.yaml", "--data", "table.csv"]);
    // From now on that revision works out where the joints are sent.
    let after = cells.true_error("verify");
    // And it makes the program's targets anew, which are sent as they are.
    let exported = cells.command(&export).output().unwrap();
    let printed = String::from_utf8(exported.stderr).unwrap();
    assert!(printed.starts_with("20 targets by ur5.model.rev"), "{printed}");
    cells.write("targets.csv", &String::from_utf8(exported.stdout).unwrap());
    let sent_compensated = cells.true_error("send-targets");
    // The tracker's own noise makes 0.087 mm.
    assert!(before > 1.0 && after < 0.12, "{before} mm before, {after} mm after");
    assert!(
        sent_as_drawn > 1.0 && sent_compensated < 0.12,
        "{sent_as_drawn} mm as drawn, {sent_compensated} mm compensated"
    );
}

/// A cell of a real controller's kind: an address, and no world.
fn cell_at(cells: &Cells, address: &str, steps: &str) {
    cells.write(
        "cell-line.yaml",
        &format!(
            "cell: ur5-line\ntitle: UR5 on the network\ndevices:\n  arm: {{plugin: universal-robots, config: {{address: {address}, full_speed_deg_per_s: 30}}}}\nrobots:\n  arm:\n    joints: {{pan: deg, lift: deg, elbow: deg, wrist1: deg, wrist2: deg, wrist3: deg}}\n    model: ur5.model.yaml\nprocedures: [there.yaml]\n"
        ),
    );
    cells.write("there.yaml", &format!("procedure: there\ntitle: A long way and a row\nsteps:\n{steps}"));
}

const A_LONG_WAY: &str = "  - {id: there, do: {move: {robot: arm, to_deg: {pan: 90}, speed: 1}}}
  - {id: row, do: {row: {robot: arm, p1_x_mm: 1, p1_y_mm: 2, p1_z_mm: 3}}}\n";

/// Runs a long move, lets something happen in the middle of it, and gives how it ended.
fn interrupted(cells: &Cells, controller: &mut Listening, event: &str) -> (Option<i32>, String) {
    let run = cells
        .command(&["run", "cell-line.yaml", "--headless"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let run = run.unwrap();
    controller.wait_until_it_moves();
    controller.type_line(event);
    let output = run.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
}

#[test]
fn what_happens_in_mid_move_ends_the_run_with_its_reason_and_leaves_no_row() {
    for (event, words) in [
        ("protective-stop", "the arm is in a protective stop: find out what it ran into"),
        ("emergency-stop", "the robot's emergency stop is pressed"),
        ("stop-program", "the move was ended before the arm arrived"),
        ("gone", "the controller has ended the RTDE connection"),
        ("silence on", "the controller has sent nothing for"),
    ] {
        let cells = Cells::shipped();
        let (_world, mut controller) = world_and_controller(&cells);
        cell_at(&cells, &controller.first.clone(), A_LONG_WAY);
        let (code, printed) = interrupted(&cells, &mut controller, event);
        assert_eq!(code, Some(2), "{event}: {printed}");
        assert!(printed.contains(words), "{event}: {printed}");
        let (_, shown) = cells.plumb(&["show", "1", "--table"]);
        assert!(!shown.contains("1,2,3"), "{event}: {shown}");
        let mut client = WorldClient::connect(&cells.path("world.socket"), "test").unwrap();
        let there =
            |client: &mut WorldClient| client.read(WorldCommand::Read {}).unwrap().joints.as_slice().to_vec();
        // Without anybody who watches it the controller stops the arm a quarter of a second later, by itself.
        std::thread::sleep(Duration::from_secs(1));
        let stopped = there(&mut client);
        assert!(stopped[0].to_degrees() < 80.0, "{event}: {stopped:?}");
        std::thread::sleep(Duration::from_millis(400));
        assert_eq!(there(&mut client), stopped, "{event}: the arm goes on");
    }
}

#[test]
fn a_controller_in_local_control_and_one_that_is_not_there_are_reported_before_anything_moves() {
    let cells = Cells::shipped();
    let (_world, mut controller) = world_and_controller(&cells);
    cell_at(&cells, &controller.first.clone(), A_LONG_WAY);
    controller.type_line("local");
    controller.type_line("status");
    assert!(controller.line().contains("local control"));
    let (code, printed) = cells.plumb(&["run", "cell-line.yaml", "--headless"]);
    assert_eq!(code, Some(2), "{printed}");
    assert!(printed.contains("switch it to remote control, at the top right of the pendant"), "{printed}");
    cell_at(&cells, "127.0.0.1", A_LONG_WAY);
    let (code, printed) = cells.plumb(&["run", "cell-line.yaml", "--headless"]);
    assert_eq!(code, Some(2), "{printed}");
    assert!(
        printed.contains("RTDE of the controller at 127.0.0.1:30004")
            && printed.contains("nothing listens there"),
        "{printed}"
    );
}

#[test]
fn a_cell_says_what_is_wrong_with_its_address() {
    let cells = Cells::shipped();
    cells.write(
        "cell-line.yaml",
        &fs::read_to_string(cells.path("cell-rtde.yaml"))
            .unwrap()
            .replace("config: {", "config: {address: 10.0.0.5, "),
    );
    let (code, printed) = cells.plumb(&["check", "cell-line.yaml"]);
    assert_eq!(code, Some(2), "{printed}");
    assert!(
        printed.contains("the address of an emulated controller is known when it has been started"),
        "{printed}"
    );
    cell_at(&cells, "x, adress: 10.0.0.5", A_LONG_WAY);
    let (_, printed) = cells.plumb(&["check", "cell-line.yaml"]);
    assert!(printed.contains("adress") && printed.contains("did you mean `address`?"), "{printed}");
    cells.printed(&["check", "cell-rtde.yaml"]);
    cells.printed(&["check", "cell-hardware.yaml"]);
}

#[test]
fn the_driver_passes_the_checks_of_plugins_on_its_emulated_controller() {
    let cells = Cells::shipped();
    let (_world, controller) = world_and_controller(&cells);
    let config = format!("{{address: {}}}", controller.first);
    let printed = cells.printed(&["plugins", "check", "universal-robots", "--config", &config, "--move"]);
    assert!(printed.contains("passed   a stop ends a move in time"), "{printed}");
}
