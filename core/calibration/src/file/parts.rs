//! Parts of a model file that cannot be wrong.

use super::raw::{RawMeasuredFrom, RawRevision};
use crate::arm_model::{MeasuredFrom, Revision};

pub(super) fn measured_from(raw: RawMeasuredFrom) -> MeasuredFrom {
    match raw {
        RawMeasuredFrom::Instrument => MeasuredFrom::Instrument,
        RawMeasuredFrom::World => MeasuredFrom::World,
    }
}

pub(super) fn revision(raw: &RawRevision) -> Revision {
    Revision {
        number: raw.number,
        of: raw.of.clone(),
        did: raw.did.clone(),
        data: raw.data.clone(),
        parent: raw.parent,
        rms: raw.rms_mm,
    }
}
