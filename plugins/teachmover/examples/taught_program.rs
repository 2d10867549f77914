//! The program taught to the controller: kept in a file, written back, and run.
//!
//! ```console
//! $ cargo run -p plumb-teachmover --example taught_program -- /dev/ttyUSB0 save program.csv
//! $ cargo run -p plumb-teachmover --example taught_program -- /dev/ttyUSB0 load program.csv
//! $ cargo run -p plumb-teachmover --example taught_program -- /dev/ttyUSB0 run
//! ```
//!
//! A file holds a line of eight numbers, separated by commas, for each line of the program, as the controller reports them.

use std::error::Error;
use std::io::{BufRead, Write};
use std::time::Duration;

use plumb_teachmover::controller::{Controller, OnlyThePendantStopsIt};
use plumb_teachmover::protocol::{Command, ProgramLine, Status, parse_program};
use plumb_teachmover::reply_line::ReplyLine;

/// What an operator types to confirm that they can stop the arm.
const CONFIRMATION: &str = "I stand at the pendant";

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words.as_slice() {
        [port, "save", file] => save(&mut connect(port)?, file),
        [port, "load", file] => load(&mut connect(port)?, file),
        [port, "run"] => run(&mut connect(port)?),
        _ => Err("give a port, then `save FILE`, `load FILE` or `run`".into()),
    }
}

fn connect(port: &str) -> Result<Controller, Box<dyn Error>> {
    let mut controller = Controller::new(ReplyLine::open(port, 9600)?, b'@', Duration::from_secs(1));
    controller.resynchronise()?;
    controller.read()?;
    Ok(controller)
}

fn save(controller: &mut Controller, file: &str) -> Result<(), Box<dyn Error>> {
    let program = controller.dump_program()?;
    let lines = program.iter().map(|line| line.0.map(|word| word.to_string()).join(",") + "\n");
    std::fs::write(file, lines.collect::<String>())?;
    println!("{} lines saved", program.len());
    Ok(())
}

fn load(controller: &mut Controller, file: &str) -> Result<(), Box<dyn Error>> {
    let program: Vec<ProgramLine> =
        parse_program(&std::fs::read(file)?).map_err(|fault| format!("{file}: {fault}"))?;
    controller.write_program(&program)?;
    println!("{} lines loaded", program.len());
    Ok(())
}

fn run(controller: &mut Controller) -> Result<(), Box<dyn Error>> {
    println!(
        "Once the program runs, nothing typed here stops the arm: only STOP on the pendant does, or the power switch."
    );
    print!("Raise the arm, keep a hand on STOP, and type '{CONFIRMATION}': ");
    std::io::stdout().flush()?;
    let mut typed = String::new();
    std::io::stdin().lock().read_line(&mut typed)?;
    if typed.trim() != CONFIRMATION {
        return Err("not confirmed; nothing was run".into());
    }
    controller.begin_program(OnlyThePendantStopsIt::confirmed_by_the_operator())?;
    let status = loop {
        match controller.reply_at_hand(&Command::RunProgram)? {
            Some(status) => break status,
            None => std::thread::sleep(Duration::from_millis(50)),
        }
    };
    match status {
        Status::Done => println!("the program has ended"),
        Status::StopKey => println!("the STOP key on the pendant ended the program"),
        Status::Refused => println!("the controller refused to run a program: is one loaded?"),
    }
    println!("registers: {:?}", controller.read()?.registers.0);
    Ok(())
}
