//! The host process of this crate's tests, and an orchestrator to be killed: what `plumb host` is in the program.
//!
//! `host_process` serves one device. `host_process orchestrate ARGUMENTS` starts such a host, sets its robot moving and prints the host's
//! process number.

use std::env;
use std::error::Error;
use std::process::ExitCode;
use std::thread;
use std::time::Duration;

use plumb_bus::Bus;
use plumb_host::{HostArguments, HostCommand, HostProcess, MoveGuard, NoGuard, serve};
use plumb_plugin::{JointVector, Motion, Value};

/// Keeps the second joint below what the cell says.
struct KeepBelow(f64);

impl MoveGuard for KeepBelow {
    fn check(&self, _from: &JointVector, to: &JointVector) -> Result<(), String> {
        match to.get(1) {
            Some(value) if value > self.0 => Err(format!("the hand would reach into the table ({value} mm)")),
            _ => Ok(()),
        }
    }
}

fn main() -> ExitCode {
    let mut arguments = env::args().skip(1);
    match (arguments.next().as_deref(), arguments.next()) {
        (Some("orchestrate"), Some(text)) => match orchestrate(&text) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("{error}");
                ExitCode::FAILURE
            }
        },
        _ => serve(|guard: &Value, _| match guard["keep_below"].as_f64() {
            Some(limit) => Ok(Box::new(KeepBelow(limit)) as Box<dyn MoveGuard>),
            None => Ok(Box::new(NoGuard)),
        }),
    }
}

fn orchestrate(text: &str) -> Result<(), Box<dyn Error>> {
    let arguments: HostArguments = serde_json::from_str(text)?;
    let bus = Bus::open(&arguments.domain()?, "orchestrator")?;
    let command = HostCommand::new(env::current_exe()?, [] as [&str; 0]);
    let host = HostProcess::spawn(&bus, &arguments, command)?;
    let robot = host.robot()?;
    robot.activate()?;
    println!("{}", host.process());
    let far = JointVector::from_slice(&[90.0, 0.0])?;
    robot.move_joints(&Motion::absolute(far, 1.0), Duration::from_secs(600))?;
    thread::sleep(Duration::from_secs(600));
    Ok(())
}
