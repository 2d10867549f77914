//! A simulated robot, and the world it stands in.
