//! Builds what is installed of plumb. One tree of files, laid out as under `/usr`, is made once; the archive holds it as it is, the Debian package
//! under `usr/`.
//!
//! It needs `cargo`, `strip` (binutils, which a C compiler brings), GNU `tar` and, for the Debian package, `dpkg-deb`, which every Debian has. It
//! takes no crate and no cargo command that would have to be installed first.

mod debian;
mod error;
mod files;
mod licences;
pub mod package;
mod run;
mod stage;
mod written_against;
