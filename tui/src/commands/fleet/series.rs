//! Values over time and cells.

use plumb_central::{Central, CentralError, CorrectionPoint, EffectPoint};
use serde::Serialize;

/// What a series is of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Asked {
    /// The correction of a joint of a device.
    Correction { device: String, site: String },
    /// The numbers of an effect at a site.
    Effect { effect: String, site: String },
}

/// What cannot be asked.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum AskedError {
    #[error("`{0}` is no correction: write DEVICE.JOINT, as in arm.waist")]
    NoCorrection(String),
    #[error("`{0}` is no effect: write KIND(PLACE), as in joint_compliance(shoulder)")]
    NoEffect(String),
}

impl Asked {
    pub(super) fn correction(text: &str) -> Result<Self, AskedError> {
        let parts = text.split_once('.').ok_or_else(|| AskedError::NoCorrection(text.to_owned()))?;
        Ok(Self::Correction { device: parts.0.to_owned(), site: parts.1.to_owned() })
    }

    pub(super) fn effect(text: &str) -> Result<Self, AskedError> {
        let parts = effect_and_site(text).ok_or_else(|| AskedError::NoEffect(text.to_owned()))?;
        Ok(Self::Effect { effect: parts.0.to_owned(), site: parts.1.to_owned() })
    }
}

/// `kind(site)` taken apart; a kind without a site has an empty one.
fn effect_and_site(text: &str) -> Option<(&str, &str)> {
    let Some((kind, rest)) = text.split_once('(') else {
        return (!text.is_empty() && !text.contains(')')).then_some((text, ""));
    };
    rest.strip_suffix(')').map(|site| (kind, site))
}

/// One value of a series over cells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct SeriesPoint {
    pub(super) cell: String,
    pub(super) record: String,
    pub(super) time: String,
    pub(super) what: String,
    pub(super) value: f64,
    pub(super) uncertainty: Option<f64>,
    pub(super) unit: String,
}

impl SeriesPoint {
    fn of_correction(point: &CorrectionPoint) -> Self {
        Self {
            cell: point.cell.clone(),
            record: point.record.clone(),
            time: point.proposed.clone(),
            what: point.quantity.clone(),
            value: point.value,
            uncertainty: point.uncertainty,
            unit: point.unit.clone(),
        }
    }

    fn of_effect(point: &EffectPoint) -> Self {
        Self {
            cell: point.cell.clone(),
            record: point.record.clone(),
            time: point.made.clone(),
            what: point.parameter.clone(),
            value: point.value,
            uncertainty: None,
            unit: String::new(),
        }
    }

    /// Values with the same key make one series: one quantity, one cell.
    pub(super) fn key(&self) -> (&str, &str, &str) {
        (&self.what, &self.cell, &self.record)
    }
}

/// All values of what is asked, of all cells or of those with one arm: quantity by quantity, cell by cell, the oldest first.
pub(super) async fn points(
    central: &mut Central,
    asked: &Asked,
    arm: Option<&str>,
) -> Result<Vec<SeriesPoint>, CentralError> {
    let mut points: Vec<SeriesPoint> = match asked {
        Asked::Correction { device, site } => {
            central.corrections(device, site, arm).await?.iter().map(SeriesPoint::of_correction).collect()
        }
        Asked::Effect { effect, site } => {
            central.effects(effect, site, arm).await?.iter().map(SeriesPoint::of_effect).collect()
        }
    };
    // The order of time stays within a key: the sort is stable.
    points.sort_by(|one, other| one.key().cmp(&other.key()));
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_effect_is_taken_apart_at_its_brackets() {
        assert_eq!(effect_and_site("joint_compliance(shoulder)"), Some(("joint_compliance", "shoulder")));
        assert_eq!(effect_and_site("joint_harmonic(pan, 12)"), Some(("joint_harmonic", "pan, 12")));
        assert_eq!(effect_and_site("drift"), Some(("drift", "")));
        assert_eq!(effect_and_site("joint_gain(elbow"), None);
        assert_eq!(effect_and_site("elbow)"), None);
    }
}
