//! Studies as a developer starts them: real processes, real plugins behind their hosts, simulated worlds.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    dead_code,
    reason = "a test that cannot go on fails; some of what it shares with the tests of the program it does not use"
)]

mod benchmark;
#[path = "../../../run/lab.rs"]
mod lab;
mod method;
mod stripes;
