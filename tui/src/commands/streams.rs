//! `plumb streams`: what the devices of a cell emit, live from shared memory.

mod python;

use std::collections::BTreeSet;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use plumb_bus::{Bus, Listener, ReceiveError, Subscriber, wait_any};
use plumb_cell::device::{CellResources, Occupancy};
use plumb_cell::expression::Calculator;
use plumb_cell::workcell::{Workcell, load_workcell};
use plumb_document::did_you_mean;
use plumb_plugin::message::{self, Layout};
use plumb_plugin::{Health, StreamDescription};
use serde_json::{Value, json};

use crate::commands::run::prepare::plugins_of;
use crate::failure::CommandResult;

use python::{PythonCell, python_file};

/// List what the devices of a cell emit, or print it live while the cell runs. Only listens; a run does not notice.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The cell file.
    cell: PathBuf,
    /// Print these as they come, such as arm/joints; `all` prints every stream. Without any, those there are are listed.
    streams: Vec<String>,
    /// A line of JSON for each message, or for each stream that is listed.
    #[arg(long)]
    json: bool,
    /// Print a file in Python that reads these streams from shared memory, with the package iceoryx2: save it as plumb_streams.py.
    #[arg(long, conflicts_with_all = ["json", "count", "streams"])]
    python: bool,
    /// End after this many messages. Otherwise it ends with the run.
    #[arg(long, value_name = "NUMBER")]
    count: Option<u64>,
    /// How long to wait for a run of the cell to begin, seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    wait: f64,
    /// Look for plugins here too.
    #[arg(long, value_name = "DIR")]
    plugins: Vec<PathBuf>,
}

/// Why no stream can be printed.
#[derive(Debug, thiserror::Error)]
enum StreamsError {
    #[error("{0}")]
    Files(String),
    #[error("the cell has no stream '{name}': {help}")]
    Unknown { name: String, help: String },
    #[error("nobody runs {}: start it with `plumb run`, or let this wait for it with --wait 60", .0.display())]
    NotRunning(PathBuf),
}

/// A stream of a device.
#[derive(Clone)]
struct Stream {
    device: String,
    plugin: String,
    description: StreamDescription,
}

impl Stream {
    fn name(&self) -> String {
        format!("{}/{}", self.device, self.description.name)
    }
}

/// How often is looked whether the run goes on.
const LOOK: Duration = Duration::from_millis(100);

/// Lists the streams, or prints those that were named.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let in_words = |problems: Vec<plumb_document::FileProblems>| {
        StreamsError::Files(problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
    };
    let cell = load_workcell(&arguments.cell, &Calculator::new()).map_err(in_words)?;
    let streams = declared(&cell, arguments)?;
    let mut output = io::stdout().lock();
    if arguments.python {
        return print_python(&cell, &streams, arguments, &mut output);
    }
    if arguments.streams.is_empty() {
        list(&streams, arguments.json, &mut output)?;
        return Ok(ExitCode::SUCCESS);
    }
    let requested = requested(&streams, &arguments.streams)?;
    let resources = CellResources::of_cell(&cell.file)?;
    if !waited_for(&resources, arguments.wait) {
        return Err(StreamsError::NotRunning(arguments.cell.clone()).into());
    }
    let printed = print(&resources, &requested, arguments, &mut output);
    tidy(&resources, &cell);
    printed?;
    Ok(ExitCode::SUCCESS)
}

fn print_python(
    cell: &Workcell,
    streams: &[Stream],
    arguments: &Arguments,
    output: &mut impl Write,
) -> CommandResult {
    let resources = CellResources::of_cell(&cell.file)?;
    let known = PythonCell {
        name: &cell.name,
        file: arguments.cell.display().to_string(),
        domain: resources.domain(),
        lock: resources.lock_file().display().to_string(),
    };
    let streams: Vec<_> =
        streams.iter().map(|stream| (stream.device.clone(), stream.description.clone())).collect();
    output.write_all(python_file(&known, &streams).as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

/// What the manifests of the cell's devices declare, and what each host says of itself.
fn declared(cell: &Workcell, arguments: &Arguments) -> Result<Vec<Stream>, Box<dyn std::error::Error>> {
    let catalogue = plugins_of(cell, &arguments.plugins);
    let mut streams = Vec::new();
    for device in &cell.devices {
        let plugin = catalogue.find(&device.plugin)?;
        let health = StreamDescription::of::<Health>("health");
        for description in plugin.manifest.streams.iter().chain([&health]) {
            let (device, plugin) = (device.name.clone(), device.plugin.clone());
            streams.push(Stream { device, plugin, description: description.clone() });
        }
    }
    Ok(streams)
}

fn list(streams: &[Stream], as_json: bool, output: &mut impl Write) -> io::Result<()> {
    for stream in streams {
        let (name, layout, plugin) = (stream.name(), &stream.description.message, &stream.plugin);
        match as_json {
            true => writeln!(output, "{}", json!({"stream": name, "message": layout, "plugin": plugin}))?,
            false => writeln!(output, "{name:<24} {layout:<20} of plugin {plugin}")?,
        }
    }
    Ok(())
}

fn requested(streams: &[Stream], names: &[String]) -> Result<Vec<Stream>, StreamsError> {
    let known: Vec<String> = streams.iter().map(Stream::name).collect();
    let unknown = names.iter().find(|name| *name != "all" && !known.contains(name));
    if let Some(name) = unknown {
        let help = did_you_mean(name, known.iter().map(String::as_str));
        return Err(StreamsError::Unknown { name: name.clone(), help });
    }
    let names: BTreeSet<&String> = names.iter().collect();
    let is_requested = |stream: &&Stream| names.iter().any(|name| *name == "all" || **name == stream.name());
    Ok(streams.iter().filter(is_requested).cloned().collect())
}

fn is_running(resources: &CellResources) -> bool {
    matches!(resources.state(), Occupancy::InUse(_)) && resources.domain().root().exists()
}

/// Whether the cell is run, now or before the time is up.
fn waited_for(resources: &CellResources, seconds: f64) -> bool {
    let begin = Instant::now();
    while !is_running(resources) {
        if begin.elapsed().as_secs_f64() >= seconds {
            return false;
        }
        std::thread::sleep(LOOK);
    }
    true
}

/// Prints messages until the run ends, or as many as were asked for.
fn print(
    resources: &CellResources,
    streams: &[Stream],
    arguments: &Arguments,
    output: &mut impl Write,
) -> Result<(), Box<dyn std::error::Error>> {
    let bus = Bus::open(resources.domain(), "plumb streams")?;
    let mut receivers: Vec<(Subscriber, &Stream)> = Vec::new();
    let mut signals: Vec<Listener> = Vec::new();
    for stream in streams {
        signals.push(bus.stream_listener(&stream.device, &stream.description)?);
        receivers.push((bus.subscriber(&stream.device, &stream.description)?, stream));
    }
    let signals: Vec<&Listener> = signals.iter().collect();
    let mut left = arguments.count.unwrap_or(u64::MAX);
    let mut goes_on = true;
    while goes_on && left > 0 {
        // What came before the run ended is printed as well.
        goes_on = is_running(resources);
        wait_any(&signals, LOOK)?;
        for signal in &signals {
            signal.drain()?;
        }
        for (receiver, stream) in &mut receivers {
            left = print_waiting(receiver, stream, arguments.json, left, output)?;
        }
        output.flush()?;
    }
    Ok(())
}

/// Prints what waits in one stream; how many messages may still be printed.
fn print_waiting(
    receiver: &mut Subscriber,
    stream: &Stream,
    as_json: bool,
    mut left: u64,
    output: &mut impl Write,
) -> Result<u64, Box<dyn std::error::Error>> {
    let layout = &stream.description.message;
    let fields_known = Layout::of(&stream.description);
    while left > 0 {
        match receiver.receive_with(|bytes| message::to_json(fields_known.as_ref(), bytes)) {
            Ok(Some(fields)) => write_message(&stream.name(), layout, &fields, as_json, output)?,
            Ok(None) => break,
            Err(ReceiveError::Lost { count, .. }) => {
                let lost = json!({"stream": stream.name(), "lost": count});
                match as_json {
                    true => writeln!(output, "{lost}")?,
                    false => writeln!(
                        output,
                        "{}: {count} messages were lost here: they came faster than they were printed",
                        stream.name()
                    )?,
                }
                continue;
            }
            Err(error) => return Err(error.into()),
        }
        left -= 1;
    }
    Ok(left)
}

fn write_message(
    name: &str,
    layout: &str,
    fields: &Value,
    as_json: bool,
    output: &mut impl Write,
) -> io::Result<()> {
    if as_json {
        return writeln!(output, "{}", json!({"stream": name, "message": layout, "fields": fields}));
    }
    let seconds = fields.get("time_ns").and_then(Value::as_u64).unwrap_or_default() as f64 * 1e-9;
    let sequence = fields.get("sequence").and_then(Value::as_u64).unwrap_or_default();
    let rest = fields
        .as_object()
        .into_iter()
        .flatten()
        .filter(|(field, _)| *field != "time_ns" && *field != "sequence");
    let rest: Vec<String> = rest.map(|(field, value)| format!("{field} {value}")).collect();
    writeln!(output, "{name} {seconds:.6} s #{sequence}: {}", rest.join(", "))
}

/// A run that ended while this listened left its shared memory to the last that uses it.
fn tidy(resources: &CellResources, cell: &Workcell) {
    if !is_running(resources)
        && let Ok(_lock) = resources.lock(&cell.name, &cell.file.display().to_string())
        && let Err(error) = resources.domain().remove()
    {
        tracing::debug!("shared memory is left behind: {error}");
    }
}
