//! Real bytes over a real pseudo-terminal.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test that cannot go on fails")]

mod all_conversations;
mod conversation;
mod ports;
mod pseudo_terminal;
