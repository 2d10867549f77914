//! Where the pixels of a picture lie by a model: for a table whose stripes are not yet given to surfaces.

use nalgebra::Vector3;

use super::residual_model::ResidualModel;
use super::state::State;
use crate::arm_model::StripeRig;

impl ResidualModel<'_> {
    /// Where the pixels of a picture lie in a state, frame of the measurements, mm; `row` is the picture's. None for a pixel whose ray misses the sheet of light.
    pub fn stripe_points(&self, state: &State, row: usize, pixels: &[[f64; 2]]) -> Vec<Option<Vector3<f64>>> {
        let mut scratch = self.scratch(state);
        self.assume(row, &mut scratch);
        let pose = &scratch.pose;
        let points = pixels.iter().map(|[u, v]| pose.rig.as_ref()?.point(*u, *v));
        points.map(|point| Some(pose.at_flange(point?.coords).0)).collect()
    }

    /// The rig of the light stripe as it is in a state; none where the model has none.
    pub fn rig(&self, state: &State) -> Option<StripeRig> {
        let mut scratch = self.scratch(state);
        self.assume(0, &mut scratch);
        scratch.pose.rig
    }
}
