//! Point clouds: what a scan has made, as files (PLY, PCD, E57, MCAP) and as fitted surfaces (plane, sphere, pyramid).
//!
//! Positions are mm in the robot's base frame. Files of other programs that count in metres are converted when they are read.
//!
//! ```
//! use plumb_cloud::{Cloud, CloudPoint};
//!
//! let grid = (0..20).flat_map(|x| (0..20).map(move |y| [f64::from(x), f64::from(y), 5.0]));
//! let point = |position: [f64; 3]| CloudPoint { position: position.into(), stripe: 0, seen: Default::default() };
//! let cloud = Cloud { points: grid.map(point).collect(), ..Cloud::default() };
//! let plane = cloud.fit_plane()?;
//! assert!((plane.offset_mm - 5.0).abs() < 1e-9 && plane.normal.z > 0.999);
//! # Ok::<(), plumb_cloud::FitError>(())
//! ```

mod cloud;
mod columns;
mod e57;
mod errors;
mod foxglove;
mod number_format;
mod pcd;
mod ply;
mod pyramid;
mod read;
mod scalars;
mod scan_files;
mod surface;
mod write;

pub use cloud::{Cloud, CloudPoint};
pub use errors::{ReadError, WriteError};
pub use foxglove::CloudCamera;
pub use pyramid::PyramidFit;
pub use read::read;
pub use surface::{FitError, PlaneFit, SphereFit};
pub use write::write;
