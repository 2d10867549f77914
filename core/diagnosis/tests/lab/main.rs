//! The laboratory through its public face: small made-up machines, tables and files.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod among_structure;
mod bad_input;
mod corrections;
mod defined_effects;
mod explainable;
mod families;
mod far_starts;
mod fixed_machines;
mod linear_axes;
mod made_up;
mod measurement_kinds;
mod next_poses;
mod not_shown;
mod point_errors;
mod remainders;
mod reports;
mod residual_maps;
mod returns;
mod same_arm;
mod sensor_effects;
mod sessions;
mod spreadsheets;
mod undeclared_noise;
mod unknown_masses;
mod urdf_files;
