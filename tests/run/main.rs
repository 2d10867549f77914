//! Runs of the cells as a user starts them: real processes, real plugins behind their hosts, a simulated world.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that cannot go on fails")]

mod agin_report;
mod agin_steps;
mod answering;
mod bad_input;
mod broken;
mod campaign;
mod cell_trial;
mod clouds;
mod corrections;
mod cup;
mod design;
mod doctor;
mod dry_run;
mod export;
mod help;
mod hosts;
mod init;
mod interrupted;
mod json_events;
mod killed;
mod lab;
mod left_behind;
mod light_stripe;
mod logs;
mod manual;
mod model_bad_input;
mod model_claims;
mod package;
mod passed;
mod pictures;
mod plugins;
mod power_cycle;
mod procedures;
mod reader_gone;
mod refused;
mod remembering;
mod rig_corrections;
mod schema;
mod serial;
mod stripe_bad_input;
mod stripe_serial;
mod stripes;
mod tables_people_have;
mod target;
