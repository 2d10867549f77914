//! Steps of a procedure a second, each in the record before the next begins, beside OpenHTF's phases, which keeps nothing until the end.

use std::error::Error;
use std::fs;
use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::Measured;
use crate::parts::Cells;
use crate::statistics::quantile;

/// How often each takes its turn.
const TURNS: usize = 5;

/// As many phases that do nothing as it is asked for, timed from the first to the end of the last.
const OPENHTF: &str = r#"
import logging, sys, time
import openhtf as htf
logging.disable(logging.CRITICAL)
times = []
def make(number):
    @htf.PhaseOptions(name='phase_%d' % number)
    def phase(test):
        times.append(time.perf_counter())
    return phase
test = htf.Test(*[make(number) for number in range(int(sys.argv[1]))])
test.configure(failure_exceptions=())
test.execute(test_start=lambda: 'unit')
print('%s %.6f' % (htf.__version__ if hasattr(htf, '__version__') else '', times[-1] - times[0]))
"#;

pub(crate) fn measure(count: usize) -> Measured {
    let cells = Cells::new()?;
    cells.edit("cell.yaml", "procedures: [", "procedures: [procedures/many-steps.yaml, ")?;
    let step = "          - {id: one, do: {compute: {values: {one: 1}}}}\n";
    fs::write(
        cells.path("procedures/many-steps.yaml"),
        format!(
            "procedure: many-steps\nsteps:\n  - id: many\n    do:\n      repeat:\n        times: {count}\n        steps:\n{step}"
        ),
    )?;
    let (mut ours, mut theirs, mut why_not) = (Vec::new(), Vec::new(), None);
    for _ in 0..TURNS {
        ours.push(steps(&cells)?);
        match phases(count) {
            Ok(time) => theirs.push(time),
            Err(error) => why_not = Some(error.to_string()),
        }
    }
    let rate = |times: &mut Vec<Duration>| count as f64 / quantile(times, 0.5).as_secs_f64();
    println!("plumb, every step durable before the next   {:>8.0} steps a second", rate(&mut ours));
    match (theirs.is_empty(), why_not) {
        (false, _) => {
            println!("OpenHTF, nothing kept until the end        {:>8.0} phases a second", rate(&mut theirs));
        }
        (true, why_not) => println!(
            "OpenHTF: not measured ({}); pip install openhtf, or name its Python in OPENHTF_PYTHON",
            why_not.unwrap_or_default()
        ),
    }
    Ok(())
}

/// From the first step's beginning to the last one's end.
fn steps(cells: &Cells) -> Result<Duration, Box<dyn Error>> {
    let mut command = cells.plumb(&["run", "cell.yaml", "many-steps", "--json"]);
    let mut run = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn()?;
    let (mut first, mut last) = (None, None);
    for line in BufReader::new(run.stdout.take().ok_or("no output")?).lines() {
        let now = Instant::now();
        let event: Value = serde_json::from_str(&line?)?;
        match event["event"].as_str() {
            Some("step_started") if first.is_none() => first = Some(now),
            Some("step_finished") => last = Some(now),
            _ => {}
        }
    }
    match (run.wait()?.success(), first, last) {
        (true, Some(first), Some(last)) => Ok(last - first),
        _ => Err("the run did not pass".into()),
    }
}

fn phases(count: usize) -> Result<Duration, Box<dyn Error>> {
    let python = std::env::var("OPENHTF_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    // In a file: it reads the source of its phases.
    let directory = tempfile::tempdir()?;
    let script = directory.path().join("phases.py");
    fs::write(&script, OPENHTF)?;
    let output = Command::new(python).arg(&script).arg(count.to_string()).output()?;
    if !output.status.success() {
        let printed = String::from_utf8_lossy(&output.stderr).into_owned();
        return Err(printed.lines().last().unwrap_or("it failed").to_owned().into());
    }
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let seconds = printed.split_whitespace().last().and_then(|word| word.parse().ok());
    Ok(Duration::from_secs_f64(seconds.ok_or("it reported no time")?))
}
