//! Where there is no Linux there is no Video4Linux.

use plumb_plugin::PluginError;

use crate::capture::Capture;
use crate::config::Config;

/// Opens no camera.
pub(crate) fn open(config: &Config) -> Result<Box<dyn Capture>, PluginError> {
    Err(PluginError::Unsupported(format!(
        "{}: cameras are reached through Video4Linux, which Linux alone has",
        config.device().display()
    )))
}
