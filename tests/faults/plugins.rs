//! Plugins that flood, take memory without end, or are exchanged; each an arm in C by the published contract, changed.

use std::fs;

use crate::lab::{Lab, kill};
use crate::moments::message;
use crate::run_hosts::arm_in_c;
use crate::{Happened, Row};

pub(crate) const ROWS: &[&Row] = &[
    &Row {
        name: "plugin_floods",
        done: "a plugin that prints 20,000 lines in every move",
        promise: "the run passes; less than 3 MB in the record, and what was left out is counted",
        happens: floods,
    },
    &Row {
        name: "plugin_eats_memory",
        done: "a plugin that takes memory without end in a cell that gives it 150 MB",
        promise: "its host ends, the run ends with 2 and both numbers",
        happens: eats_memory,
    },
    &Row {
        name: "plugin_exchanged",
        done: "a plugin's library exchanged and its host killed while the run goes on, with a retry decided beforehand",
        promise: "the other library is not loaded; the run ends with 2 and says which file was changed",
        happens: exchanged,
    },
];

const NO_COMPILER: &str = "there is no C compiler";

/// Where the arm in C begins to move.
const IN_A_MOVE: &str = "    double from[JOINTS], way";

fn floods() -> Happened {
    let lab = Lab::new();
    let line =
        "for (int line = 0; line < 20000; line++) printf(\"line %d of what nobody wants to read\\n\", line);";
    let changed = |text: String| {
        text.replace("#include <math.h>\n", "#include <math.h>\n#include <stdio.h>\n")
            .replace(IN_A_MOVE, &format!("    {line}\n{IN_A_MOVE}"))
    };
    if !arm_in_c(&lab, changed) {
        return Happened::PassedOver(NO_COMPILER.to_owned());
    }
    let run = lab.plumb(&["run", "cell-c.yaml", "--record", "record"]);
    assert_eq!(run.code(), 0, "{}", run.err());
    let files = fs::read_dir(lab.path("record")).unwrap();
    let size: u64 = files.map(|entry| entry.unwrap().metadata().unwrap().len()).sum();
    assert!(size < 3_000_000, "the record has {size} bytes");
    Happened::Kept(format!(
        "{} kB in the record; {}",
        size / 1000,
        crate::line_with(&run.all(), "left out here")
    ))
}

fn eats_memory() -> Happened {
    let lab = Lab::new();
    let eat = "for (;;) { char *more = malloc(10000000); if (more == NULL) break; memset(more, 1, 10000000); wait_one_step(); }";
    if !arm_in_c(&lab, |text| text.replace(IN_A_MOVE, &format!("    {eat}\n{IN_A_MOVE}"))) {
        return Happened::PassedOver(NO_COMPILER.to_owned());
    }
    lab.edit("cell-c.yaml", "{plugin: counting-arm}", "{plugin: counting-arm, memory_limit_mb: 150}");
    let run = lab.plumb(&["run", "cell-c.yaml"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    Happened::Kept(crate::line_with(&run.all(), "150 MB"))
}

fn exchanged() -> Happened {
    let lab = Lab::new();
    let slow = |text: String| text.replace("#define MAX_SPEED_RAD_S 1.0", "#define MAX_SPEED_RAD_S 0.1");
    if !arm_in_c(&lab, slow) {
        return Happened::PassedOver(NO_COMPILER.to_owned());
    }
    lab.write("decide.yaml", "answers: {}\non_error: {aside: retry}\n");
    let mut running = lab.start(&["run", "cell-c.yaml", "--answers", "decide.yaml"]);
    running.until_moving_in("aside");
    let arm = running.host_of("libcounting_arm");
    arm_in_c(&lab, |text| text);
    kill(arm);
    let (last, code) = running.end();
    assert_eq!(code, Some(2), "{last}");
    assert!(message(&last).contains("was changed while the run goes on"), "{last}");
    Happened::Kept(message(&last))
}
