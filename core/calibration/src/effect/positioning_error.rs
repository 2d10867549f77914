//! The positioning error of a slide over its travel (EXX of ISO 230-1): straight lines between knots, as a compensation table has it.

use nalgebra::DMatrix;

use super::kind::{CandidateContext, DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Effect, EffectId, EffectNameError, Parameter, Sample, Size, Unit, standard_error};

/// Most pieces: those between the 256 lines that a compensation table of LinuxCNC has at most.
const MOST_PIECES: f64 = 255.0;

/// Greatest error of a working axis, mm.
const GREATEST: f64 = 5.0;

/// Limits as far apart, mm, are none.
const LONGEST: f64 = 1e5;

#[derive(Debug)]
struct PositioningError {
    joint: usize,
    low: f64,
    /// Length of a piece, mm.
    piece: f64,
    /// Of the knots but the first, where the error is zero: an error that is the same everywhere is the joint's zero.
    parameters: Vec<Parameter>,
}

impl PositioningError {
    /// The two knots beside a coordinate (0 is the first, at the lower limit) with their shares.
    fn knots(&self, coordinate: f64) -> [(usize, f64); 2] {
        let pieces = self.parameters.len();
        // Beyond the limits the error stays what it is at the end: an extrapolated line would run away.
        let along = ((coordinate - self.low) / self.piece).clamp(0.0, pieces as f64);
        let before = (along.floor() as usize).min(pieces.saturating_sub(1));
        let fraction = along - before as f64;
        [(before, 1.0 - fraction), (before + 1, fraction)]
    }
}

impl Effect for PositioningError {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        let knots = self.knots(sample.coordinate(self.joint));
        contributions.extend(knots.into_iter().filter_map(|(knot, fraction)| {
            Some(sample.contribute_to_joint(self.joint, knot.checked_sub(1)?, fraction))
        }));
    }

    fn changes_coordinate(&self) -> Option<usize> {
        Some(self.joint)
    }

    /// From the least to the greatest error of the knots.
    fn size(&self, values: &[f64], covariance: &DMatrix<f64>) -> Size {
        // The knot at the lower limit is zero by definition: it may be the least or the greatest, and has no variance.
        let knots =
            values.iter().copied().enumerate().map(|(knot, value)| (Some(knot), value)).chain([(None, 0.0)]);
        let least = knots.clone().min_by(|one, other| one.1.total_cmp(&other.1)).unwrap_or((None, 0.0));
        let greatest = knots.max_by(|one, other| one.1.total_cmp(&other.1)).unwrap_or((None, 0.0));
        // Var(a - b) = Var(a) + Var(b) - 2 Cov(a, b).
        let variance = entry(covariance, greatest.0, greatest.0) + entry(covariance, least.0, least.0)
            - 2.0 * entry(covariance, greatest.0, least.0);
        Size { value: greatest.1 - least.1, unit: "mm", error: standard_error(variance) }
    }
}

/// The covariance of two knots; 0 with the first, which is zero by definition.
fn entry(covariance: &DMatrix<f64>, one: Option<usize>, other: Option<usize>) -> f64 {
    one.zip(other).and_then(|index| covariance.get(index)).copied().unwrap_or(0.0)
}

pub(super) const KIND: Kind = Kind {
    name: "positioning_error",
    family: Family::Joint,
    sites: SiteKind::JointsAndPieces,
    geometry_group: false,
    depends_on_conditions: false,
    // With enough knots it is any function of the coordinate.
    imitates_anything: true,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Coordinate,
    sentence: "A slide's error over its travel (ISO 230-1: EXX), in so many straight pieces between its limits.",
    how_to_see: "Positions in every piece of the travel, from both sides, as ISO 230-2 has it.",
    sketch: ["      ╱╲___", "  ───╱     ╲ error", "  ├──┼──┼──┼─ travel"],
    build: |setting: &Setting<'_>| {
        let joint = setting.joint()?;
        if !setting.slides(joint) {
            return Err(setting.unusable("is of a joint that slides"));
        }
        let pieces =
            setting.id.order.filter(|pieces| pieces.fract() == 0.0 && (1.0..=MOST_PIECES).contains(pieces));
        let pieces = pieces.ok_or_else(|| EffectNameError::Malformed {
            text: setting.model.label(setting.id),
            example: "positioning_error(x, 10): joint and number of straight pieces, 1 to 255".to_owned(),
        })?;
        let (low, high) = setting.model.chain.joints.get(joint).map_or((0.0, 0.0), |row| row.limits);
        // A joint without limits has those of the reader, a kilometre either way.
        if high - low > LONGEST {
            return Err(
                setting.unusable("needs the axis's travel in the model file, as in `limits_mm: [0, 400]`")
            );
        }
        let piece = (high - low) / pieces;
        let knots = 1..=pieces as usize;
        let parameters =
            knots.map(|knot| Parameter::new(&format!("knot_{knot}_mm"), Unit::MM, (-GREATEST, GREATEST)));
        Ok(Box::new(PositioningError { joint, low, piece, parameters: parameters.collect() }))
    },
    // It is a map, not a mechanism: what it holds may be any. It is added by name.
    candidates: |_| Vec::new(),
};

/// A piece of the travel (from, to, mm) whose end nothing was measured near, so that no data say where the map's knot there is: none in the piece before it nor
/// in that after.
pub(super) fn unmeasured(context: &CandidateContext<'_>, id: &EffectId) -> Option<(f64, f64)> {
    (id.name == KIND.name).then_some(())?;
    let joint = id.joint()?;
    let (low, high) = context.model.chain.joints.get(joint)?.limits;
    let pieces = id.order?;
    let (piece, positions) = ((high - low) / pieces, context.summary.positions.get(joint)?);
    let knots = (0..=pieces as usize).map(|knot| low + piece * knot as f64);
    let lonely = knots
        .into_iter()
        .find(|knot| positions.iter().all(|position| (position - knot).abs() >= piece * NEAR))?;
    Some(((lonely - piece).max(low), (lonely + piece).min(high)))
}

/// A knot is measured where a position lies so near, in pieces: farther out its share of the line is too small to say where it is.
const NEAR: f64 = 0.75;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm_model::Model;
    use crate::effect::{self, DatasetSummary};
    use crate::forward::rates;
    use crate::table::Table;

    const AXIS: &str = "
arm: axis
convention: distal
joints: [{name: x, slides: true, limits_mm: [100, 500]}, {name: turn}]
targets: {p1: {}}
";

    fn built(text: &str, effect: &str) -> Result<Box<dyn Effect>, EffectNameError> {
        let model = Model::parse("axis.yaml", text).unwrap();
        effect::parse(effect, &model).and_then(|id| effect::build(&id, &model))
    }

    #[test]
    fn it_runs_straight_between_its_knots_from_zero_at_the_lower_limit() {
        let (model, built) =
            (Model::parse("axis.yaml", AXIS).unwrap(), built(AXIS, "positioning_error(x, 4)").unwrap());
        let at = |x: f64| rates(&model, built.as_ref(), &[x, 0.0], &[]);
        assert_eq!(at(100.0), [0.0; 4]);
        assert_eq!(at(150.0), [0.5, 0.0, 0.0, 0.0]);
        assert_eq!(at(375.0), [0.0, 0.25, 0.75, 0.0]);
        assert_eq!(at(500.0), [0.0, 0.0, 0.0, 1.0]);
        assert_eq!(at(510.0), [0.0, 0.0, 0.0, 1.0], "beyond its end it stays as it is there");
    }

    #[test]
    fn its_size_is_from_the_least_to_the_greatest_with_their_common_error() {
        let built = built(AXIS, "positioning_error(x, 3)").unwrap();
        let covariance = DMatrix::from_row_slice(3, 3, &[4e-6, 1e-6, 0.0, 1e-6, 9e-6, 0.0, 0.0, 0.0, 1e-6]);
        let size = built.size(&[0.02, -0.01, 0.005], &covariance);
        assert!(
            (size.value - 0.03).abs() < 1e-12 && (size.error - 11e-6_f64.sqrt()).abs() < 1e-12,
            "{size:?}"
        );
        let one_side = built.size(&[0.02, 0.01, 0.005], &covariance);
        assert_eq!(
            built.size(&[0.0; 3], &DMatrix::zeros(3, 3)).error,
            f64::INFINITY,
            "nothing was determined"
        );
        assert!(
            (one_side.value - 0.02).abs() < 1e-12 && (one_side.error - 2e-3).abs() < 1e-12,
            "{one_side:?}"
        );
    }

    #[test]
    fn what_it_cannot_be_made_of_is_refused_with_the_reason() {
        for (text, effect, reason) in [
            (AXIS.to_owned(), "positioning_error(turn, 4)", "is of a joint that slides"),
            (AXIS.to_owned(), "positioning_error(x, 2.5)", "number of straight pieces, 1 to 255"),
            (AXIS.to_owned(), "positioning_error(x, 300)", "number of straight pieces, 1 to 255"),
            (AXIS.to_owned(), "positioning_error(x)", "positioning_error(joint, pieces)"),
            (
                AXIS.replace(", limits_mm: [100, 500]", ""),
                "positioning_error(x, 4)",
                "as in `limits_mm: [0, 400]`",
            ),
        ] {
            let message = built(&text, effect).unwrap_err().to_string();
            assert!(message.contains(reason), "{effect}: {message}");
        }
    }

    #[test]
    fn a_piece_nobody_measured_is_found() {
        let model = Model::parse("axis.yaml", AXIS).unwrap();
        let hole = |positions: &[f64]| {
            let rows: String = positions.iter().map(|x| format!("{x},0,{x},0,0\n")).collect();
            let table =
                Table::parse("t.csv", &format!("q1_mm,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm\n{rows}")).unwrap();
            let summary = DatasetSummary::of(&model, &table);
            let id = effect::parse("positioning_error(x, 4)", &model).unwrap();
            unmeasured(&CandidateContext { model: &model, summary: &summary }, &id)
        };
        assert_eq!(hole(&[110.0, 190.0, 310.0, 420.0, 490.0]), None);
        assert_eq!(hole(&[110.0, 190.0, 210.0, 420.0, 490.0]), Some((200.0, 400.0)));
        assert_eq!(hole(&[110.0, 190.0, 310.0, 390.0]), Some((400.0, 500.0)));
    }
}
