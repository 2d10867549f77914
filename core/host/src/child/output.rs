//! What a plugin prints through the C library.

#![allow(unsafe_code, reason = "the C library's own stream has no safe name in Rust")]

use nix::libc;

unsafe extern "C" {
    /// The C library's standard output. Its name is the same in glibc and musl.
    static stdout: *mut libc::FILE;
}

/// Makes the C library write what a plugin prints at once. To a pipe it would keep some thousand bytes back, which a host that crashes, or ends
/// without running a plugin's destructors, would lose.
pub(super) fn write_at_once() {
    // SAFETY: the stream is the C library's own and nobody has written to it yet, as setvbuf demands; without a buffer of ours there is nothing to
    // keep alive.
    let refused = unsafe { libc::setvbuf(stdout, std::ptr::null_mut(), libc::_IONBF, 0) };
    if refused != 0 {
        eprintln!("what the plugin prints may come late: the C library keeps its buffer");
    }
}
