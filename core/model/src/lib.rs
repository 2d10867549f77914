//! The model lab: measurement tables, effects, fitting, criticism and next poses. Knows no device.
