//! The camera with a driver that plays back buffers that were written down, and without one.

mod recorded;
mod without_hardware;
