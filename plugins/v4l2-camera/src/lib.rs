//! A camera of this computer, through the kernel's Video4Linux 2: pictures go out on a stream, in grey, each with the moment of its exposure.
//!
//! What the kernel does is behind one trait, `capture::Capture`, in the module `kernel`. `film` decides which pictures are kept and notices those that are
//! late, lost or damaged, `grey` makes 8 bits of grey of what the camera sends, `recorder` takes the pictures off the kernel's hands in a thread of its own, and
//! [`V4l2Camera`] is the plugin.

mod camera;
mod capture;
mod config;
mod film;
mod grey;
#[cfg(target_os = "linux")]
mod kernel;
#[cfg(not(target_os = "linux"))]
#[path = "no_kernel.rs"]
mod kernel;
mod recorder;
#[cfg(test)]
mod tests;

pub use camera::V4l2Camera;
