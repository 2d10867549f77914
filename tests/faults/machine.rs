//! What befalls the machine: its clock, and what a process may have.

use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};

use crate::lab::Lab;
use crate::moments::assert_sound;
use crate::{Happened, Row};

pub(crate) const ROWS: &[&Row] = &[
    &Row {
        name: "clock_set_back",
        done: "the clock of the program and all its hosts an hour back from the middle of the run on (a library put before the system's)",
        promise: "the run passes with the true zeros, the record is sound, and its runs stand in their order",
        happens: clock_set_back,
    },
    &Row {
        name: "few_files",
        done: "no more than 20 open files allowed",
        promise: "`run` ends with words that name the limit and `ulimit -n`, or raises it and passes",
        happens: few_files,
    },
];

/// A library before the system's that takes an hour off the time of day once a file is there.
const LATE: &str = r#"
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>
static int ask(clockid_t clock, struct timespec *time) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    return real(clock, time);
}
static time_t shift(void) {
    const char *file = getenv("LATE_SINCE");
    return file && access(file, F_OK) == 0 ? 3600 : 0;
}
int clock_gettime(clockid_t clock, struct timespec *time) {
    int result = ask(clock, time);
    if (result == 0 && clock == CLOCK_REALTIME) time->tv_sec -= shift();
    return result;
}
int gettimeofday(struct timeval *restrict time, void *restrict zone) {
    struct timespec now;
    (void)zone;
    ask(CLOCK_REALTIME, &now);
    time->tv_sec = now.tv_sec - shift();
    time->tv_usec = now.tv_nsec / 1000;
    return 0;
}
time_t time(time_t *result) {
    struct timespec now;
    ask(CLOCK_REALTIME, &now);
    if (result) *result = now.tv_sec - shift();
    return now.tv_sec - shift();
}
"#;

fn clock_set_back() -> Happened {
    let lab = Lab::new();
    lab.write("late.c", LATE);
    let library = lab.path("liblate.so");
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-o"]).arg(&library).arg(lab.path("late.c")).arg("-ldl");
    if !compiler.status().is_ok_and(|status| status.success()) {
        return Happened::PassedOver("there is no C compiler".to_owned());
    }
    let mut command = lab.command(&["run", "cell.yaml", "--json"]);
    command.env("LD_PRELOAD", &library).env("LATE_SINCE", lab.path("late"));
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    for line in BufReader::new(child.stdout.take().unwrap()).lines() {
        let event: serde_json::Value = serde_json::from_str(&line.unwrap()).unwrap();
        if event["event"] == "step_started" && event["step"] == "waist.lower" {
            lab.write("late", "");
        }
    }
    assert_eq!(child.wait().unwrap().code(), Some(0), "the run passes");
    let shown = lab.shown("1");
    let (began, ended) = (shown["run"]["started"].clone(), shown["run"]["ended"].clone());
    assert!(ended.as_str() < began.as_str(), "the clock was set back: {}", shown["run"]);
    lab.assert_zeros_found("1");
    let again = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(again.code(), 0, "{}", again.all());
    assert_sound(&lab);
    Happened::Kept(format!("passed; begun {began}, ended {ended}"))
}

fn few_files() -> Happened {
    let lab = Lab::new();
    let mut command = lab.command(&[]);
    let program = command.get_program().to_owned();
    let variables: Vec<_> =
        command.get_envs().filter_map(|(name, value)| Some((name.to_owned(), value?.to_owned()))).collect();
    command = Command::new("sh");
    command.args(["-c", "ulimit -n 20; timeout 60 \"$PLUMB\" run cell.yaml --headless"]);
    command.envs(variables).env("PLUMB", program).current_dir(lab.path("."));
    let run = crate::lab::CommandOutput::of(command.output().unwrap());
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.err().contains("ulimit -n"), "{}", run.all());
    Happened::Kept(crate::line_with(&run.err(), "ulimit"))
}
