//! Makes the pictures of the screens: starts the program in a pseudo-terminal, works it as a person would, and draws what
//! the terminal holds.
//!
//! `cargo build --release && cargo run --release -p plumb --example pictures [MODEL TABLE]` writes `tui/pictures/*.svg`.
//! With a model file and a table of measurements, of which copies are used, it also shows how zeros and geometry take the
//! error of that model away. `--model` before them leaves all pages but the Model page out.

#![allow(clippy::expect_used, reason = "a picture that cannot be made ends the program with the reason")]

mod svg;
#[path = "../../../tests/screens/terminal.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod terminal;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;
use terminal::Session;

fn main() -> io::Result<()> {
    let program = std::env::current_exe()?.with_file_name("../plumb");
    let pictures = Path::new(env!("CARGO_MANIFEST_DIR")).join("pictures");
    fs::create_dir_all(&pictures)?;
    let studio = Studio { program, pictures, folder: TempDir::new()? };
    let (options, files): (Vec<_>, Vec<_>) = std::env::args_os().skip(1).partition(|one| one == "--model");
    let arguments: Vec<PathBuf> = files.into_iter().map(std::path::absolute).collect::<Result<_, _>>()?;
    if options.is_empty() {
        studio.initialization()?;
        studio.failed_step()?;
        studio.history()?;
    }
    studio.trial()?;
    match arguments.as_slice() {
        [model, table] => studio.measured(model, table),
        _ => Ok(()),
    }
}

/// Where pictures are made.
struct Studio {
    program: PathBuf,
    pictures: PathBuf,
    /// For the record and copies.
    folder: TempDir,
}

impl Studio {
    /// The simulated TeachMover from the first prompt to the corrections.
    fn initialization(&self) -> io::Result<()> {
        let cell = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../workcells/teachmover/cell.yaml")
            .display()
            .to_string();
        // No picture shows a path of the machine it was made on.
        std::env::set_current_dir(self.folder.path())?;
        let arguments = ["run", &cell, "--record", "record", "--operator", "ada", "--pace", "real"];
        let mut session = Session::start(&self.program, &arguments, 110, 36);
        session.wait_for("Lay the T target on the table");
        session.press("?");
        session.wait_for("Esc stops every robot at once");
        self.keep(&session, "help")?;
        session.press("\r\r");
        session.wait_for("Set the hand with the teach pendant");
        session.press("\r");
        session.wait_for("How far from straight down does it point");
        session.press("\r");
        session.wait_for("Bring the hand over the white paper");
        // What the devices report comes after the question.
        session.wait_for("clear of the table");
        session.wait_for("ruler 0");
        self.keep(&session, "run-prompt")?;
        session.press("z");
        session.wait_until_gone("Steps");
        self.keep(&session, "run-large")?;
        session.press("z");
        session.wait_for("Steps");
        session.press("\r");
        session.wait_for("zero of waist");
        session.press("\r");
        session.wait_for("\u{25b8} 3 Elbow in until line B");
        session.wait_for("Slowly");
        self.keep(&session, "run-search")?;
        session.press("1");
        session.wait_for("Devices");
        self.keep(&session, "cell")?;
        session.press("2");
        session.wait_for("zero of shoulder");
        self.keep(&session, "run-corrections")?;
        session.press("\r");
        session.wait_for("\u{2713} passed");
        self.keep(&session, "run-passed")?;
        session.press("q");
        session.wait_for_end();
        Ok(())
    }

    /// A hand on the wrong side of line A: the search finds nothing, and the run asks what to do.
    fn failed_step(&self) -> io::Result<()> {
        let cell = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../workcells/teachmover/cell.yaml")
            .display()
            .to_string();
        let record = self.folder.path().join("failed").display().to_string();
        let arguments = ["run", &cell, "--record", &record, "--operator", "ada", "--pace", "fast"];
        let mut session = Session::start(&self.program, &arguments, 110, 36);
        for prompt in
            ["Lay the T target", "Set the hand with the teach pendant", "How far from straight down"]
        {
            session.wait_for(prompt);
            session.press("\r");
        }
        session.wait_for("the arm is in position");
        session.press("]]");
        session.wait_for("jog by 10 deg");
        for waist in ["-0.70", "-10.70", "-20.70"] {
            session.press("\x1b[D");
            session.wait_for(&format!("{waist} deg"));
            // Keys that come while the arm still moves are dropped.
            std::thread::sleep(std::time::Duration::from_millis(200));
        }
        session.press("\r");
        session.wait_for("m  Move arm yourself");
        self.keep(&session, "run-failed")?;
        session.press("a");
        session.wait_for("Abort");
        session.press("y");
        session.wait_for("aborted");
        session.press("q");
        session.wait_for_end();
        Ok(())
    }

    /// The record after some more runs without anybody, over gears with play.
    fn history(&self) -> io::Result<()> {
        let cells = Path::new(env!("CARGO_MANIFEST_DIR")).join("../workcells/teachmover");
        let record = self.folder.path().join("record").display().to_string();
        for turns in ["1", "2", "3", "5"] {
            let cell = cells.join("cell-backlash.yaml").display().to_string();
            let turns = format!("cycles={turns}");
            let arguments =
                ["run", &cell, "--headless", "--record", &record, "--operator", "grace", "--set", &turns];
            let ran = Command::new(&self.program).args(arguments).stdout(Stdio::null()).status()?;
            if !ran.success() {
                return Err(io::Error::other("a run without anybody did not pass"));
            }
        }
        let mut session =
            Session::start(&self.program, &["history", "--screen", "--record", &record], 110, 30);
        session.wait_for("Runs (5)");
        // Past the zeros of the first cell, to a joint of the second that was corrected four times.
        for _ in 0..4 {
            session.press("\x1b[C");
        }
        session.wait_for("(5 of 6)");
        self.keep(&session, "history")?;
        session.press("q");
        session.wait_for_end();
        Ok(())
    }

    /// A simulated PUMA whose shoulder gives way under gravity: seen, previewed, added.
    fn trial(&self) -> io::Result<()> {
        let folder = self.folder.path().join("trial");
        let options =
            ["trial", "new", "--seed", "3", "--arm", "puma560", "--effect", "joint_compliance(shoulder)=5x"];
        let made = Command::new(&self.program)
            .args(options)
            .arg("-o")
            .arg(&folder)
            .stdout(Stdio::null())
            .status()?;
        if !made.success() {
            return Err(io::Error::other("no trial was made"));
        }
        // The program writes where it is: no picture shows a path of the machine it was made on.
        std::env::set_current_dir(&folder)?;
        let mut session =
            Session::start(&self.program, &["model", "screen", "model.yaml", "--data", "table.csv"], 132, 42);
        judged(&session);
        self.keep(&session, "model-diagnosis")?;
        session.press("\r");
        session.wait_for("To see it:");
        self.keep(&session, "model-details")?;
        session.press("\r");
        session.wait_until_gone("To see it:");
        session.press(" ");
        session.wait_for("Preview: with");
        self.keep(&session, "model-preview")?;
        session.press("a");
        session.wait_for("at floor \u{b7}");
        self.keep(&session, "model-at-floor")?;
        session.press("q");
        session.wait_for_end();
        Ok(())
    }

    /// The lab on a model of the reader's own that starts with nothing but base and targets free.
    fn measured(&self, model: &Path, table: &Path) -> io::Result<()> {
        let copied = |path: &Path| {
            let name = path.file_name().unwrap_or_default();
            fs::copy(path, self.folder.path().join(name)).map(|_| name.to_string_lossy().into_owned())
        };
        let (model, table) = (copied(model)?, copied(table)?);
        std::env::set_current_dir(self.folder.path())?;
        let arguments =
            ["model", "screen", &model, "--data", &table, "--free", "none", "--holdout", "random:0.3:1"];
        let mut session = Session::start(&self.program, &arguments, 132, 42);
        judged(&session);
        for effect in ["joint_zero(*)", "geometry(*)"] {
            session.press("n");
            session.wait_for("Add effect:");
            session.press(effect);
            session.press("\r");
            session.wait_for(&format!("{effect} added"));
            judged(&session);
        }
        self.keep(&session, "measured-geometry")?;
        session.press("q");
        session.wait_for_end();
        Ok(())
    }

    /// Draws the terminal as it is now.
    fn keep(&self, session: &Session, name: &str) -> io::Result<()> {
        let path = self.pictures.join(name).with_extension("svg");
        fs::write(&path, session.with_screen(svg::picture))?;
        println!("{}", path.display());
        Ok(())
    }
}

/// How long the lab may take to judge the candidates: a thousand poses take a minute on a busy machine.
const LONGEST_JUDGING: Duration = Duration::from_secs(900);

/// Waits until the lab has judged the candidates.
fn judged(session: &Session) {
    let began = Instant::now();
    let is_judged = |text: &str| {
        let works =
            ["Adding ", "Judging ", "not judged yet", "Looking at "].iter().any(|doing| text.contains(doing));
        text.contains("cross-validation:") && !works
    };
    while !is_judged(&session.text()) {
        assert!(began.elapsed() < LONGEST_JUDGING, "the candidates were not judged:\n{}", session.text());
        std::thread::sleep(Duration::from_millis(100));
    }
}
