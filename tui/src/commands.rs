//! The commands of the program, one file each: what is typed, and what is printed.

pub(crate) mod answer;
pub(crate) mod certificate;
pub(crate) mod check;
pub(crate) mod completions;
pub(crate) mod doctor;
pub(crate) mod emulate;
pub(crate) mod fleet;
pub(crate) mod history;
pub(crate) mod host;
pub(crate) mod init;
pub(crate) mod man;
pub(crate) mod model;
pub(crate) mod note;
pub(crate) mod plugins;
pub(crate) mod record;
pub mod run;
pub(crate) mod schema;
pub(crate) mod serve;
pub(crate) mod ship;
pub(crate) mod show;
pub mod stripe;
pub mod study;
pub(crate) mod target;
pub mod trial;
pub(crate) mod watch;
pub(crate) mod world;
