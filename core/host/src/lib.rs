//! The process around one plugin: loading, limits, watchdog.
