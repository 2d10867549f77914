//! What the measurements are made of: the program, plugins, domains of their own, copies of the cell.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

use plumb_bus::{Bus, Domain};
use plumb_host::{HostArguments, HostCommand, HostProcess, Plugin, WiredInput};
use plumb_plugin::Value;

/// The program, as built with the measurements.
pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_plumb");

/// A domain on a bus that nobody else is on.
pub(crate) struct TestFolder {
    pub(crate) bus: Option<Bus>,
    pub(crate) domain: Domain,
    _directory: tempfile::TempDir,
}

impl TestFolder {
    pub(crate) fn new() -> Result<Self, Box<dyn Error>> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let directory = tempfile::Builder::new().prefix("pb").tempdir()?;
        let prefix = format!("plumbbench_{}_{}_", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let domain = Domain::new(&prefix, &directory.path().join("r"))?;
        let bus = Some(Bus::open(&domain, "bench")?);
        Ok(Self { bus, domain, _directory: directory })
    }

    pub(crate) fn bus(&self) -> Result<&Bus, Box<dyn Error>> {
        self.bus.as_ref().ok_or_else(|| "the bus is closed".into())
    }

    /// A device behind a host of its own.
    pub(crate) fn host(
        &self,
        device: &str,
        plugin: &Plugin,
        config: Value,
        inputs: Vec<WiredInput>,
    ) -> Result<HostProcess, Box<dyn Error>> {
        let mut arguments = HostArguments::new(device, &self.domain, plugin);
        arguments.config = config;
        arguments.inputs = inputs;
        Ok(HostProcess::spawn(self.bus()?, &arguments, HostCommand::new(PROGRAM.into(), ["host"]))?)
    }
}

impl Drop for TestFolder {
    fn drop(&mut self) {
        self.bus = None;
        // What is still in use is left to who uses it.
        let _ = self.domain.remove();
    }
}

/// A plugin of the workspace, as built with the program.
pub(crate) fn plugin(name: &str) -> Result<Plugin, Box<dyn Error>> {
    let library = format!("libplumb_{}.so", name.replace('-', "_"));
    let manifest = root().join("plugins").join(name).join("plugin.yaml");
    Ok(Plugin::at_library(&manifest, &built().join("deps").join(library))?)
}

/// The robot that answers at once.
pub(crate) fn steady_robot() -> Result<Plugin, Box<dyn Error>> {
    let manifest = root().join("tests/bench/steady_robot/plugin.yaml");
    Ok(Plugin::at_library(&manifest, &built().join("examples/libsteady_robot.so"))?)
}

/// Builds it: a library that nothing depends on is not built with the measurements. For the whole workspace, as these are: dependencies with other
/// features would be built once more.
pub(crate) fn build_steady_robot() -> Result<(), Box<dyn Error>> {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let mut command = Command::new(cargo);
    command.args(["build", "--quiet", "--workspace", "--example", "steady_robot"]);
    if built().ends_with("release") {
        command.arg("--release");
    }
    match command.current_dir(root()).status()?.success() {
        true => Ok(()),
        false => Err("the robot of the measurements cannot be built".into()),
    }
}

pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Where the program lies.
fn built() -> PathBuf {
    Path::new(PROGRAM).parent().unwrap_or(Path::new("/")).to_owned()
}

/// A copy of the cells of one folder of `workcells` to run in, with a record of its own.
pub(crate) struct Cells {
    directory: tempfile::TempDir,
}

impl Cells {
    /// The TeachMover's.
    pub(crate) fn new() -> Result<Self, Box<dyn Error>> {
        Self::of("teachmover")
    }

    /// Those of a folder, with the models of arms beside it.
    pub(crate) fn of(folder: &str) -> Result<Self, Box<dyn Error>> {
        let directory = tempfile::tempdir()?;
        let workcells = root().join("workcells");
        copy(&workcells.join(folder), &directory.path().join("cell"))?;
        copy(&workcells.join("arms"), &directory.path().join("arms"))?;
        Ok(Self { directory })
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join("cell").join(name)
    }

    /// Where the world of a cell listens while it runs.
    pub(crate) fn world_socket(&self, cell: &str) -> Result<PathBuf, Box<dyn Error>> {
        let domain = plumb_bus::Domain::of_cell(&self.path(cell))?;
        let mut name = domain.root().as_os_str().to_owned();
        name.push(".world");
        Ok(PathBuf::from(name).join("socket"))
    }

    /// Replaces a text in one of the files.
    pub(crate) fn edit(&self, name: &str, from: &str, to: &str) -> Result<(), Box<dyn Error>> {
        let text = fs::read_to_string(self.path(name))?;
        if !text.contains(from) {
            return Err(format!("{name} does not have `{from}`").into());
        }
        Ok(fs::write(self.path(name), text.replace(from, to))?)
    }

    /// The program, to be run here.
    pub(crate) fn plumb(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(PROGRAM);
        command.args(arguments).current_dir(self.path("."));
        command.env("XDG_STATE_HOME", self.directory.path().join("state"));
        command
    }
}

fn copy(from: &Path, to: &Path) -> std::io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let path = entry?.path();
        let target = to.join(path.file_name().unwrap_or_default());
        if path.is_dir() {
            copy(&path, &target)?;
        } else {
            fs::copy(&path, &target)?;
        }
    }
    Ok(())
}

/// The conditions of the figures.
pub(crate) fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
    let cpus = read("/proc/cpuinfo");
    let model = cpus.lines().find_map(|line| line.strip_prefix("model name")).unwrap_or("unknown");
    let load = read("/proc/loadavg");
    format!(
        "{cores} cores, {}; Linux {}; load before {}; {} build",
        model.trim_start_matches([' ', '\t', ':']),
        read("/proc/sys/kernel/osrelease").trim(),
        load.split_whitespace().next().unwrap_or("?"),
        if built().ends_with("release") { "release" } else { "debug" },
    )
}
