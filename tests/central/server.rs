//! A PostgreSQL server of a test's own: a new cluster in a temporary folder, reached by a socket there, so that no port is taken.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// Starting takes a second; what takes this long hangs.
const PATIENCE: Duration = Duration::from_secs(60);

/// A server that ends with the test.
pub(crate) struct Server {
    place: TempDir,
    programs: PathBuf,
    child: Option<Child>,
}

impl Server {
    /// A new one. None where PostgreSQL is not installed: the test then says what it skipped.
    pub(crate) fn new() -> Option<Self> {
        let Some(programs) = programs() else {
            eprintln!("skipped: PostgreSQL is not installed (Debian: apt-get install postgresql)");
            return None;
        };
        let place = tempfile::tempdir().unwrap();
        let mut server = Self { place, programs, child: None };
        if is_root() {
            // The server refuses to run as root; Debian's package brings a user for it.
            let given = Command::new("chown").arg("postgres").arg(server.place.path()).status().unwrap();
            assert!(given.success(), "the folder goes to the user postgres");
        }
        let mut made = server.program("initdb");
        made.args(["--auth=trust", "--username=plumb", "--encoding=UTF8", "--no-sync", "-D"]);
        let made = made.arg(server.place.path().join("data")).output().unwrap();
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        server.start();
        Some(server)
    }

    /// Starts it, on the cluster it has.
    pub(crate) fn start(&mut self) {
        let log = fs::File::create(self.place.path().join("log")).unwrap();
        let mut command = self.program("postgres");
        command.arg("-D").arg(self.place.path().join("data")).arg("-k").arg(self.place.path());
        // Nothing of a test has to outlive the machine's power.
        command.args(["-c", "listen_addresses=", "-c", "fsync=off"]);
        let child = command.stdout(Stdio::null()).stderr(log).spawn().unwrap();
        self.child = Some(child);
        let begin = Instant::now();
        while self.asked("SELECT 1").is_none_or(|answer| answer != "1") {
            let said = || fs::read_to_string(self.place.path().join("log")).unwrap_or_default();
            assert!(begin.elapsed() < PATIENCE, "the server does not start: {}", said());
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Kills it as a power cut would.
    pub(crate) fn kill(&mut self) {
        let pid = fs::read_to_string(self.place.path().join("data/postmaster.pid")).unwrap();
        let pid: u32 = pid.lines().next().unwrap().trim().parse().unwrap();
        let killed = Command::new("kill").args(["-9", &pid.to_string()]).status().unwrap();
        assert!(killed.success());
        self.wait();
        // The processes of its connections notice a moment later, and hold its memory until then.
        let begin = Instant::now();
        while self.asked("SELECT 1").is_some() {
            assert!(begin.elapsed() < PATIENCE, "the server lives on");
        }
    }

    fn wait(&mut self) {
        if let Some(mut child) = self.child.take() {
            child.wait().unwrap();
        }
    }

    /// Its address for `plumb`.
    pub(crate) fn address(&self) -> String {
        format!("postgres:///postgres?user=plumb&host={}", self.place.path().display())
    }

    /// What it answers to a question of one value.
    pub(crate) fn ask(&self, question: &str) -> String {
        self.asked(question).unwrap_or_else(|| panic!("no answer to {question}"))
    }

    fn asked(&self, question: &str) -> Option<String> {
        let mut psql = Command::new(self.programs.join("psql"));
        psql.args(["-X", "-A", "-t", "-U", "plumb", "-d", "postgres", "-c", question, "-h"]);
        let output = psql.arg(self.place.path()).stderr(Stdio::null()).output().unwrap();
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    }

    fn program(&self, name: &str) -> Command {
        let path = self.programs.join(name);
        if !is_root() {
            return Command::new(path);
        }
        let mut command = Command::new("setpriv");
        command.args(["--reuid=postgres", "--regid=postgres", "--clear-groups", "--"]).arg(path);
        command.current_dir(self.place.path());
        command
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // "immediate": a test that failed need not wait for its connections.
        let mut stop = self.program("pg_ctl");
        let stopped =
            stop.args(["stop", "-m", "immediate", "-D"]).arg(self.place.path().join("data")).output();
        drop(stopped);
        self.wait();
    }
}

fn is_root() -> bool {
    // A process's folder belongs to its effective user.
    fs::metadata("/proc/self").is_ok_and(|folder| std::os::unix::fs::MetadataExt::uid(&folder) == 0)
}

/// Where PostgreSQL's programs are: beside each other on the path, or where Debian puts them, the newest first.
fn programs() -> Option<PathBuf> {
    let mut places: Vec<PathBuf> = std::env::var_os("PATH")
        .map(|path| std::env::split_paths(&path).collect::<Vec<_>>())
        .unwrap_or_default();
    let mut versions: Vec<PathBuf> = fs::read_dir("/usr/lib/postgresql")
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path())
        .collect();
    versions.sort();
    // Debian's own come first: on the path there may be links to some of them.
    for version in versions {
        places.insert(0, version.join("bin"));
    }
    let whole =
        |place: &Path| ["initdb", "postgres", "pg_ctl", "psql"].iter().all(|name| place.join(name).is_file());
    places.into_iter().find(|place| whole(place))
}
