//! Runs that are killed at random moments: the program itself, or the host of one of its devices. What was answered must be there, the record
//! sound, every run to be taken up again, and nothing left behind.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::thread;
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;
use plumb_cell::device::CellResources;
use serde_json::Value;

use crate::lab::{Lab, hosts_of, processes_of};

/// Who is killed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Victim {
    /// The program that carries the run out.
    Orchestrator,
    /// The host of the robot or of the sensor, in turn.
    Host,
}

/// What came of a campaign.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Figures {
    /// Runs that were killed, or whose host was.
    pub(crate) kills: usize,
    /// Of those, kills that came before the run was in the record.
    pub(crate) before_the_record: usize,
    /// Of those, kills that came after the run had ended.
    pub(crate) after_the_end: usize,
    /// Runs taken up again that passed with the true zeros.
    pub(crate) resumed: usize,
    /// Of those, how many first wanted somebody to look where the arm is.
    pub(crate) looked_at: usize,
    /// Answers shown before the kill.
    pub(crate) answers: usize,
    /// At which steps runs were taken up again, and how often.
    pub(crate) steps: BTreeMap<String, usize>,
    /// What was wrong, a sentence each. Nothing is right.
    pub(crate) wrong: Vec<String>,
    /// The time of a run that nobody kills, s.
    pub(crate) whole_run_s: f64,
}

impl fmt::Display for Figures {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "  kills {}, spread over {:.2} s of a run", self.kills, self.whole_run_s)?;
        writeln!(
            formatter,
            "  before the run was in the record {}, after its end {}",
            self.before_the_record, self.after_the_end
        )?;
        writeln!(
            formatter,
            "  taken up again and passed {}, of which {} once the pose was confirmed",
            self.resumed, self.looked_at
        )?;
        writeln!(
            formatter,
            "  answers shown before the kill {}, all of them kept unless reported below",
            self.answers
        )?;
        let steps: Vec<String> = self.steps.iter().map(|(step, count)| format!("{step} {count}")).collect();
        writeln!(formatter, "  taken up at: {}", steps.join(", "))?;
        write!(
            formatter,
            "  wrong: {}",
            if self.wrong.is_empty() { "nothing".to_owned() } else { self.wrong.join("\n         ") }
        )
    }
}

/// Random numbers that are the same each time (Steele, Lea and Flood's splitmix64).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// Between 0 and 1.
    fn part(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Kills `kills` unattended runs, each at a moment that is random within the time of a whole run.
pub(crate) fn campaign(victim: Victim, kills: usize, seed: u64, mut on_kill: impl FnMut(usize)) -> Figures {
    let mut random = Random(seed);
    let mut figures = Figures { kills, whole_run_s: time_of_a_run(), ..Figures::default() };
    for number in 0..kills {
        let moment = Duration::from_secs_f64(random.part() * figures.whole_run_s);
        trial(victim, number, moment, &mut figures);
        on_kill(number + 1);
    }
    figures
}

fn time_of_a_run() -> f64 {
    let lab = Lab::new();
    let begin = Instant::now();
    let (last, code) = lab.start(&["run", "cell.yaml"]).end();
    assert_eq!(code, Some(0), "a run that nobody kills passes: {last}");
    begin.elapsed().as_secs_f64()
}

fn trial(victim: Victim, number: usize, moment: Duration, figures: &mut Figures) {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell.yaml"]);
    let program = running.process();
    let killer = thread::spawn(move || {
        thread::sleep(moment);
        match victim {
            Victim::Orchestrator => kill_if_there(program),
            Victim::Host => {
                let hosts = hosts_of(program);
                hosts.get(number % hosts.len().max(1)).copied().into_iter().for_each(kill_if_there);
            }
        }
    });
    let mut answers = Vec::new();
    while let Some(event) = running.event_if_whole() {
        if event["event"] == "prompt_answered" {
            answers.push(event["prompt"].clone());
        }
    }
    let _ended = killer.join();
    let code = running.end().1;
    figures.answers += answers.len();
    let mut wrong = |what: String| figures.wrong.push(format!("kill {number} after {moment:?}: {what}"));

    let check = lab.plumb(&["record", "check"]);
    if check.code() != 0 {
        wrong(format!("the record is damaged: {}", check.all()));
    }
    let run = lab.plumb(&["show", "1", "--json"]);
    if run.code() != 0 {
        if answers.is_empty() {
            figures.before_the_record += 1;
        } else {
            wrong(format!("the run is not in the record: {}", run.all()));
        }
        return clean(&lab, number, figures);
    }
    let shown: Value = serde_json::from_str(&run.out()).unwrap();
    let kept: Vec<&Value> =
        shown["prompts"].as_array().unwrap().iter().filter(|one| !one["answer"].is_null()).collect();
    for answer in &answers {
        if !kept.iter().any(|one| one["id"] == *answer) {
            wrong(format!("answer {answer} was shown and is lost"));
        }
    }
    if shown["run"]["state"] == "passed" {
        figures.after_the_end += 1;
        return clean(&lab, number, figures);
    }
    if victim == Victim::Host && code != Some(2) {
        wrong(format!("a run whose host was killed ended with {code:?}"));
    }
    let mut resumed = lab.plumb(&["run", "--resume", "1"]);
    if resumed.code() == 4 {
        figures.looked_at += 1;
        let answers = fs::read_to_string(lab.path("answers.yaml")).unwrap();
        lab.write("answers.yaml", &format!("{answers}confirm_pose: true\n"));
        resumed = lab.plumb(&["run", "--resume", "1"]);
    }
    let found = lab.zeros("1").len() == 3;
    if resumed.code() == 0 && found {
        lab.assert_zeros_found("1");
        figures.resumed += 1;
        let output = resumed.out();
        let step = output
            .split("resumed at ")
            .nth(1)
            .and_then(|rest| rest.split(':').next())
            .unwrap_or("its beginning");
        *figures.steps.entry(without_turn(step)).or_default() += 1;
    } else {
        figures
            .wrong
            .push(format!("kill {number} after {moment:?}: it cannot be taken up again: {}", resumed.all()));
    }
    clean(&lab, number, figures);
}

/// Removes what is left, and looks whether that is everything.
fn clean(lab: &Lab, number: usize, figures: &mut Figures) {
    let cleaned = lab.plumb(&["doctor", "--clean", "cell.yaml"]);
    let resources = CellResources::of_cell(&lab.path("cell.yaml")).unwrap();
    let name = resources.domain().root().file_name().unwrap().to_str().unwrap().to_owned();
    let cell = name.strip_prefix("plumb-cell-").unwrap();
    let entries = fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap().path().display().to_string());
    let left: Vec<String> = entries.filter(|path| path.contains(cell)).collect();
    if !left.is_empty() || !processes_of(cell).is_empty() {
        figures.wrong.push(format!(
            "kill {number}: left behind {left:?} and {:?}: {}",
            processes_of(cell),
            cleaned.all()
        ));
    }
}

fn kill_if_there(process: u32) {
    let pid = nix::unistd::Pid::from_raw(process.cast_signed());
    // One that has ended already was not killed.
    let _ = nix::sys::signal::kill(pid, Signal::SIGKILL);
}

fn without_turn(step: &str) -> String {
    let (before, after) = step.split_once('[').unwrap_or((step, ""));
    format!("{before}{}", after.split_once(']').map_or("", |(_, rest)| rest))
}
