//! From the drives of an arm to its joints, where not every joint has a drive of its own.

/// How the drives work the joints.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Transmission {
    /// Every drive moves the joint of the same index; their values are the same.
    #[default]
    Direct,
    /// Cables, belts or gears between them: `joints = matrix * drives`, a row a joint and a column a drive. A column of zeros is a drive that works no joint of
    /// the arm, such as a gripper's.
    Matrix(Vec<Vec<f64>>),
}

impl Transmission {
    /// How many drives there are for so many joints.
    pub fn drives(&self, joints: usize) -> usize {
        match self {
            Self::Direct => joints,
            Self::Matrix(rows) => rows.first().map_or(0, Vec::len),
        }
    }

    /// The joints' values at these values of the drives, rad or mm.
    pub fn joints(&self, drives: &[f64]) -> Vec<f64> {
        match self {
            Self::Direct => drives.to_vec(),
            Self::Matrix(rows) => rows.iter().map(|row| product(row, drives)).collect(),
        }
    }

    /// The moments (N m; forces on slides, N) that the drives have to hold when these act on the joints: by virtual work, the transposed matrix times them.
    pub fn on_drives(&self, moments: &[f64]) -> Vec<f64> {
        match self {
            Self::Direct => moments.to_vec(),
            Self::Matrix(rows) => {
                let mut held = vec![0.0; self.drives(moments.len())];
                for (row, moment) in rows.iter().zip(moments) {
                    for (sum, fraction) in held.iter_mut().zip(row) {
                        *sum += fraction * moment;
                    }
                }
                held
            }
        }
    }
}

fn product(row: &[f64], drives: &[f64]) -> f64 {
    row.iter().zip(drives).map(|(fraction, drive)| fraction * drive).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_matrix() -> impl Strategy<Value = Transmission> {
        prop::collection::vec(prop::collection::vec(-2.0..2.0_f64, 4), 3).prop_map(Transmission::Matrix)
    }

    proptest! {
        #[test]
        fn drives_and_joints_do_the_same_work(
            transmission in any_matrix(),
            turn in prop::collection::vec(-1.0..1.0_f64, 4),
            moments in prop::collection::vec(-5.0..5.0_f64, 3),
        ) {
            let at_joints = product(&moments, &transmission.joints(&turn));
            let at_drives = product(&transmission.on_drives(&moments), &turn);
            prop_assert!((at_joints - at_drives).abs() < 1e-12);
        }
    }

    #[test]
    fn a_direct_drive_is_its_joint() {
        assert_eq!(Transmission::Direct.drives(3), 3);
        assert_eq!(Transmission::Direct.joints(&[0.1, 0.2]), [0.1, 0.2]);
        assert_eq!(Transmission::Direct.on_drives(&[7.0, -2.0]), [7.0, -2.0]);
    }
}
