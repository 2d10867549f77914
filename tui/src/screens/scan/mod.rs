//! The Scan screen: a cloud that turns, moves and zooms, its points measured by a cursor, a plane seen edge-on, and pictures of any view.

mod band;
mod command;
mod eye;
mod picture;
mod raster;
mod scale;
mod state;
mod update;
mod view;

pub(crate) use command::ScanCommand;
pub(crate) use eye::Viewpoint;
pub(crate) use picture::{PictureSize, picture};
pub(crate) use state::{Colouring, ScanState, Strokes};
pub(crate) use update::{click, drag, grab, obey, scroll, take};
pub(crate) use view::view;
