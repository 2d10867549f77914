//! The screens tested from outside: events and keys go in, state, actions and drawn pages come out.

mod browsing;
mod colours;
mod fixtures;
mod modelling;
mod operating;
mod pages;
mod panicking;
mod reading;
mod scanning;
mod simulating;
