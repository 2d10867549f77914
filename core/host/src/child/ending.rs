//! The end of the process when a call of the plugin may hang.

#![allow(
    unsafe_code,
    reason = "ending a process whose plugin hangs in a destructor needs the bare system call"
)]

use crate::context::Context;

/// Ends the process without running anything of the plugin's, when one of its calls may hang for ever.
pub(super) fn end_at_once(context: &Context, code: u8) -> ! {
    context.flush();
    // SAFETY: ends the process; nothing runs afterwards.
    unsafe { nix::libc::_exit(i32::from(code)) }
}
