//! Where plugins are looked for.

use std::path::PathBuf;

use clap::Args;

/// Where plugins are looked for.
#[derive(Args)]
pub(crate) struct PluginDirectories {
    /// A further directory to look for plugins in; may be given several times.
    #[arg(long = "plugins", value_name = "DIR")]
    pub(super) directories: Vec<PathBuf>,
}
