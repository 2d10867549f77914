//! A PostgreSQL server of a test's own: a new cluster in a temporary folder, reached by a socket there, so that no port is taken.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

use crate::certificates::{Authority, Certificate};

/// Starting takes a second; what takes this long hangs.
const PATIENCE: Duration = Duration::from_secs(60);

/// A server that ends with the test.
pub(crate) struct Server {
    folder: TempDir,
    programs: PathBuf,
    child: Option<Child>,
    /// The port, where it listens on one.
    port: Option<u16>,
    /// What it is started with beside the usual.
    settings: Vec<String>,
}

impl Server {
    /// A new one. None where PostgreSQL is not installed: the test then says what it skipped.
    pub(crate) fn new() -> Option<Self> {
        let mut server = Self::made()?;
        server.start();
        Some(server)
    }

    /// A new one that listens on a port too, without TLS.
    pub(crate) fn on_a_port() -> Option<Self> {
        let mut server = Self::made()?;
        server.listen("localhost");
        server.start();
        Some(server)
    }

    /// A new one that listens at an address of this machine too, with TLS that nobody need trust.
    pub(crate) fn listening_at(address: &str) -> Option<Self> {
        let authority = Authority::new()?;
        let mut server = Self::with_certificate(&authority.certify("localhost"), address)?;
        let rule = "hostssl all all 198.18.0.0/15 trust\n";
        let rules = server.folder.path().join("data/pg_hba.conf");
        let all = format!("{rule}{}", fs::read_to_string(&rules).unwrap());
        fs::write(&rules, all).unwrap();
        server.start();
        Some(server)
    }

    /// The port it listens on.
    pub(crate) fn port(&self) -> u16 {
        self.port.unwrap()
    }

    /// A new one that listens on a port with TLS.
    pub(crate) fn with_tls(certificate: &Certificate) -> Option<Self> {
        let mut server = Self::with_certificate(certificate, "localhost")?;
        server.start();
        Some(server)
    }

    fn with_certificate(certificate: &Certificate, address: &str) -> Option<Self> {
        let mut server = Self::made()?;
        server.listen(address);
        let data = server.folder.path().join("data");
        for (from, to) in [(&certificate.certificate, "server.crt"), (&certificate.key, "server.key")] {
            fs::copy(from, data.join(to)).unwrap();
            fs::set_permissions(data.join(to), fs::Permissions::from_mode(0o600)).unwrap();
            if is_root() {
                let given = Command::new("chown").arg("postgres").arg(data.join(to)).status().unwrap();
                assert!(given.success(), "the server may read its certificate");
            }
        }
        server.settings.push("ssl=on".to_owned());
        Some(server)
    }

    /// Takes a port that is free now.
    fn listen(&mut self, address: &str) {
        let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        self.port = Some(port);
        self.settings.extend([format!("listen_addresses={address}"), format!("port={port}")]);
    }

    /// Its address for `plumb` over that port, with further options.
    pub(crate) fn address_by_port(&self, options: &str) -> String {
        format!("postgres://plumb@localhost:{}/postgres?{options}", self.port.unwrap())
    }

    fn made() -> Option<Self> {
        let Some(programs) = programs() else {
            eprintln!("skipped: PostgreSQL is not installed (Debian: apt-get install postgresql)");
            return None;
        };
        let folder = tempfile::tempdir().unwrap();
        let server = Self { folder, programs, child: None, port: None, settings: Vec::new() };
        if is_root() {
            // The server refuses to run as root; Debian's package brings a user for it.
            let given = Command::new("chown").arg("postgres").arg(server.folder.path()).status().unwrap();
            assert!(given.success(), "the folder goes to the user postgres");
        }
        let mut made = server.program("initdb");
        made.args(["--auth=trust", "--username=plumb", "--encoding=UTF8", "--no-sync", "-D"]);
        let made = made.arg(server.folder.path().join("data")).output().unwrap();
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        Some(server)
    }

    /// Starts it, on the cluster it has.
    pub(crate) fn start(&mut self) {
        let log = fs::File::create(self.folder.path().join("log")).unwrap();
        let mut command = self.program("postgres");
        command.arg("-D").arg(self.folder.path().join("data")).arg("-k").arg(self.folder.path());
        // Nothing of a test has to outlive the machine's power.
        command.args(["-c", "listen_addresses=", "-c", "fsync=off"]);
        // In its own folder, not in /dev/shm, where a server that is killed leaves it behind.
        command.args(["-c", "dynamic_shared_memory_type=mmap"]);
        for setting in &self.settings {
            command.args(["-c", setting]);
        }
        let child = command.stdout(Stdio::null()).stderr(log).spawn().unwrap();
        self.child = Some(child);
        let begin = Instant::now();
        while self.asked("SELECT 1").is_none_or(|answer| answer != "1") {
            let printed = || fs::read_to_string(self.folder.path().join("log")).unwrap_or_default();
            assert!(begin.elapsed() < PATIENCE, "the server does not start: {}", printed());
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Kills it as a power cut would.
    pub(crate) fn kill(&mut self) {
        let pid = fs::read_to_string(self.folder.path().join("data/postmaster.pid")).unwrap();
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
        let port = self.port.map(|port| format!("&port={port}")).unwrap_or_default();
        format!("postgres:///postgres?user=plumb&host={}{port}", self.folder.path().display())
    }

    /// What it answers to a question of one value.
    pub(crate) fn ask(&self, question: &str) -> String {
        self.asked(question).unwrap_or_else(|| panic!("no answer to {question}"))
    }

    pub(crate) fn asked(&self, question: &str) -> Option<String> {
        let mut psql = Command::new(self.programs.join("psql"));
        psql.args(["-X", "-A", "-t", "-U", "plumb", "-d", "postgres", "-c", question, "-h"]);
        psql.arg(self.folder.path());
        if let Some(port) = self.port {
            psql.args(["-p", &port.to_string()]);
        }
        let output = psql.stderr(Stdio::null()).output().unwrap();
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    }

    /// A server that was killed and not started again leaves a segment of System V behind: key and number are in the seventh line of the file with its process.
    fn remove_shared_memory(&self) {
        let left = fs::read_to_string(self.folder.path().join("data/postmaster.pid")).unwrap_or_default();
        if let Some(number) = left.lines().nth(6).and_then(|line| line.split_whitespace().nth(1)) {
            let _gone = Command::new("ipcrm").args(["-m", number]).stderr(Stdio::null()).status();
        }
    }

    fn program(&self, name: &str) -> Command {
        let path = self.programs.join(name);
        if !is_root() {
            return Command::new(path);
        }
        let mut command = Command::new("setpriv");
        command.args(["--reuid=postgres", "--regid=postgres", "--clear-groups", "--"]).arg(path);
        command.current_dir(self.folder.path());
        command
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // "immediate": a test that failed need not wait for its connections.
        let mut stop = self.program("pg_ctl");
        let stopped =
            stop.args(["stop", "-m", "immediate", "-D"]).arg(self.folder.path().join("data")).output();
        drop(stopped);
        self.wait();
        self.remove_shared_memory();
    }
}

fn is_root() -> bool {
    // A process's folder belongs to its effective user.
    fs::metadata("/proc/self").is_ok_and(|folder| std::os::unix::fs::MetadataExt::uid(&folder) == 0)
}

/// Where PostgreSQL's programs are: beside each other on the path, or where Debian puts them, the newest first.
fn programs() -> Option<PathBuf> {
    let mut folders: Vec<PathBuf> = std::env::var_os("PATH")
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
        folders.insert(0, version.join("bin"));
    }
    let whole = |folder: &Path| {
        ["initdb", "postgres", "pg_ctl", "psql"].iter().all(|name| folder.join(name).is_file())
    };
    folders.into_iter().find(|folder| whole(folder))
}
