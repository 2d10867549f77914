//! `plumb run --dry-run`: the plan, with nothing started.

use std::io;
use std::process::ExitCode;

use plumb_cell::engine::{DryRun, DryStep, OpenRepetition, PlannedMotion, dry_run};
use plumb_cell::event::RunOutcome;

use super::Arguments;
use super::headless::duration;
use super::prepare::{Refused, Requested, requested};
use crate::print_line::print_line;
use crate::step_numbers::{step_count, step_numbers, steps_in_words};

/// Prints what the run would do. The exit code is 4 when it could not start without somebody there.
pub(super) fn plan(arguments: &Arguments) -> Result<ExitCode, Refused> {
    let Requested { request, .. } = requested(arguments)?;
    let plan = dry_run(&request)?;
    if arguments.json {
        print_line!("{}", serde_json::to_string_pretty(&plan)?)?;
    } else {
        print(&plan)?;
    }
    let beyond = beyond_limits(&plan);
    if !beyond.is_empty() {
        beyond.iter().for_each(|sentence| eprintln!("plumb: {sentence}"));
        return Ok(ExitCode::from(RunOutcome::Error.exit_code()));
    }
    Ok(match &plan.needs_operator {
        None => ExitCode::SUCCESS,
        Some(reason) => {
            eprintln!("plumb: this would need an operator: {reason}");
            ExitCode::from(RunOutcome::NeedsOperator.exit_code())
        }
    })
}

/// The moves that would go beyond a joint's limits, a sentence each.
pub(super) fn beyond_limits(plan: &DryRun) -> Vec<String> {
    let moves = plan.steps.iter().flat_map(|step| step.moves.iter().map(move |motion| (step, motion)));
    let beyond = moves.filter_map(|(step, PlannedMotion { robot, joint, how, beyond, .. })| {
        let beyond = beyond.as_ref()?;
        let step = &step.step;
        Some(match joint {
            Some(joint) => {
                format!("step `{step}` would send {robot} {joint} {how}, beyond its limits: {beyond}")
            }
            // The hand, or the tip, of the robot.
            None if how.starts_with('\'') => format!("step `{step}` would send {robot}{how}: {beyond}"),
            None => format!("step `{step}` would have {robot} {how}: {beyond}"),
        })
    });
    beyond.collect()
}

fn print(plan: &DryRun) -> io::Result<()> {
    print_line!("{} in {}: {}", plan.procedure, plan.cell, plan.title)?;
    let parameters: Vec<String> =
        plan.parameters.iter().map(|(name, value)| format!("{name} = {value}")).collect();
    if !parameters.is_empty() {
        print_line!("parameters: {}", parameters.join(", "))?;
    }
    let asks = plan.steps.iter().filter(|step| step.asks).count();
    let depths: Vec<u32> = plan.steps.iter().map(|step| step.depth).collect();
    print_line!(
        "{}, {asks} of which ask; {}, prompts left out; nothing was started",
        steps_in_words(&depths),
        match plan.least_s {
            Some(least) => format!(
                "about {} to {}, by how soon a repetition ends ({})",
                duration(least),
                duration(plan.estimate_s),
                turns_in_words(&plan.repetitions)
            ),
            None => format!("about {}", duration(plan.estimate_s)),
        }
    )?;
    print_line!()?;
    for (number, step) in step_numbers(&depths).into_iter().zip(&plan.steps) {
        print_step(number, step_count(&depths), step)?;
    }
    print_line!()?;
    for sentence in &plan.safety {
        print_line!("{sentence}")?;
    }
    Ok(())
}

/// Repetitions named at most: one inside another is there in each of its turns.
const MOST_REPETITIONS: usize = 3;

/// How many turns repetitions have, and how long a turn takes.
fn turns_in_words(repetitions: &[OpenRepetition]) -> String {
    let shown = repetitions.iter().take(MOST_REPETITIONS).map(|OpenRepetition { step, turns, turn_s }| {
        format!("{step}: 1 to {turns} turns of about {}", duration(*turn_s))
    });
    let more = (repetitions.len() > MOST_REPETITIONS).then(|| "and others".to_owned());
    shown.chain(more).collect::<Vec<_>>().join("; ")
}

fn print_step(number: Option<usize>, all: usize, step: &DryStep) -> io::Result<()> {
    let width = all.to_string().len();
    let number = number.map_or_else(String::new, |number| number.to_string());
    let time = match step.estimate_s {
        Some(seconds) if seconds >= 0.5 => format!(", about {}", duration(seconds)),
        _ => String::new(),
    };
    let asks = if step.asks { ", asks" } else { "" };
    let indent = "  ".repeat(step.depth as usize);
    print_line!(
        "[{number:>width$}/{all}] {indent}{}: {} ({}{asks}{time})",
        step.step,
        step.title,
        step.kind
    )?;
    let margin = " ".repeat(2 * width + 4);
    if let Some(when) = &step.when {
        let left_out = if step.is_left_out { ", which does not hold" } else { "" };
        print_line!("{margin}{indent}only when {when}{left_out}")?;
    }
    for motion in &step.moves {
        print_line!("{margin}{indent}{}", moved(motion))?;
    }
    Ok(())
}

fn moved(motion: &PlannedMotion) -> String {
    let PlannedMotion { robot, joint, how, speed, limits, beyond } = motion;
    let joint = match joint {
        Some(joint) => format!(" {joint} "),
        // The hand, or the tip, of the robot.
        None if how.starts_with('\'') => String::new(),
        None => " ".to_owned(),
    };
    let beyond = if beyond.is_some() { ": BEYOND THEM" } else { "" };
    format!("moves {robot}{joint}{how}, at {:.0} % of full speed, within {limits}{beyond}", speed * 100.0)
}
