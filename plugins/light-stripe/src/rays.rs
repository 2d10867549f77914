//! What camera and projector are calibrated by: rays in the flange's frame, and the rig they were computed with.

use nalgebra::Vector2;
use plumb_plugin::Quantity;

use crate::extract::RowPoint;
use crate::geometry::{Rig, SheetFrame};
use crate::quantity::quantity;

/// The rig's own numbers: where its lens is, mm, its focal lengths, px, its sheet n.x + d = 0, and the frame of the file's sheet, in which corrections of
/// the sheet are expressed.
pub(crate) fn rig_quantities(rig: &Rig, drawn_sheet: Option<&SheetFrame>) -> Vec<Quantity> {
    let lens = rig.flange_from_camera.translation.vector;
    let normal = rig.plane.normal;
    let mut named = vec![
        ("lens_x", lens.x),
        ("lens_y", lens.y),
        ("lens_z", lens.z),
        ("sheet_x", normal.x),
        ("sheet_y", normal.y),
        ("sheet_z", normal.z),
        ("sheet_d", rig.plane.d_mm),
        ("focal_u", rig.camera.fx_px),
        ("focal_v", rig.camera.fy_px),
    ];
    if let Some(SheetFrame { middle, along, .. }) = drawn_sheet {
        named.extend([
            ("middle_x", middle.x),
            ("middle_y", middle.y),
            ("middle_z", middle.z),
            ("along_x", along.x),
            ("along_y", along.y),
            ("along_z", along.z),
        ]);
    }
    named.into_iter().map(|(name, value)| quantity(name, value, 0.0)).collect()
}

/// The ends of the straight line through a stripe's rays: on a plane a sheet of light makes one. Nothing for fewer than three rows.
pub(crate) fn line_quantities(rig: &Rig, points: &[RowPoint]) -> Vec<Quantity> {
    let pixel = |point: &RowPoint| Vector2::new(f64::from(point.centre), f64::from(point.row));
    let rays: Vec<Vector2<f64>> = points.iter().filter_map(|point| rig.ray(pixel(point))).collect();
    let Some((at_0, slope)) = line(&rays) else { return Vec::new() };
    let ends = rays
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), ray| (least.min(ray.y), most.max(ray.y)));
    let named = [
        ("top_x", at_0 + slope * ends.0),
        ("top_y", ends.0),
        ("bottom_x", at_0 + slope * ends.1),
        ("bottom_y", ends.1),
    ];
    named.map(|(name, value)| quantity(name, value, 0.0)).to_vec()
}

/// x as a straight line of y, by least squares: its value at 0 and its slope.
fn line(rays: &[Vector2<f64>]) -> Option<(f64, f64)> {
    let count = rays.len() as f64;
    let middle = rays.iter().sum::<Vector2<f64>>() / count.max(1.0);
    let (mut shared, mut spread) = (0.0, 0.0);
    for ray in rays {
        let away = ray - middle;
        shared += away.x * away.y;
        spread += away.y * away.y;
    }
    if rays.len() < 3 || spread <= 0.0 {
        return None;
    }
    let slope = shared / spread;
    Some((middle.x - slope * middle.y, slope))
}
