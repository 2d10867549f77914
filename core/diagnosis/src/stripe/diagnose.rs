//! What is the matter beyond zeros and rig: the suspects are ranked by what the classical adjustment leaves, the best are adjusted for real and judged
//! by scans they were not adjusted to.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::adjust::{Adjustment, SETTLED, adjust, huber, weight};
use super::options::AdjustError;
use super::problem::{Member, Problem, State};
use super::suspect::{Suspect, classical, suspect_of, suspects, variants};
use super::{Options, Scans, StripeRig, Surface};
use plumb_calibration::arm_model::Model;
use plumb_calibration::effect::{EffectId, Spot};

/// What can be said.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StripeVerdict {
    /// Zeros and rig explain the stripes to within what the pictures' noise leaves.
    AtFloor,
    /// One suspect explains what they leave.
    Named,
    /// Several explain it about as well.
    Tied,
    /// None does.
    Unknown,
}

impl StripeVerdict {
    /// All there are.
    pub const ALL: [Self; 4] = [Self::AtFloor, Self::Named, Self::Tied, Self::Unknown];

    /// As reports write it.
    pub fn word(self) -> &'static str {
        match self {
            Self::AtFloor => "at_floor",
            Self::Named => "named",
            Self::Tied => "tied",
            Self::Unknown => "unknown",
        }
    }
}

/// A suspect that was adjusted for real.
#[derive(Debug, Clone)]
pub struct Tried {
    /// Who.
    pub suspect: Suspect,
    /// With it added.
    pub adjustment: Adjustment,
    /// By how much the Bayesian criterion is better than without it, each view counted as three independent readings, and twice the logarithm of the number of
    /// suspects taken off: the best of many is good by chance. Above 10 is beyond doubt.
    pub bic_gain: f64,
    /// By how much it brings the mean square residual of scans down that were left out, as a share; and the standard error of that.
    pub held_out_gain: (f64, f64),
}

/// What was found out.
#[derive(Debug, Clone)]
pub struct StripeDiagnosis {
    /// In a word.
    pub verdict: StripeVerdict,
    /// Zeros and rig alone (and what had been added before).
    pub classical: Adjustment,
    /// Root mean square distance that the pictures' noise alone would leave, mm.
    pub floor_mm: f64,
    /// Those adjusted for real, the best first.
    pub tried: Vec<Tried>,
    /// One plain sentence.
    pub sentence: String,
}

/// Suspects adjusted for real.
const FOR_REAL: usize = 6;

/// Scans are left out in so many turns.
const FOLDS: usize = 4;

/// Gains of left-out scans are compared to within some percent: nearer adjustments would not change what is said.
const SETTLED_FOR_COMPARISON: f64 = 1e-4;

/// Independent readings in a stripe: where it lies, how it is turned, how it bends.
const A_STRIPE_TELLS: f64 = 3.0;

/// A gain in the Bayesian criterion that is beyond doubt.
const BEYOND_DOUBT: f64 = 10.0;

/// Suspects that are nearer to the best in the Bayesian criterion are as good.
const AS_GOOD: f64 = 6.0;

/// Left-out scans have to gain so many standard errors of their gain.
const SURE: f64 = 2.0;

/// Where no more is left than the pictures' noise would leave, left-out scans have to gain this share of it: an effect that was named and is not quite as it is
/// modelled leaves some percent behind (a wheel's second order), which others can mimic.
const SUBSTANTIAL: f64 = 0.2;

/// A suspect of which the free numbers swallow more than this share cannot be told from them.
const SWALLOWED: f64 = 0.9999;

/// Effects that are looked at further, once the best of them leaves more than noise: may it and so many more explain everything together?
const LOOK_AHEAD: usize = 2;

/// What is left may be so many times the scatter of neighbouring points before something is at work that is smooth along a stripe: pixels and the fit of the
/// stripe's middle scatter a little alike from row to row, so that in simulated worlds with everything right it is 1.08 to 1.11 times.
const QUIET: f64 = 1.2;

/// What one look has brought.
struct Look {
    classical: Adjustment,
    floor_mm: f64,
    tried: Vec<Tried>,
}

/// Diagnoses; `added` are suspects that have been named before and are adjusted together with zeros and rig.
///
/// # Errors
/// [`AdjustError`]
pub fn diagnose(
    model: &Model,
    rig: &StripeRig,
    surfaces: &[Surface],
    scans: &Scans,
    added: &[Suspect],
) -> Result<StripeDiagnosis, AdjustError> {
    let look_with = |added: &[Suspect]| look(model, rig, surfaces, scans, added);
    let Look { classical, floor_mm, tried } = look_with(added)?;
    let mut verdict = judge(&classical, &tried);
    let named = matches!(verdict, StripeVerdict::Named | StripeVerdict::Tied);
    let mut together = Vec::new();
    if let Some(best) = tried.first().filter(|best| named && !is_quiet(&best.adjustment)) {
        // An effect is named beside others only if all of them together leave nothing but noise: else it may stand in for what has no name.
        let settled_with = |added: &[Suspect]| settled(model, rig, surfaces, scans, added);
        together = explained(best, &classical, added, &settled_with, &look_with)?;
        if together.is_empty() {
            verdict = StripeVerdict::Unknown;
        }
    }
    let sentence = sentence(verdict, &classical, floor_mm, &tried, &together);
    Ok(StripeDiagnosis { verdict, classical, floor_mm, tried, sentence })
}

/// The effects, the best first, with which hardly anything but noise is left; none where that is not reached.
fn explained(
    best: &Tried,
    classical: &Adjustment,
    added: &[Suspect],
    settled_with: &impl Fn(&[Suspect]) -> Result<Adjustment, AdjustError>,
    look_with: &impl Fn(&[Suspect]) -> Result<Look, AdjustError>,
) -> Result<Vec<String>, AdjustError> {
    let mut all: Vec<Suspect> = added.to_vec();
    all.push(best.suspect.clone());
    for ahead in 0..=LOOK_AHEAD {
        if accounts_for(&settled_with(&all)?, classical) {
            return Ok(all.into_iter().skip(added.len()).map(|suspect| suspect.name).collect());
        }
        if ahead == LOOK_AHEAD {
            break;
        }
        let next = look_with(&all)?;
        match next.tried.into_iter().next().filter(|more| helps(more, &next.classical)) {
            Some(more) => all.push(more.suspect),
            None => break,
        }
    }
    Ok(Vec::new())
}

/// The adjustment with these effects, each point given to its surface anew: without them many lie so far off that they count as another surface's, or as none.
fn settled(
    model: &Model,
    rig: &StripeRig,
    surfaces: &[Surface],
    scans: &Scans,
    added: &[Suspect],
) -> Result<Adjustment, AdjustError> {
    adjust(model, rig, surfaces, &scans.views, &scans.pixels, &with_added(model, added))
}

/// Share of what was there beyond noise that may be left of an effect which is not quite as it is modelled: play while a joint stands inside it. What merely
/// stands in for another effect left a sixth and more in simulated worlds, play itself a twentieth.
const NOT_QUITE: f64 = 0.1;

/// Whether an adjustment leaves nothing but noise, or hardly anything of what there was.
fn accounts_for(adjustment: &Adjustment, classical: &Adjustment) -> bool {
    let beyond = |one: &Adjustment| (one.rms_mm.powi(2) - one.noise_mm.powi(2)).max(0.0).sqrt();
    is_quiet(adjustment) || beyond(adjustment) <= NOT_QUITE * beyond(classical)
}

/// Whether nothing is left but the scatter of neighbouring points.
fn is_quiet(adjustment: &Adjustment) -> bool {
    adjustment.rms_mm <= QUIET * adjustment.noise_mm
}

/// The classical adjustment with what was added, and the best suspects adjusted for real.
fn look(
    model: &Model,
    rig: &StripeRig,
    surfaces: &[Surface],
    scans: &Scans,
    added: &[Suspect],
) -> Result<Look, AdjustError> {
    let options = with_added(model, added);
    let mut problem = Problem::new(model, &scans.views, options)?;
    let mut state = problem.beginning(rig, surfaces);
    problem.solve(&mut state, &scans.pixels, 12.0)?;
    let floor_mm = problem.floor_mm();
    let known = |suspect: &Suspect| added.iter().any(|added| added.family == suspect.family);
    let all: Vec<Suspect> =
        suspects(model, &scans.views).into_iter().filter(|suspect| !known(suspect)).collect();
    let choice = 2.0 * (all.len().max(1) as f64).ln();
    let best = ranked(&problem, &state, all)?;
    let before = problem.held_out(&state, scans)?;
    let plain = problem.chi_square(&state);
    let views = problem.views_seen();
    let mut tried = Vec::new();
    for suspect in best {
        let (wider, start) = problem.with(&state, &suspect.options)?;
        let mut there = start.clone();
        if wider.settle(&mut there, SETTLED).is_err() {
            continue;
        }
        let after = wider.held_out(&start, scans)?;
        let readings = A_STRIPE_TELLS * views as f64;
        let more = (wider.unknowns(&there) - problem.unknowns(&state)) as f64;
        let bic_gain = readings * (plain / wider.chi_square(&there)).ln() - more * readings.ln() - choice;
        let held_out_gain = gain(&before, &after);
        tried.push(Tried { suspect, adjustment: wider.told(there), bic_gain, held_out_gain });
    }
    tried.sort_by(|a, b| b.bic_gain.total_cmp(&a.bic_gain));
    Ok(Look { classical: problem.told(state), floor_mm, tried })
}

/// The classical numbers and those of suspects that have been named.
pub fn with_added(model: &Model, added: &[Suspect]) -> Options {
    let mut options = classical(model);
    for suspect in added {
        options.rig.extend(&suspect.options.rig);
        options.effects.extend(suspect.options.effects.iter().cloned());
    }
    options
}

/// The same suspects, what is searched for inside an effect (the moment at which a joint stiffens) set to what explains the stripes best.
///
/// # Errors
/// [`AdjustError`]
pub fn resolved(
    model: &Model,
    rig: &StripeRig,
    surfaces: &[Surface],
    scans: &Scans,
    added: Vec<Suspect>,
) -> Result<Vec<Suspect>, AdjustError> {
    let mut all: Vec<Suspect> = Vec::new();
    for suspect in added {
        let variants: Vec<Suspect> = match suspect.options.effects.as_slice() {
            [id] => variants(id, model, &scans.views).into_iter().map(|id| suspect_of(id, model)).collect(),
            _ => vec![suspect.clone()],
        };
        let mut best: Option<(f64, Suspect)> = None;
        for variant in &variants {
            if variants.len() == 1 {
                best = Some((0.0, variant.clone()));
                break;
            }
            let with: Vec<Suspect> = all.iter().chain([variant]).cloned().collect();
            let options = with_added(model, &with);
            let left = adjust(model, rig, surfaces, &scans.views, &scans.pixels, &options)?.chi_square;
            if best.as_ref().is_none_or(|(least, _)| left < *least) {
                best = Some((left, variant.clone()));
            }
        }
        all.push(best.map_or(suspect, |(_, best)| best));
    }
    Ok(all)
}

/// The suspects that would bring the weighted squares down most, by the linear estimate, those first whose gain is greatest; one of a family.
fn ranked(problem: &Problem<'_>, state: &State, all: Vec<Suspect>) -> Result<Vec<Suspect>, AdjustError> {
    let residuals = problem.residuals(state);
    let weights = residuals.map(weight);
    let mut jacobian = problem.jacobian(state);
    for (mut row, weight) in jacobian.row_iter_mut().zip(weights.iter()) {
        row.scale_mut(*weight);
    }
    let mut normal = jacobian.tr_mul(&jacobian);
    for place in 0..normal.nrows() {
        normal[(place, place)] *= 1.0 + 1e-9;
    }
    let normal = normal.cholesky().ok_or(AdjustError::Diverged)?;
    let mut turns = Turns { problem, state, weights: &weights, of_joints: Vec::new() };
    let weighted = residuals.component_mul(&weights);
    let solved = normal.solve(&jacobian.tr_mul(&weighted));
    let mut scored = Vec::new();
    for suspect in all {
        let columns = turns.columns(&suspect)?;
        if let Some(score) = score(&columns, &jacobian, &normal, (&weighted, &solved)) {
            scored.push((score, suspect));
        }
    }
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut best: Vec<Suspect> = Vec::new();
    for (_, suspect) in scored {
        if best.len() < FOR_REAL && !best.iter().any(|known| known.family == suspect.family) {
            best.push(suspect);
        }
    }
    Ok(best)
}

/// How the weighted residuals change with suspects. Most effects turn one joint, each in its own way: what a turn of the joint does is worked out once.
struct Turns<'p, 'm> {
    problem: &'p Problem<'m>,
    state: &'p State,
    weights: &'p DVector<f64>,
    /// Joint, and what a change of its coordinate does.
    of_joints: Vec<(usize, DVector<f64>)>,
}

impl Turns<'_, '_> {
    fn columns(&mut self, suspect: &Suspect) -> Result<DMatrix<f64>, AdjustError> {
        let [id] = suspect.options.effects.as_slice() else { return self.added(&suspect.options) };
        let Some((joint, rates)) = self.problem.rates(id)? else { return self.added(&suspect.options) };
        let sign = self.problem.model.chain.joints.get(joint).map_or(1.0, |row| row.sign);
        let turn = self.of_joint(joint)?;
        let rate = |member: &Member, parameter: usize| {
            let of_view = rates.get(member.pixel.view).and_then(|rates| rates.get(parameter));
            sign * of_view.copied().unwrap_or(0.0)
        };
        let count = rates.first().map_or(0, Vec::len);
        let members = &self.problem.members;
        Ok(DMatrix::from_fn(members.len(), count, |row, parameter| {
            members.get(row).map_or(0.0, |member| rate(member, parameter) * turn[row])
        }))
    }

    fn of_joint(&mut self, joint: usize) -> Result<DVector<f64>, AdjustError> {
        if let Some((_, known)) = self.of_joints.iter().find(|(known, _)| *known == joint) {
            return Ok(known.clone());
        }
        let zero = EffectId::at("joint_zero", Spot::Joint(joint));
        let columns = self.added(&Options { rig: Vec::new(), effects: vec![zero] })?;
        let turn = columns.column(0).into_owned();
        self.of_joints.push((joint, turn.clone()));
        Ok(turn)
    }

    fn added(&self, options: &Options) -> Result<DMatrix<f64>, AdjustError> {
        let (wider, start) = self.problem.with(self.state, options)?;
        Ok(wider.added_columns(self.problem, &start, self.weights))
    }
}

/// How far these columns would bring the weighted squares down, what the free numbers do for them taken off; none when nothing is left of them.
fn score(
    columns: &DMatrix<f64>,
    jacobian: &DMatrix<f64>,
    normal: &Cholesky<f64, Dyn>,
    (residuals, solved): (&DVector<f64>, &DVector<f64>),
) -> Option<f64> {
    let shared = jacobian.tr_mul(columns);
    let own = columns.tr_mul(columns);
    let left = &own - shared.tr_mul(&normal.solve(&shared));
    // What these scans do not show at all is swallowed as well: a clock that is wrong where nothing moved.
    let swallowed = |place: usize| left[(place, place)] <= (1.0 - SWALLOWED) * own[(place, place)];
    if (0..own.nrows()).all(swallowed) {
        return None;
    }
    let toward = columns.tr_mul(residuals) - shared.tr_mul(solved);
    let solved = left.pseudo_inverse(1e-9 * own.amax()).ok()? * &toward;
    Some(toward.dot(&solved))
}

/// The mean gain over scans and its standard error, as shares of what there was.
fn gain(before: &[f64], after: &[f64]) -> (f64, f64) {
    let count = before.len().min(after.len()).max(1) as f64;
    let all: f64 = before.iter().sum::<f64>() / count;
    let gains: Vec<f64> = before.iter().zip(after).map(|(before, after)| (before - after) / all).collect();
    let mean = gains.iter().sum::<f64>() / count;
    let variance =
        gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0) / count;
    (mean, variance.sqrt())
}

/// Whether a suspect is better than none beyond doubt, and scans it was not adjusted to agree.
fn helps(tried: &Tried, classical: &Adjustment) -> bool {
    let (gain, error) = tried.held_out_gain;
    let enough = if is_quiet(classical) { SUBSTANTIAL } else { 0.0 };
    tried.bic_gain > BEYOND_DOUBT && gain > (SURE * error).max(enough)
}

fn judge(classical: &Adjustment, tried: &[Tried]) -> StripeVerdict {
    match tried {
        [best, others @ ..] if helps(best, classical) => match others.first() {
            Some(second) if best.bic_gain - second.bic_gain < AS_GOOD => StripeVerdict::Tied,
            _ => StripeVerdict::Named,
        },
        _ if is_quiet(classical) => StripeVerdict::AtFloor,
        _ => StripeVerdict::Unknown,
    }
}

fn sentence(
    verdict: StripeVerdict,
    classical: &Adjustment,
    floor_mm: f64,
    tried: &[Tried],
    together: &[String],
) -> String {
    let (rms, noise) = (classical.rms_mm, classical.noise_mm);
    let best = tried.first();
    let name = best.map_or("", |best| best.suspect.name.as_str());
    let with = best.map_or(rms, |best| best.adjustment.rms_mm);
    match verdict {
        StripeVerdict::AtFloor => format!(
            "Zeros and rig leave {rms:.3} mm, about what neighbouring points scatter by ({noise:.3} mm): nothing else shows."
        ),
        StripeVerdict::Named => {
            let others = together.get(1..).unwrap_or_default();
            let beside = match others {
                [] => String::new(),
                others => format!(
                    " Nothing but noise is left only with {} as well: add it and diagnose again.",
                    others.join(" and ")
                ),
            };
            format!(
                "{name} is what zeros and rig cannot explain: with it {rms:.3} mm become {with:.3} mm (the pictures' noise: {floor_mm:.3} mm), and scans it was not adjusted to agree.{beside}"
            )
        }
        StripeVerdict::Tied => {
            let close = |tried: &&Tried| best.is_some_and(|best| best.bic_gain - tried.bic_gain < AS_GOOD);
            let names: Vec<&str> =
                tried.iter().filter(close).map(|tried| tried.suspect.name.as_str()).collect();
            format!(
                "{} explain what zeros and rig leave ({rms:.3} mm) about equally well: scan from more sides, or with the other arm.",
                names.join(" and ")
            )
        }
        StripeVerdict::Unknown => {
            let over = |left: f64| left / noise.max(1e-9);
            let nearest = best.filter(|best| helps(best, classical)).map_or_else(String::new, |best| {
                format!(
                    " {} comes nearest, but {:.3} mm are left even with it, {:.1} times the noise: it is not named, for it may stand in for something else.",
                    best.suspect.name, best.adjustment.rms_mm, over(best.adjustment.rms_mm)
                )
            });
            format!(
                "Zeros and rig leave {rms:.3} mm, {:.1} times what neighbouring points scatter by, and nothing that is known explains it.{nearest}",
                over(rms)
            )
        }
    }
}

impl Problem<'_> {
    /// What the points' own uncertainties would leave, mm.
    fn floor_mm(&self) -> f64 {
        let squares: f64 = self.members.iter().map(|member| member.sigma_mm.powi(2)).sum();
        (squares / self.members.len().max(1) as f64).sqrt()
    }

    fn chi_square(&self, state: &State) -> f64 {
        self.residuals(state).iter().map(|residual| huber(*residual)).sum()
    }

    fn views_seen(&self) -> usize {
        let mut views: Vec<usize> = self.members.iter().map(|member| member.pixel.view).collect();
        views.dedup();
        views.len()
    }

    /// How the weighted residuals change with what this problem seeks beyond another.
    fn added_columns(&self, plain: &Problem<'_>, state: &State, weights: &DVector<f64>) -> DMatrix<f64> {
        let rig = plain.options.rig.len()..self.options.rig.len();
        let effects =
            self.options.rig.len() + plain.effect_values()..self.options.rig.len() + self.effect_values();
        let here = self.here(state);
        let slope = |unknown| self.slope(state, unknown, &here).component_mul(weights);
        let columns: Vec<DVector<f64>> = rig.chain(effects).map(slope).collect();
        DMatrix::from_columns(&columns)
    }

    /// The mean of the (bounded) squared residuals of each scan, adjusted without it and its fold.
    fn held_out(&self, state: &State, scans: &Scans) -> Result<Vec<f64>, AdjustError> {
        let fold_of = |view: usize| scans.scan_of_view.get(view).copied().unwrap_or(0) % FOLDS;
        let mut sums = vec![(0.0, 0.0); scans.names.len()];
        for fold in 0..FOLDS {
            let (mut taught, mut there) = self.with(state, &Options::default())?;
            taught.members.retain(|member| fold_of(member.pixel.view) != fold);
            taught.settle(&mut there, SETTLED_FOR_COMPARISON)?;
            taught.members.clone_from(&self.members);
            let residuals = taught.residuals(&there);
            for (member, residual) in self.members.iter().zip(residuals.iter()) {
                let scan = scans.scan_of_view.get(member.pixel.view).copied().unwrap_or(0);
                if scan % FOLDS == fold
                    && let Some((sum, count)) = sums.get_mut(scan)
                {
                    *sum += huber(*residual);
                    *count += 1.0;
                }
            }
        }
        Ok(sums.iter().filter(|(_, count)| *count > 0.0).map(|(sum, count)| sum / count).collect())
    }
}
