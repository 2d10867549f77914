//! Which poses to measure next: where the effects in question differ most, for what is known of each.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::landing::{self, Ground};
use super::outcome::{NextPose, Verdict};
use super::search::{self, Contender};
use super::trial::Fitted;
use super::unlisted;
use super::verdict::Finding;
use crate::file::AddedEffect;
use crate::fit::{Machine, Observations, State};
use crate::floor::{Floor, Returns, typical_sigma};
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::progress::Progress;
use crate::statistics::Random;
use crate::table::{Names, Table};

/// A half-space nothing of the arm may enter: points with `normal . x < offset` are forbidden; base frame, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeepOut {
    /// Unit normal, away from what is forbidden.
    pub normal: [f64; 3],
    /// mm.
    pub offset: f64,
}

/// What poses are wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// New poses, not counting the repeats.
    pub count: usize,
    /// Where the arm must not go.
    pub keep_out: Vec<KeepOut>,
    /// Loads that can be carried, kg; none given means those of the table.
    pub payloads: Vec<f64>,
}

/// Poses to measure, and what they would settle.
#[derive(Debug, Clone, Serialize)]
pub struct NextPoses {
    /// The poses: new ones, then returns to the first two.
    pub next: Vec<NextPose>,
    /// The effects they tell apart, as written.
    pub between: Vec<String>,
    /// How far apart the predictions of two effects lie over all poses, in standard errors: the least of the pairs that are told
    /// apart, the greatest of all pairs where none is.
    pub separation: f64,
    /// What would separate them if these poses do not.
    pub instead: Option<String>,
    /// One plain sentence.
    pub sentence: String,
}

/// Candidates looked at for each pose.
const LOOKED_AT: usize = 240;

/// Share of a joint's range that chosen poses keep clear of either limit.
const CLEAR_OF_LIMITS: f64 = 0.02;

/// Rounds of small changes to the best.
const REFINED: usize = 3;

/// Effects compared at most.
const RIVALS: usize = 6;

/// Standard errors of separation beyond which more of it is worth less than some for another pair.
const PLENTY: f64 = 5.0;

/// Standard errors of separation below which effects are the same thing.
const SAME: f64 = 0.5;

/// Standard errors of separation below which poses settle nothing.
pub(super) const SETTLES: f64 = 3.0;

/// One effect in question, fitted.
pub(super) struct Rival {
    pub(super) label: String,
    pub(super) effects: Vec<AddedEffect>,
    pub(super) state: State,
    pub(super) covariance: DMatrix<f64>,
}

/// A pose with its circumstances.
#[derive(Clone)]
pub(super) struct Design {
    q: Vec<f64>,
    approach: Vec<i8>,
    payload: f64,
    wait: f64,
}

/// What is read at a pose besides what the table reads.
#[derive(Clone, Copy, PartialEq)]
enum Sensing {
    AsBefore,
    WholePoints,
    SecondPoint,
}

/// Predictions and derivatives of all rivals at some poses.
struct Forecast {
    /// Per rival and design: readings, derivatives (readings by slots), both in units of sigma.
    rivals: Vec<Vec<(DVector<f64>, DMatrix<f64>)>>,
    reach_allowed: Vec<bool>,
}

impl Laboratory {
    /// Chooses poses that tell apart what the data cannot.
    ///
    /// # Errors
    /// Nothing can be fitted, no pose is allowed, or cancellation.
    pub fn next_poses(&self, wanted: &Wanted, progress: &Progress) -> Result<NextPoses, LaboratoryError> {
        let thin = self.thinned(super::MOST_ROWS);
        let lab = thin.as_ref().unwrap_or(self);
        let machine = lab.machine(&[])?;
        let fit = lab.fit(&machine, progress)?;
        let returns = Returns::gather(&machine, &fit, &lab.survey());
        let floor = Floor::among(&machine, returns.as_ref());
        let candidates = search::Candidates { listed: search::probes(lab), unlisted: unlisted::probes(lab) };
        let finding = lab.find(&floor, &candidates, progress)?;
        if finding.verdict == Verdict::AtFloor
            && let Some(poses) = lab.poses_for_not_shown(&finding.stage, &floor, wanted, progress)?
        {
            return Ok(poses);
        }
        let (rivals, noise) = lab.rivals_of(&finding, &floor, progress)?;
        progress.report(0.7, "choosing poses")?;
        let mut chooser = Chooser::new(lab, rivals, noise)?;
        let choice = chooser.choose(wanted, progress)?;
        let designs = &choice.designs;
        if designs.is_empty() {
            return Err(no_pose());
        }
        let labels: Vec<String> = chooser.rivals.iter().map(|rival| rival.label.clone()).collect();
        let (separation, alike) = (choice.separation(), choice.alike(&labels));
        let instead = match labels.len() > 1 && separation < SETTLES {
            true => Some(chooser.what_would(wanted, separation, progress)?),
            false => None,
        };
        let mut next = chooser.told(designs);
        let returns: Vec<NextPose> = next.iter().take(2).map(turned_round).collect();
        next.extend(returns);
        let mut sentence = sentence(finding.verdict, &labels, designs.len(), separation, instead.as_deref());
        if instead.is_none() && !alike.is_empty() {
            let pairs: Vec<String> = alike.iter().map(|(one, other)| format!("{one} from {other}")).collect();
            sentence.push_str(&format!(" They do not tell {}.", super::wording::listed(&pairs, "nor")));
        }
        Ok(NextPoses { next, between: labels, separation, instead, sentence })
    }

    /// A few poses that tell apart what a finding could not; none if it left no question.
    pub(super) fn poses_for(
        &self,
        finding: &Finding<'_>,
        floor: &Floor,
        progress: &Progress,
    ) -> Result<Vec<NextPose>, LaboratoryError> {
        if finding.verdict == Verdict::AtFloor {
            let wanted = Wanted { count: 4, keep_out: Vec::new(), payloads: Vec::new() };
            let poses = self.poses_for_not_shown(&finding.stage, floor, &wanted, progress)?;
            return Ok(
                poses.map_or_else(Vec::new, |poses| poses.next.into_iter().take(wanted.count).collect())
            );
        }
        if finding.close.len() < 2 || !matches!(finding.verdict, Verdict::Tied | Verdict::Located) {
            return Ok(Vec::new());
        }
        let (rivals, noise) = self.rivals_of(finding, floor, progress)?;
        let mut chooser = Chooser::new(self, rivals, noise)?;
        let wanted = Wanted { count: 4, keep_out: Vec::new(), payloads: Vec::new() };
        let designs = chooser.choose(&wanted, progress)?.designs;
        Ok(chooser.told(&designs))
    }

    /// The effects in question, each fitted with all else that was found, and the noise of an equation in sigmas.
    fn rivals_of(
        &self,
        finding: &Finding<'_>,
        floor: &Floor,
        progress: &Progress,
    ) -> Result<(Vec<Rival>, f64), LaboratoryError> {
        let noise = floor.scale.unwrap_or(finding.stage.fitted.fit.scale).max(1e-9);
        let mut chosen: Vec<usize> = finding.close.clone();
        // A name is best tested against what came next.
        for (index, contender) in finding.stage.contenders.iter().enumerate() {
            if chosen.len() < 2 && !chosen.contains(&index) && contender.refitted && contender.score.plausible
            {
                chosen.push(index);
            }
        }
        chosen.extend(kin(&finding.stage.contenders, &chosen));
        let mut rivals = Vec::new();
        for index in chosen.into_iter().take(RIVALS) {
            let Some(contender) = finding.stage.contenders.get(index) else { continue };
            let mut effects = finding.stage.taken.clone();
            effects.push(AddedEffect { id: contender.id.clone(), values: contender.values.clone() });
            let fitted = self.fit_with(&effects, Some(&finding.stage.fitted), progress)?;
            rivals.push(Rival::of(contender.id.label(self.model()), effects, &fitted));
        }
        if rivals.is_empty() {
            rivals.push(Rival::of(
                "the model as it is".to_owned(),
                finding.stage.taken.clone(),
                &finding.stage.fitted,
            ));
        }
        Ok((rivals, noise))
    }
}

/// Why no pose was chosen.
pub(super) fn no_pose() -> LaboratoryError {
    LaboratoryError::Refused(
        "no pose within the limits stays clear of what must be kept out; check `limits` and the keep-out planes".to_owned(),
    )
}

/// Waves of the orders next to those in question, at the same joints: where the range of a joint was seen in part only, they
/// come forward once more of it is seen.
fn kin(contenders: &[Contender], chosen: &[usize]) -> Vec<usize> {
    let next_to = |one: &Contender, other: &Contender| {
        let orders = one.id.order.zip(other.id.order);
        one.id.joint() == other.id.joint() && orders.is_some_and(|(one, other)| (one - other).abs() == 1.0)
    };
    let asked = |contender: &Contender| {
        chosen.iter().filter_map(|index| contenders.get(*index)).any(|other| next_to(contender, other))
    };
    let all = contenders.iter().enumerate();
    all.filter(|(index, contender)| !chosen.contains(index) && asked(contender))
        .map(|(index, _)| index)
        .collect()
}

impl Rival {
    pub(super) fn of(label: String, effects: Vec<AddedEffect>, fitted: &Fitted<'_>) -> Self {
        Self { label, effects, state: fitted.fit.state.clone(), covariance: fitted.fit.covariance.clone() }
    }
}

/// The best pose so far.
struct Best {
    worth: f64,
    design: Design,
    /// Its derivatives, for each rival.
    rows: Vec<DMatrix<f64>>,
    /// By how much it puts each pair apart, squared standard errors.
    pairs: Vec<f64>,
}

/// Poses, and how far they put each pair of rivals apart: second before first, `(1, 0)`, `(2, 0)`, `(2, 1)` and so on.
pub(super) struct Choice {
    pub(super) designs: Vec<Design>,
    /// Standard errors.
    pub(super) apart: Vec<f64>,
}

impl Choice {
    /// Least separation of the pairs that are told apart; of none is, the greatest.
    fn separation(&self) -> f64 {
        let told = self.apart.iter().copied().filter(|apart| *apart >= SETTLES);
        let least = told.fold(f64::INFINITY, f64::min);
        if least.is_finite() { least } else { self.apart.iter().copied().fold(0.0, f64::max) }
    }

    /// Least separation of all pairs.
    fn least(&self) -> f64 {
        let asked = self.apart.iter().copied().filter(|apart| apart.is_finite());
        asked.reduce(f64::min).unwrap_or(0.0)
    }

    /// Pairs that stay alike.
    fn alike<'l>(&self, labels: &'l [String]) -> Vec<(&'l str, &'l str)> {
        let pairs = labels.iter().enumerate();
        let pairs = pairs.flat_map(|(first, one)| labels.iter().take(first).map(move |other| (other, one)));
        let alike = pairs.zip(&self.apart).filter(|(_, apart)| **apart < SETTLES);
        alike.map(|((one, other), _)| (one.as_str(), other.as_str())).collect()
    }
}

pub(super) struct Chooser<'a> {
    lab: &'a Laboratory,
    rivals: Vec<Rival>,
    noise: f64,
    sensing: Sensing,
    /// Where the arm's own sensor triggered, if it is all that measures.
    ground: Option<Ground>,
    /// Whether each rival is to be told from the first alone: the others are what the rows do not show, and need no telling apart.
    from_first: bool,
}

impl<'a> Chooser<'a> {
    pub(super) fn new(lab: &'a Laboratory, rivals: Vec<Rival>, noise: f64) -> Result<Self, LaboratoryError> {
        let mut effects = lab.fitted_effects()?;
        let ground = rivals.first().and_then(|rival| {
            effects.extend(rival.effects.iter().cloned());
            Ground::of(lab, &rival.state, &effects)
        });
        Ok(Self { lab, rivals, noise, sensing: Sensing::AsBefore, ground, from_first: false })
    }
}

impl Chooser<'_> {
    /// Asks for poses that tell each rival from the first; from one another they need not.
    pub(super) fn tell_from_first(&mut self) {
        self.from_first = true;
    }

    /// Brings poses onto the surface the sensor is to trigger over; those that cannot be are left out.
    fn landed(&self, designs: Vec<Design>) -> Result<Vec<Design>, LaboratoryError> {
        let (Some(ground), Some(rival)) = (&self.ground, self.rivals.first()) else { return Ok(designs) };
        let mut effects = self.lab.fitted_effects()?;
        effects.extend(rival.effects.iter().cloned());
        let mut table = self.table(&designs);
        let ranges: Vec<(f64, f64)> = (0..table.joints).map(|joint| self.range(joint)).collect();
        let stands = landing::land(self.lab, ground, (&rival.state, &effects), &mut table, &ranges)?;
        let rows = designs.into_iter().enumerate().zip(stands).filter(|(_, stands)| *stands);
        Ok(rows.map(|((row, design), _)| Design { q: table.q_of(row).to_vec(), ..design }).collect())
    }

    /// Poses one after the other, each where the rivals differ most given those before: pairs that are apart already count little.
    pub(super) fn choose(&mut self, wanted: &Wanted, progress: &Progress) -> Result<Choice, LaboratoryError> {
        let mut dice = Random::seeded(11);
        let mut covariances: Vec<DMatrix<f64>> =
            self.rivals.iter().map(|rival| rival.covariance.clone()).collect();
        let mut chosen: Vec<Design> = Vec::new();
        let count = self.rivals.len();
        let mut apart = vec![0.0; count * count.saturating_sub(1) / 2];
        for place in 0..wanted.count {
            progress.report(0.7 + 0.3 * place as f64 / wanted.count as f64, "choosing poses")?;
            let mut designs =
                self.landed((0..LOOKED_AT).map(|_| self.anywhere(wanted, &mut dice)).collect())?;
            let mut best: Option<Best> = None;
            for round in 0..=REFINED {
                let forecast = self.forecast(&designs, wanted)?;
                for (index, design) in
                    designs.iter().enumerate().filter(|(index, _)| forecast.reach_allowed[*index])
                {
                    let (worth, pairs) = self.worth(&forecast, index, &covariances, &apart);
                    if best.as_ref().is_none_or(|best| worth > best.worth) {
                        let rows = forecast.rivals.iter().map(|all| all[index].1.clone()).collect();
                        best = Some(Best { worth, design: design.clone(), rows, pairs });
                    }
                }
                let Some(Best { design: centre, .. }) = &best else { break };
                let width = 0.15 / f64::from(1 << round);
                designs =
                    self.landed((0..LOOKED_AT / 4).map(|_| self.near(centre, width, &mut dice)).collect())?;
            }
            let Some(Best { design, rows, pairs, .. }) = best else { break };
            apart.iter_mut().zip(pairs).for_each(|(apart, more)| *apart += more);
            for (covariance, row) in covariances.iter_mut().zip(rows) {
                learn(covariance, &row, self.noise);
            }
            chosen.push(design);
        }
        Ok(Choice {
            designs: chosen,
            // Pairs that nobody asks about stay no number.
            apart: apart
                .into_iter()
                .map(|squared: f64| if squared.is_nan() { squared } else { squared.max(0.0).sqrt() })
                .collect(),
        })
    }

    /// What a pose is worth beside those before, and by how much it puts each pair of rivals apart (squared standard errors); for
    /// a single model, how little is known there.
    fn worth(
        &self,
        forecast: &Forecast,
        index: usize,
        covariances: &[DMatrix<f64>],
        apart: &[f64],
    ) -> (f64, Vec<f64>) {
        let spread = |rival: usize| {
            let jacobian = &forecast.rivals[rival][index].1;
            jacobian * &covariances[rival] * jacobian.transpose()
        };
        let count = forecast.rivals.len();
        let spreads: Vec<DMatrix<f64>> = (0..count).map(spread).collect();
        if count == 1 {
            return (spreads[0].trace(), Vec::new());
        }
        let mut pairs = Vec::with_capacity(apart.len());
        for first in 0..count {
            for second in 0..first {
                if self.from_first && second > 0 {
                    pairs.push(f64::NAN);
                    continue;
                }
                let difference = &forecast.rivals[first][index].0 - &forecast.rivals[second][index].0;
                let noise =
                    DMatrix::identity(difference.len(), difference.len()) * (2.0 * self.noise * self.noise);
                let variance = &spreads[first] + &spreads[second] + noise;
                let factor = variance.cholesky();
                pairs.push(factor.map_or(0.0, |factor| difference.dot(&factor.solve(&difference))));
            }
        }
        let told = |squared: f64| squared / (squared + PLENTY * PLENTY);
        let asked = apart.iter().zip(&pairs).filter(|(_, more)| more.is_finite());
        let worth = asked.map(|(apart, more)| told(apart + more) - told(*apart)).sum();
        (worth, pairs)
    }

    /// Least and greatest coordinates poses are chosen from: the limits, and where none are known, what was measured and
    /// a little around.
    fn range(&self, joint: usize) -> (f64, f64) {
        let row = self.lab.model().chain.joints.get(joint);
        let measured = self.lab.passport().ranges.get(joint).copied().unwrap_or((-1.0, 1.0));
        let (low, high) = row.map_or(measured, |row| row.limits);
        if high - low < 1.9 * std::f64::consts::TAU && (high - low).is_finite() && high - low < 1e5 {
            // An arm that is told to stand on its limit may refuse: its zeros are what is being looked for.
            let clear = CLEAR_OF_LIMITS * (high - low);
            return (low + clear, high - clear);
        }
        let margin = 0.15 * (measured.1 - measured.0);
        ((measured.0 - margin).max(low), (measured.1 + margin).min(high))
    }

    fn anywhere(&self, wanted: &Wanted, dice: &mut Random) -> Design {
        let joints = self.lab.model().chain.len();
        let q = (0..joints)
            .map(|joint| {
                let (low, high) = self.range(joint);
                low + (high - low) * dice.uniform()
            })
            .collect();
        let mut sides = |joint: usize| {
            let asked = self.from_first && self.lab.table().approach.is_some();
            if asked || self.lab.passport().has_both_sides(joint) { [-1, 1][dice.below(2)] } else { 0 }
        };
        let approach = (0..joints).map(&mut sides).collect();
        let payload = match wanted.payloads.as_slice() {
            [] => self.logged_payload(dice),
            given => given[dice.below(given.len())],
        };
        let wait = match self.waits() {
            true => [0.0, 600.0, 3600.0][dice.below(3)],
            false => 0.0,
        };
        Design { q, approach, payload, wait }
    }

    fn near(&self, centre: &Design, width: f64, dice: &mut Random) -> Design {
        let mut design = centre.clone();
        for (joint, q) in design.q.iter_mut().enumerate() {
            let (low, high) = self.range(joint);
            *q = (*q + (high - low) * width * dice.normal()).clamp(low, high);
        }
        design
    }

    fn logged_payload(&self, dice: &mut Random) -> f64 {
        let loads: Vec<f64> =
            self.lab.table().payload.iter().flatten().copied().filter(|load| load.is_finite()).collect();
        if loads.is_empty() { 0.0 } else { loads[dice.below(loads.len())] }
    }

    /// Whether one of the rivals depends on time.
    fn waits(&self) -> bool {
        let timed = ["warm_up", "drift", "thermal_growth"];
        self.lab.table().time.is_some()
            && self
                .rivals
                .iter()
                .flat_map(|rival| &rival.effects)
                .any(|effect| timed.contains(&effect.id.name.as_str()))
    }

    /// A table of poses to come, with the same kinds of readings.
    fn table(&self, designs: &[Design]) -> Table {
        let known = self.lab.table();
        let joints = known.joints;
        let last = known.time.iter().flatten().copied().filter(|time| time.is_finite()).fold(0.0, f64::max);
        let mut table = Table { source: known.source.clone(), joints, ..Table::default() };
        table.touch.names.clone_from(&known.touch.names);
        table.positions = known.positions.iter().map(|columns| columns.empty()).collect();
        let first = self.lab.model().targets.first().map(|target| target.name.clone());
        let other_sensing = self.sensing != Sensing::AsBefore || !known.touch.names.is_empty();
        if table.positions.is_empty()
            && other_sensing
            && let Some(name) = first
        {
            table.positions.push(crate::table::PositionColumns { number: 0, target: name, xyz: Vec::new() });
        }
        let ground = self.ground.as_ref().filter(|_| self.sensing == Sensing::AsBefore);
        let surface = ground.map(|ground| ground.name.clone()).or_else(|| known.on.names.first().cloned());
        let point = known.distance_to.names.first().cloned();
        table.height = surface.as_ref().filter(|_| ground.is_none()).map(|_| Vec::new());
        table.distance = point.as_ref().map(|_| Vec::new());
        // A level with a name is a spirit level: its bubble is at its end in most poses, so tilts are counted on only where nothing else is read.
        let level = known.level.names.first();
        let reads_else = !table.positions.is_empty() || table.height.is_some() || table.distance.is_some();
        table.tilt = known.tilt.as_ref().filter(|_| level.is_none() || !reads_else).map(|_| Vec::new());
        table.time = known.time.as_ref().map(|_| Vec::new());
        table.temperature = known.temperature.as_ref().map(|_| Vec::new());
        table.payload = Some(Vec::new());
        table.approach = known.approach.as_ref().map(|_| Vec::new());
        let temperature = known.temperature.iter().flatten().copied().rfind(|value| value.is_finite());
        for (index, design) in designs.iter().enumerate() {
            table.q.extend(&design.q);
            table.lines.push(index as u32 + 1);
            table.positions.iter_mut().for_each(|columns| columns.xyz.push([0.0; 3]));
            table.height.iter_mut().for_each(|column| column.push(0.0));
            table.distance.iter_mut().for_each(|column| column.push(0.0));
            table.tilt.iter_mut().for_each(|column| column.push([0.0; 2]));
            table.time.iter_mut().for_each(|column| column.push(last + design.wait));
            table.temperature.iter_mut().for_each(|column| column.push(temperature.unwrap_or(f64::NAN)));
            table.payload.iter_mut().for_each(|column| column.push(design.payload));
            table.approach.iter_mut().for_each(|column| column.extend(&design.approach));
            table.note(surface.as_deref(), point.as_deref());
        }
        if let (Some(level), true) = (level, table.tilt.is_some()) {
            table.level = Names { names: vec![level.clone()], of_row: vec![Some(0); designs.len()] };
        }
        table
    }

    fn forecast(&self, designs: &[Design], wanted: &Wanted) -> Result<Forecast, LaboratoryError> {
        let mut model = self.lab.model().clone();
        if self.sensing == Sensing::SecondPoint {
            // A second point off the flange's axis: what a single point cannot see, two do.
            let side = 0.2 * model.chain.reach().max(100.0);
            if let Some(target) = model.targets.first_mut() {
                target.xyz.x += side;
                target.xyz.y += side;
            }
        }
        let table = self.table(designs);
        let observations = Observations::new(&model, &table)?;
        let ones = vec![1.0; designs.len()];
        let start = self.lab.fitted_effects()?;
        let mut rivals = Vec::new();
        let mut reach_allowed = vec![true; designs.len()];
        for rival in &self.rivals {
            let mut effects = start.clone();
            effects.extend(rival.effects.iter().cloned());
            let machine = Machine::new(&model, &table, &observations, &effects)?;
            let mut state = rival.state.clone();
            if self.sensing == Sensing::SecondPoint
                && let (Some(moved), Some(target)) = (state.targets.first_mut(), model.targets.first())
            {
                *moved +=
                    target.xyz - self.lab.model().targets.first().map_or(target.xyz, |target| target.xyz);
            }
            let mut all = Vec::new();
            for (row, allowed) in reach_allowed.iter_mut().enumerate() {
                let block = machine.block(&state, &[row], &ones, &[]);
                all.push((-DVector::from_vec(block.residuals), block.jacobian.transpose()));
                *allowed &= machine.stays_clear(&state, row, &wanted.keep_out);
            }
            rivals.push(all);
        }
        Ok(Forecast { rivals, reach_allowed })
    }

    /// What would separate the rivals if poses alone do not.
    fn what_would(
        &mut self,
        wanted: &Wanted,
        now: f64,
        progress: &Progress,
    ) -> Result<String, LaboratoryError> {
        let lab = self.lab;
        let has_points = !lab.table().positions.is_empty();
        let heaviest =
            lab.table().payload.iter().flatten().copied().filter(|load| load.is_finite()).fold(0.0, f64::max);
        let mut ways: Vec<(String, Sensing, Vec<f64>)> = Vec::new();
        ways.push((
            format!("a load of {:.0} kg", heaviest + 2.0),
            Sensing::AsBefore,
            vec![0.0, heaviest + 2.0],
        ));
        if !has_points {
            ways.push((
                "an instrument that measures whole positions of p1".to_owned(),
                Sensing::WholePoints,
                Vec::new(),
            ));
        }
        ways.push((
            "a second point on the hand, well off its axis,".to_owned(),
            Sensing::SecondPoint,
            Vec::new(),
        ));
        let mut best: Option<(f64, String)> = None;
        for (name, sensing, payloads) in ways {
            self.sensing = sensing;
            let few = Wanted { count: wanted.count.min(4), payloads, ..wanted.clone() };
            let separation = self.choose(&few, progress)?.least();
            if best.as_ref().is_none_or(|(most, _)| separation > *most) {
                best = Some((separation, name));
            }
        }
        self.sensing = Sensing::AsBefore;
        Ok(match best {
            Some((separation, name)) if separation > SETTLES.max(2.0 * now) => {
                format!("{name} would tell them apart ({separation:.0} standard errors in {} poses)", wanted.count.min(4))
            }
            _ if now < SAME => "neither a load nor a second point nor whole positions would: for this arm they are the same thing, so either will do"
                .to_owned(),
            _ => "neither a load nor a second point nor whole positions would: they differ by less than these readings show, so either will do"
                .to_owned(),
        })
    }

    /// The poses as they are told to people.
    pub(super) fn told(&self, designs: &[Design]) -> Vec<NextPose> {
        let unit = typical_sigma_of(self.lab);
        let forecast =
            self.forecast(designs, &Wanted { count: 0, keep_out: Vec::new(), payloads: Vec::new() });
        let shown = |joint: usize, q: f64| {
            let slides = crate::effect::slides(self.lab.model(), joint);
            let value = if slides { q } else { q.to_degrees() };
            (value * 1000.0).round() / 1000.0
        };
        designs
            .iter()
            .enumerate()
            .map(|(index, design)| {
                let mut predicted = Map::new();
                if let Ok(forecast) = &forecast {
                    for (rival, all) in self.rivals.iter().zip(&forecast.rivals) {
                        let values: Vec<Value> = all[index]
                            .0
                            .iter()
                            .map(|value| json!((value * unit * 1e4).round() / 1e4))
                            .collect();
                        predicted.insert(rival.label.clone(), Value::Array(values));
                    }
                }
                if design.wait > 0.0 {
                    predicted.insert("after_waiting_s".to_owned(), json!(design.wait));
                }
                NextPose {
                    q_deg: design.q.iter().enumerate().map(|(joint, q)| shown(joint, *q)).collect(),
                    approach: design.approach.clone(),
                    payload_kg: design.payload,
                    on: self.ground.as_ref().map(|ground| ground.name.clone()),
                    predicted,
                }
            })
            .collect()
    }
}

fn typical_sigma_of(lab: &Laboratory) -> f64 {
    lab.machine(&[]).map_or(1.0, |machine| typical_sigma(&machine))
}

/// The same pose, arrived at from the other side.
pub(super) fn turned_round(pose: &NextPose) -> NextPose {
    NextPose { approach: pose.approach.iter().map(|side| -side).collect(), ..pose.clone() }
}

/// What is known once readings with these derivatives have been taken.
fn learn(covariance: &mut DMatrix<f64>, jacobian: &DMatrix<f64>, noise: f64) {
    let across = &*covariance * jacobian.transpose();
    let variance =
        jacobian * &across + DMatrix::identity(jacobian.nrows(), jacobian.nrows()) * (noise * noise);
    if let Some(factor) = variance.cholesky() {
        *covariance -= &across * factor.solve(&across.transpose());
    }
}

fn sentence(
    verdict: Verdict,
    labels: &[String],
    count: usize,
    separation: f64,
    instead: Option<&str>,
) -> String {
    let listed = super::wording::listed(labels, "and");
    match (labels.len(), instead) {
        (1, _) => {
            format!("Measure these {count} poses, and return to the first two: there the model knows least.")
        }
        (_, Some(instead)) => {
            format!(
                "No pose within reach tells {listed} apart ({separation:.1} standard errors in {count} poses); {instead}."
            )
        }
        (rivals, None) => {
            let least = if rivals > 2 { "at least " } else { "" };
            let proof = if verdict == Verdict::Named { ", which proves the name or corrects it" } else { "" };
            format!(
                "Measure these {count} poses, and return to the first two: they put {listed} {least}{separation:.0} standard errors apart{proof}."
            )
        }
    }
}
