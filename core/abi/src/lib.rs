//! The C contract between plumb and a plugin.
