//! An infrared proximity sensor whose switching line another device reads.
