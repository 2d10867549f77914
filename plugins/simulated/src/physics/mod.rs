//! Serial arms with the imperfections of real ones, made by their mechanics.
//!
//! An arm is a product of exponentials ([`shape`], [`link_frames`]) built from the rows of a description ([`description`]); where its drives do
//! not turn its joints one by one, a [`transmission`] lies between them. Every imperfection ([`imperfection`]) is a mechanism with its own
//! small physics: in the drive ([`drive`]), in what yields to load ([`elastic`]), in the arm's shape, and in what time and heat do to it
//! ([`slow_change`]). A [`machine::Machine`] is driven through moves and rests where
//! forces balance; a [`campaign`] drives one through a measurement as a user would, and writes down what the user would have.
//!
//! The lab's own effects and kinematics live elsewhere and share no code with this: what the lab finds here it has found, not remembered.

pub mod arms;
pub mod campaign;
pub mod description;
pub mod drive;
pub mod elastic;
pub mod imperfection;
pub mod link_frames;
pub mod machine;
pub mod random;
pub mod rigid;
pub mod rotation_vector;
pub mod shape;
pub mod slow_change;
pub mod transmission;
