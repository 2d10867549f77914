//! Frames and chains of joints: forward kinematics, derivatives, gravity moments, inverse.
