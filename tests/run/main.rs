//! Runs of the TeachMover cell as a user starts them: real processes, real plugins behind their hosts, a simulated world.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that cannot go on fails")]

mod broken;
mod doctor;
mod interrupted;
mod lab;
mod left_behind;
mod passed;
mod plugins;
mod procedures;
mod refused;
mod serial;
mod studies;
