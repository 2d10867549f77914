//! An arm on its way through the visits of a campaign, read without noise.

use super::instrument::Instrument;
use super::specification::{Approach, Specification};
use super::visit::Visit;
use crate::physics::imperfection::Imperfection;
use crate::physics::machine::{Conditions, Machine, NoEquilibrium};

/// Drives an arm with these imperfections through the visits and reads the instrument, without noise: one row of readings a visit.
pub fn run(
    specification: &Specification,
    visits: &[Visit],
    imperfections: &[Imperfection],
) -> Result<Vec<Vec<f64>>, NoEquilibrium> {
    let mut machine = Machine::new(&specification.arm, imperfections);
    let instrument = Instrument::new(specification.reading, imperfections);
    machine.go(&vec![0.0; specification.arm.joints.len()], 0.0);
    let read = |visit: &Visit| {
        if specification.approach == Approach::EitherSide {
            machine.go(&visit.beyond(), visit.time_s);
        }
        machine.go(&visit.commanded, visit.time_s);
        let conditions = Conditions {
            time_s: visit.time_s,
            temperature_c: visit.temperature_c,
            payload_kg: visit.payload_kg,
        };
        Ok(instrument.read(&machine.equilibrium(&conditions)?.link_frames))
    };
    visits.iter().map(read).collect()
}

/// Root mean square difference of two sets of readings, per reading.
pub(super) fn rms_difference(left: &[f64], right: &[f64]) -> f64 {
    let sum: f64 = left.iter().zip(right).map(|(a, b)| (a - b).powi(2)).sum();
    (sum / left.len().max(1) as f64).sqrt()
}
