//! From what the lab says to what the screen shows.

use plumb_calibration::arm_model::Model;
use plumb_diagnosis::laboratory::{Comparison, EffectPlot, EffectValue};
use plumb_diagnosis::noise_floor::{Floor, FloorSource};
use plumb_diagnosis::report::StepKind;
use plumb_diagnosis::{Candidate, Claim, Diagnosis, EffectSite, NextPose, Verdict};
use plumb_report::{
    comparison_sentence, diagnosis_sentence, hypothesis_sentence, is_determined, map_in_words, note_in_words,
    percent, rejection_in_words,
};

use super::residuals::Residuals;
use super::state::{Card, CardStatus, ErrorStep, ModelSummary, StripLine};
use crate::shown_unit::shown_unit;

/// The model held against its table, before the candidates are judged.
pub(crate) fn compared(comparison: &Comparison, error_steps: &[ErrorStep]) -> ModelSummary {
    ModelSummary {
        verdict: String::new(),
        at_floor: false,
        sentence: comparison_sentence(comparison),
        unit: comparison.unit,
        floor_mm: comparison.floor.sigma_mm,
        floor_of_a_point_mm: comparison.floor_of_a_point_mm,
        floor_source: source(&comparison.floor).to_owned(),
        not_predictable_mm: comparison
            .explainable
            .as_ref()
            .filter(|explainable| explainable.is_structured())
            .map(|explainable| explainable.not_predictable_mm),
        how_large: how_large(comparison),
        how_much: how_much(comparison),
        where_it_is: where_it_is(comparison),
        row_name: "Line",
        joints: comparison.joints.clone(),
        plots: Vec::new(),
        cards: Vec::new(),
        warnings: comparison.warnings.iter().map(note_in_words).collect(),
        residuals: Residuals { rows: comparison.rows.clone(), series: comparison.series.clone() },
        arm_mm: comparison.arm_points_mm.clone(),
        next: Vec::new(),
        error_steps: error_steps.to_vec(),
    }
}

/// The same with what could explain what is left, and the own plots of that.
pub(crate) fn examined(
    comparison: &Comparison,
    diagnosis: &Diagnosis,
    plots: Vec<EffectPlot>,
    error_steps: &[ErrorStep],
) -> ModelSummary {
    let mut cards = cards(diagnosis);
    cards.extend(comparison.effects.iter().filter(|effect| effect.added).map(added));
    ModelSummary {
        verdict: verdict(diagnosis.verdict).to_owned(),
        at_floor: diagnosis.verdict == Verdict::AtFloor,
        sentence: sentence(diagnosis),
        warnings: diagnosis.warnings.iter().map(note_in_words).collect(),
        cards,
        plots,
        next: diagnosis.next.iter().map(next_pose).collect(),
        ..compared(comparison, error_steps)
    }
}

/// The effects that get a plot of their own: every card's.
pub(crate) fn plotted(comparison: &Comparison, diagnosis: &Diagnosis) -> Vec<String> {
    let added = comparison.effects.iter().filter(|effect| effect.added).map(|effect| effect.label.clone());
    cards(diagnosis).into_iter().map(|card| card.key).chain(added).collect()
}

/// What the lab says, and how sure it is.
fn sentence(diagnosis: &Diagnosis) -> String {
    let hypothesis = diagnosis.hypothesis.as_ref();
    let formula = hypothesis.map_or_else(String::new, |hypothesis| {
        format!(" {} `plumb model diagnose` prints the block.", hypothesis_sentence(hypothesis))
    });
    let sentence = diagnosis_sentence(diagnosis);
    match diagnosis.probability {
        Some(probability) => format!("{sentence} Probability {}.{formula}", percent(probability)),
        None => format!("{sentence}{formula}"),
    }
}

/// The error of a measured point.
fn how_large(comparison: &Comparison) -> StripLine {
    let (fit, unit) = (comparison.error_mm.fit, comparison.unit);
    let held_out = comparison.error_mm.check.map(|check| format!("held out {:.3}", check.rms));
    let noise = comparison
        .floor_of_a_point_mm
        .map_or_else(|| "noise unknown".to_owned(), |noise| format!("noise {noise:.3}"));
    let after = held_out.as_ref().map_or_else(String::new, |held_out| format!("; {held_out}"));
    let inside = held_out.as_ref().map_or_else(String::new, |held_out| format!(" ({held_out})"));
    StripLine {
        full: format!(
            "RMS {:.3}, mean {:.3}, 95 % {:.3}, max {:.3} {unit}{after}; {noise}",
            fit.rms, fit.mean, fit.percentile_95, fit.max
        ),
        short: format!(
            "RMS {:.3}{inside}, 95 % {:.3}, max {:.3} {unit}; {noise}",
            fit.rms, fit.percentile_95, fit.max
        ),
    }
}

/// How much of the error could be explained, and by what kind of knowledge.
fn how_much(comparison: &Comparison) -> StripLine {
    let mapped =
        comparison.residual_map.map_or_else(String::new, |map| format!("; besides, {}", map_in_words(&map)));
    let same = |text: String| StripLine { full: text.clone(), short: text };
    let Some(known) = &comparison.explainable else {
        return same(format!("not asked: too few poses{mapped}"));
    };
    if !known.is_structured() {
        return same(format!(
            "nothing of it is predictable (0.000 \u{b1} {:.3} {}){mapped}",
            known.scatter_mm, known.unit
        ));
    }
    let (to_name, scatter, rest) = (known.to_name_mm, known.scatter_mm, known.not_predictable_mm);
    let (kinds, unit) = (known.kinds().join(" + "), known.unit);
    StripLine {
        full: format!(
            "{to_name:.3} \u{b1} {scatter:.3} {unit}, from {kinds}; {rest:.3} {unit} is not predictable{mapped}"
        ),
        short: format!("{to_name:.3} \u{b1} {scatter:.3} {unit}: {kinds}; {rest:.3} not predictable{mapped}"),
    }
}

/// Joints named at most: the rest are in the plots.
const JOINTS_NAMED: usize = 3;

/// The same in a small terminal.
const JOINTS_NAMED_IN_SHORT: usize = 2;

/// Rows named at most.
const ROWS_NAMED: usize = 3;

/// Along which joints most is left, and in which rows.
fn where_it_is(comparison: &Comparison) -> StripLine {
    let mut joints: Vec<_> = comparison.along_joints.iter().collect();
    joints.sort_by(|one, other| other.rms_mm.total_cmp(&one.rms_mm));
    let along: Vec<String> = joints
        .into_iter()
        .take(JOINTS_NAMED)
        .map(|joint| format!("{} {:.3}", joint.joint, joint.rms_mm))
        .collect();
    let residuals = Residuals { rows: comparison.rows.clone(), series: Vec::new() };
    let lines: Vec<String> = residuals
        .worst()
        .into_iter()
        .take(ROWS_NAMED)
        .filter_map(|row| comparison.rows.get(row))
        .map(|row| row.line.to_string())
        .collect();
    let lines = lines.join(", ");
    let in_short = along.iter().take(JOINTS_NAMED_IN_SHORT).cloned().collect::<Vec<_>>().join(", ");
    match along.is_empty() {
        true => StripLine { full: format!("worst lines {lines}"), short: format!("worst {lines}") },
        false => StripLine {
            full: format!("worst lines {lines}; along {} {} RMS", along.join(", "), comparison.unit),
            short: format!("worst {lines}; {in_short} {} RMS", comparison.unit),
        },
    }
}

/// A pose to measure next, as one reads it off to a controller: joints in degrees, then how to come there and with what.
fn next_pose(pose: &NextPose) -> String {
    let joints: Vec<String> = pose.q_deg.iter().map(|joint| format!("{joint:.0}")).collect();
    let sides: String = pose
        .approach
        .iter()
        .map(|side| match side {
            1.. => '+',
            0 => '0',
            _ => '-',
        })
        .collect();
    let mut text = joints.join(" ");
    if pose.approach.iter().any(|side| *side != 0) {
        text.push_str(&format!(" side {sides}"));
    }
    if pose.payload_kg > 0.0 {
        text.push_str(&format!(" with {} kg", pose.payload_kg));
    }
    text
}

/// The step of the fall that a comparison is.
pub(crate) fn step(added: &str, kind: StepKind, comparison: &Comparison) -> ErrorStep {
    let rms = comparison.rms_mm;
    ErrorStep { added: added.to_owned(), kind, fit_mm: rms.fit, cross_validation_mm: rms.cv }
}

/// What a revision added to the one before it.
pub(crate) fn kind_of_step(before: Option<&Model>, now: &Model) -> StepKind {
    let Some(before) = before else { return StepKind::Start };
    let is_new = |id| !before.effects.iter().any(|known| known.id.same_as(id));
    if now.residual_map.is_some() && before.residual_map.is_none() {
        StepKind::ResidualMap
    } else if now.corrections.iter().any(|correction| is_new(&correction.id)) {
        StepKind::Correction
    } else {
        StepKind::Mechanism
    }
}

fn source(floor: &Floor) -> &'static str {
    match floor.source {
        FloorSource::Repeats => "from repeats",
        FloorSource::Declared => "as declared",
        FloorSource::Unknown => "unknown",
    }
}

/// The verdict as it is over the sentence.
fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::AtFloor => "at floor",
        Verdict::Named => "named",
        Verdict::Located => "located",
        Verdict::Tied => "tied",
        Verdict::Unknown => "unknown",
        Verdict::Blind => "blind",
        Verdict::NotRepeatable => "not repeatable",
        Verdict::FloorUnknown => "floor unknown",
    }
}

/// The candidates as cards. What is named or tied comes first, whether or not it was listed among them.
fn cards(diagnosis: &Diagnosis) -> Vec<Card> {
    let mut cards: Vec<Card> =
        diagnosis.candidates.iter().map(|candidate| card(candidate, diagnosis)).collect();
    let listed =
        |effect: &EffectSite| diagnosis.candidates.iter().any(|candidate| candidate.effect == *effect);
    if let Some(named) = diagnosis.named.as_ref().filter(|named| !listed(&named.effect)) {
        let size = measured(named.size, named.se, &named.unit);
        cards.push(unlisted(&named.effect, size, CardStatus::Named, Vec::new()));
    }
    for tied in diagnosis.tied.iter().filter(|tied| !listed(tied)) {
        cards.push(unlisted(tied, String::new(), CardStatus::Tied, ties(tied, diagnosis)));
    }
    cards.sort_by_key(|card| match card.status {
        CardStatus::Named => 0,
        CardStatus::Tied => 1,
        CardStatus::Rejected | CardStatus::InModel => 2,
    });
    cards
}

/// The card of an effect that is named or tied and was not listed.
fn unlisted(effect: &EffectSite, size: String, status: CardStatus, ties: Vec<String>) -> Card {
    let arguments: Vec<String> = [Some(effect.site.clone()), effect.with.clone()]
        .into_iter()
        .flatten()
        .chain(effect.n.map(|n| n.to_string()))
        .chain(effect.of.clone())
        .filter(|argument| !argument.is_empty())
        .collect();
    let name = &effect.effect;
    Card {
        key: if arguments.is_empty() { name.clone() } else { format!("{name}({})", arguments.join(", ")) },
        effect: name.clone(),
        site: site_in_words(effect),
        size,
        ties,
        status,
        ..Card::default()
    }
}

/// The card of an effect that is in the model.
fn added(effect: &EffectValue) -> Card {
    let (_, arguments) = effect.label.split_once('(').unwrap_or((effect.label.as_str(), ""));
    let reason = match effect.claim {
        Claim::Mechanism => String::new(),
        Claim::Correction => format!("a correction, which may be {}", effect.may_be.join(", or ")),
    };
    Card {
        key: effect.label.clone(),
        effect: effect.effect.clone(),
        site: arguments.trim_end_matches(')').to_owned(),
        size: match effect.held {
            true => "not estimated: these rows cannot determine it".to_owned(),
            false => measured(effect.size, effect.se, &effect.unit),
        },
        status: CardStatus::InModel,
        reason,
        ..Card::default()
    }
}

/// What cannot be distinguished from an effect, if it is among those that are tied.
fn ties(effect: &EffectSite, diagnosis: &Diagnosis) -> Vec<String> {
    if !diagnosis.tied.contains(effect) {
        return Vec::new();
    }
    let others = diagnosis.tied.iter().filter(|other| *other != effect);
    others.map(|other| format!("{} {}", other.effect, site_in_words(other))).collect()
}

fn card(candidate: &Candidate, diagnosis: &Diagnosis) -> Card {
    let is_tied = diagnosis.tied.contains(&candidate.effect);
    let is_named = diagnosis.named.as_ref().is_some_and(|named| named.effect == candidate.effect);
    Card {
        key: candidate.label.clone(),
        effect: candidate.effect.effect.clone(),
        site: site_in_words(&candidate.effect),
        size: measured(candidate.size, candidate.se, &candidate.unit),
        gain_mm: candidate.cv_gain,
        leaves_mm: candidate.leaves_mm,
        holm_p: Some(candidate.holm_p),
        probability: candidate.probability,
        ties: ties(&candidate.effect, diagnosis),
        status: match (is_named, is_tied) {
            (true, _) => CardStatus::Named,
            (false, true) => CardStatus::Tied,
            (false, false) => CardStatus::Rejected,
        },
        reason: candidate.rejected.as_ref().map_or_else(String::new, rejection_in_words),
    }
}

/// Where an effect acts, with what distinguishes it from its like.
fn site_in_words(effect: &EffectSite) -> String {
    let mut text = effect.site.clone();
    if let Some(with) = &effect.with {
        text.push_str(&format!(" with {with}"));
    }
    if let Some(n) = effect.n {
        text.push_str(&format!(" n={n}"));
    }
    if let Some(of) = &effect.of {
        text.push_str(&format!(" of {of}"));
    }
    text
}

/// A size with its standard error, both to the digits the error leaves meaning in.
fn measured(size: f64, error: f64, unit: &str) -> String {
    if !is_determined(error) {
        return "size not determined".to_owned();
    }
    let unit = shown_unit(unit);
    let text = if error <= 0.0 || size.abs().max(error) < 1e-3 {
        format!("{size:.2e} \u{b1} {error:.0e} {unit}")
    } else {
        // One digit more than the first of the error.
        let digits = (1.0 - error.log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{size:.digits$} \u{b1} {error:.digits$} {unit}")
    };
    text.trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_is_written_to_the_digits_its_error_leaves() {
        assert_eq!(measured(0.731_42, 0.012_3, "deg"), "0.731 \u{b1} 0.012 deg");
        assert_eq!(measured(1.9e-4, 1.0e-6, "rad/(N m)"), "1.90e-4 \u{b1} 1e-6 rad/(N m)");
        assert_eq!(measured(12.0, 3.0, "1"), "12.0 \u{b1} 3.0");
        assert_eq!(measured(1.0, f64::NAN, "mm"), "size not determined");
        assert_eq!(measured(1.0, f64::INFINITY, "mm"), "size not determined");
    }
}
