//! Hosts as real processes, plugins as real libraries, shared memory as it is.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

mod c_plugin;
mod clock;
mod conforming;
mod faults;
mod flooding;
mod frozen;
mod leaving;
mod loading;
mod serving;
mod stopping;
mod test_folder;
