//! Parts of a model file that cannot be wrong.

use super::raw::{RawMeasuredFrom, RawRevision};
use crate::arm_model::{MeasuredFrom, Revision};
use crate::reading_unit::{ReadingUnit, RmsError};

pub(super) fn measured_from(raw: RawMeasuredFrom) -> MeasuredFrom {
    match raw {
        RawMeasuredFrom::Instrument => MeasuredFrom::Instrument,
        RawMeasuredFrom::World => MeasuredFrom::World,
    }
}

pub(super) fn revision(raw: &RawRevision) -> Revision {
    let (lengths, angles) = (
        raw.rms_mm.map(|value| (value, ReadingUnit::Mm)),
        raw.rms_deg.map(|value| (value, ReadingUnit::Deg)),
    );
    Revision {
        number: raw.number,
        of: raw.of.clone(),
        did: raw.did.clone(),
        data: raw.data.clone(),
        parent: raw.parent,
        rms: lengths.or(angles).map(|(value, unit)| RmsError { value, unit }),
    }
}
