//! `plumb doctor`: what is wrong with this machine and what runs left behind, each with how to mend it.

mod cells;
mod database;
mod finding;
mod limits;
mod plugins;
mod processes;
mod record;
mod serial_ports;
mod shared_memory;
mod terminal;

use std::path::PathBuf;
use std::process::ExitCode;

use finding::Mark;

use crate::failure::CommandResult;
use crate::print_line::print_line;

/// Look for what is wrong with this computer, and say how to mend it. It looks at the system's limits, shared memory, cells and their processes, serial ports, the terminal, plugins and the record.
/// Nothing is changed without --clean. Ends with 1 when something is wrong.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Only these cells, instead of all of this machine; their serial ports are looked at too.
    cells: Vec<PathBuf>,
    /// Look at this central database too, to which `plumb ship` sends: postgres://USER@HOST/DATABASE.
    #[arg(long, value_name = "ADDRESS")]
    database: Option<String>,
    /// Remove what runs that were killed have left behind, and end their simulated worlds. Nothing of a cell that runs is touched.
    #[arg(long)]
    clean: bool,
    /// One finding a line, as JSON.
    #[arg(long)]
    json: bool,
    /// Where the record lies [default: `plumb` in $XDG_STATE_HOME, which is ~/.local/state where that is not set].
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// Look for plugins here too.
    #[arg(long, value_name = "DIR")]
    plugins: Vec<PathBuf>,
}

/// Exit code when something is wrong.
const WRONG: u8 = 1;

/// Looks at everything, and cleans up first if that is asked for.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let mut findings = Vec::new();
    if arguments.clean {
        findings.extend(cells::clean(&arguments.cells)?);
    }
    findings.extend(limits::look());
    findings.extend(shared_memory::look());
    findings.extend(cells::look(&arguments.cells)?);
    findings.extend(processes::look());
    findings.extend(serial_ports::look(&arguments.cells));
    findings.extend(terminal::look());
    findings.extend(plugins::look(&arguments.plugins, &arguments.cells));
    findings.extend(record::look(arguments.record.as_ref()));
    if let Some(address) = &arguments.database {
        findings.extend(database::look(address, arguments.record.as_ref())?);
    }
    let mut last_mend = None;
    for finding in &findings {
        if arguments.json {
            print_line!("{}", serde_json::to_string(finding)?)?;
            continue;
        }
        print_line!("{}", finding.line())?;
        // What mends several things in a row is said once.
        if let Some(mend) = finding.mend.as_ref().filter(|mend| last_mend != Some(*mend)) {
            print_line!("{:22}{mend}", "")?;
        }
        last_mend = finding.mend.as_ref();
    }
    let wrong = findings.iter().filter(|finding| finding.mark == Mark::Wrong).count();
    if !arguments.json {
        match wrong {
            0 => print_line!("\nnothing is wrong")?,
            1 => print_line!("\none thing is wrong")?,
            many => print_line!("\n{many} things are wrong")?,
        }
    }
    Ok(if wrong == 0 { ExitCode::SUCCESS } else { ExitCode::from(WRONG) })
}
