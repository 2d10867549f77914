//! The geometry of a robot's model file, as the times of a plan need it: zeros that were found, and sides from which joints arrive, left out.

use nalgebra::{IsometryMatrix3, Vector3};
use plumb_calibration::prediction::{self, Pose};

use crate::step::Geometry;
use crate::workcell::ModelFile;

impl Geometry for ModelFile {
    fn flange(&self, joints: &[f64]) -> IsometryMatrix3<f64> {
        self.forward.flange(&self.model_joints(joints), &no_sides(self, joints))
    }

    fn tips(&self, target: Option<&str>, joints: &[Vec<f64>]) -> Option<Vec<Vector3<f64>>> {
        let pose = |joints: &Vec<f64>| Pose {
            q: self.model_joints(joints),
            approach: no_sides(self, joints),
            payload: 0.0,
        };
        let poses: Vec<Pose> = joints.iter().map(pose).collect();
        prediction::points(&self.model, target, &poses).ok()
    }
}

fn no_sides(model: &ModelFile, joints: &[f64]) -> Vec<i8> {
    model.model_sides(&vec![0; joints.len()], None)
}
