//! A light stripe range sensor: a camera and a sheet of light, fixed to one another and carried by a robot's hand (Agin 1985).
//!
//! [`extract`] finds the stripe in a picture, [`geometry`] turns its pixels into points of the flange's frame, [`frame`] reads pictures from files, and
//! [`LightStripe`] is the plugin: pictures come in from another device or from files, points go out on a stream, each picture's with the pose of
//! the robot at the moment of its exposure.

mod config;
pub mod extract;
pub mod frame;
pub mod geometry;
mod pose;
mod quantity;
mod rays;
mod sensor;

pub use sensor::LightStripe;
