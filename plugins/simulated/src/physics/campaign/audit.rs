//! What can be seen at all: how much of an effect the model's free parameters swallow, and which other effects look like it in these poses.
//!
//! Done with this world's own mechanics, by differences: an independent judge of what a perfect analyst could determine.

use serde::{Deserialize, Serialize};

use crate::physics::imperfection::{Imperfection, Mechanism, Warming};
use crate::physics::machine::NoEquilibrium;

use super::catalogue::{LIBRARY, sites};
use super::drive_through::{rms_difference, run};
use super::nuisance::{frees_base, frees_target};
use super::specification::{Free, Specification};
use super::visit::Visit;

/// Directions of reading space, of length one and at right angles to each other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Basis(Vec<Vec<f64>>);

impl Basis {
    /// The span of these columns; what is already spanned to within a millionth adds nothing.
    pub fn of(columns: impl IntoIterator<Item = Vec<f64>>) -> Self {
        let mut basis = Self::default();
        for column in columns {
            basis.add(column);
        }
        basis
    }

    fn add(&mut self, mut column: Vec<f64>) {
        let before = norm(&column);
        // Twice, so that rounding leaves nothing behind.
        self.remove_from(&mut column);
        self.remove_from(&mut column);
        let after = norm(&column);
        if after > 1e-6 * before && after > 0.0 {
            column.iter_mut().for_each(|entry| *entry /= after);
            self.0.push(column);
        }
    }

    /// How many directions.
    pub fn rank(&self) -> usize {
        self.0.len()
    }

    /// Takes out of `vector` whatever lies in the span.
    pub fn remove_from(&self, vector: &mut [f64]) {
        for direction in &self.0 {
            let fraction = dot(direction, vector);
            vector.iter_mut().zip(direction).for_each(|(entry, along)| *entry -= fraction * along);
        }
    }

    /// Length of the part of `vector` within the span.
    pub fn length_within(&self, vector: &[f64]) -> f64 {
        self.0.iter().map(|direction| dot(direction, vector).powi(2)).sum::<f64>().sqrt()
    }
}

fn dot(left: &[f64], right: &[f64]) -> f64 {
    left.iter().zip(right).map(|(a, b)| a * b).sum()
}

fn norm(vector: &[f64]) -> f64 {
    dot(vector, vector).sqrt()
}

/// An effect of the library at one site, as the directions in which its parameters move the arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Effect.
    pub effect: &'static str,
    /// Site.
    pub site: String,
    /// One mechanism for each parameter: a sine and a cosine, say.
    pub directions: Vec<Mechanism>,
}

/// An effect that looks like another one in these poses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LookAlike {
    /// Effect.
    pub effect: String,
    /// Site.
    #[serde(rename = "where")]
    pub site: String,
    /// Correlation of what the two do to the readings, the free parameters' part taken out.
    pub correlation: f64,
}

/// A campaign seen from what the model leaves free.
pub struct Audit<'campaign> {
    specification: &'campaign Specification,
    visits: &'campaign [Visit],
    nuisances: &'campaign [Imperfection],
    plain: Vec<f64>,
    free_signatures: Vec<Vec<f64>>,
    free: Basis,
}

impl<'campaign> Audit<'campaign> {
    /// Prepares the audit of a campaign on an arm with these constant errors.
    pub fn new(
        specification: &'campaign Specification,
        visits: &'campaign [Visit],
        nuisances: &'campaign [Imperfection],
    ) -> Result<Self, NoEquilibrium> {
        let plain = run(specification, visits, nuisances)?.concat();
        let mut audit = Self {
            specification,
            visits,
            nuisances,
            plain,
            free_signatures: Vec::new(),
            free: Basis::default(),
        };
        let columns = free_directions(specification)
            .iter()
            .map(|one| audit.signature(one))
            .collect::<Result<Vec<_>, _>>()?;
        audit.free = Basis::of(columns.iter().cloned());
        audit.free_signatures = columns;
        Ok(audit)
    }

    /// How the readings move with a mechanism, mm for each unit of its size, all readings in a row.
    pub fn signature(&self, mechanism: &Mechanism) -> Result<Vec<f64>, NoEquilibrium> {
        let size = mechanism.small_size();
        let with: Vec<Imperfection> = self
            .nuisances
            .iter()
            .cloned()
            .chain([Imperfection { mechanism: mechanism.clone(), size }])
            .collect();
        let moved = run(self.specification, self.visits, &with)?.concat();
        Ok(moved.iter().zip(&self.plain).map(|(with, without)| (with - without) / size).collect())
    }

    /// The part of a signature that nothing free in the model can imitate.
    pub fn visible(&self, mut signature: Vec<f64>) -> Vec<f64> {
        self.free.remove_from(&mut signature);
        signature
    }

    /// What the arm with these constant errors would show without noise, all readings in a row, mm.
    pub fn expected(&self) -> &[f64] {
        &self.plain
    }

    /// How the readings move with each parameter that the model leaves free; some may be the same as others.
    pub fn free_signatures(&self) -> &[Vec<f64>] {
        &self.free_signatures
    }

    /// How many parameters the readings determine of those the model leaves free.
    pub fn free_rank(&self) -> usize {
        self.free.rank()
    }

    /// Length of the campaign, s.
    pub fn duration_s(&self) -> f64 {
        self.visits.last().map_or(1.0, |visit| visit.time_s.max(1.0))
    }

    /// Root mean square, over the readings, of what an imperfection does, mm.
    pub fn moved_rms(&self, imperfection: &Imperfection) -> Result<f64, NoEquilibrium> {
        let with: Vec<Imperfection> = self.nuisances.iter().chain([imperfection]).cloned().collect();
        Ok(rms_difference(&run(self.specification, self.visits, &with)?.concat(), &self.plain))
    }

    /// Root mean square, over the readings, of what a mechanism of this size does and nothing free can imitate, mm.
    pub fn visible_rms(&self, imperfection: &Imperfection) -> Result<f64, NoEquilibrium> {
        let left = self.visible(self.signature(&imperfection.mechanism)?);
        Ok(norm(&left) * imperfection.size.abs() / (left.len().max(1) as f64).sqrt())
    }

    /// Effects of the library that imitate a mechanism to more than `least` in correlation, most alike first.
    pub fn look_alikes(&self, mechanism: &Mechanism, least: f64) -> Result<Vec<LookAlike>, NoEquilibrium> {
        let truth = self.visible(self.signature(mechanism)?);
        let length = norm(&truth);
        let mut found = Vec::new();
        for candidate in candidates(self.specification, self.visits) {
            let same = candidate.effect == mechanism.name()
                && candidate.site == mechanism.site(&self.specification.arm);
            if same || length == 0.0 {
                continue;
            }
            let columns = candidate.directions.iter().map(|one| Ok(self.visible(self.signature(one)?)));
            let span = Basis::of(columns.collect::<Result<Vec<_>, NoEquilibrium>>()?);
            let correlation = span.length_within(&truth) / length;
            if correlation > least {
                found.push(LookAlike {
                    effect: candidate.effect.to_owned(),
                    site: candidate.site,
                    correlation,
                });
            }
        }
        found.sort_by(|a, b| b.correlation.total_cmp(&a.correlation));
        Ok(found)
    }
}

/// What the user's model leaves free.
fn free_directions(specification: &Specification) -> Vec<Mechanism> {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut all = Vec::new();
    if frees_base(specification) {
        all.extend(axes.map(|axis| Mechanism::BaseTilt { axis }));
        all.extend(axes.map(|direction| Mechanism::BasePosition { direction }));
    }
    if frees_target(specification) {
        all.extend(axes.map(|direction| Mechanism::ToolOffset { direction }));
    }
    for joint in 0..specification.arm.joints.len() {
        if specification.free != Free::None {
            all.push(Mechanism::JointZero { joint });
        }
        if specification.free == Free::Geometry {
            all.extend([
                Mechanism::LinkLength { joint },
                Mechanism::LinkOffset { joint },
                Mechanism::LinkTwist { joint },
                Mechanism::AxisSkew { joint },
            ]);
        }
    }
    all
}

/// The library on this arm: every effect at every site, with usual values for inner parameters.
pub fn candidates(specification: &Specification, visits: &[Visit]) -> Vec<Candidate> {
    let arm = &specification.arm;
    let duration = visits.last().map_or(1.0, |visit| visit.time_s.max(1.0));
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut all = Vec::new();
    for effect in LIBRARY {
        for joint in sites(effect, arm) {
            let mut add = |directions: Vec<Mechanism>| {
                all.push(Candidate { effect, site: arm.joint_name(joint).to_owned(), directions })
            };
            match effect {
                "joint_gain" => add(vec![Mechanism::JointGain { joint }]),
                "link_length" => add(vec![Mechanism::LinkLength { joint }]),
                "link_offset" => add(vec![Mechanism::LinkOffset { joint }]),
                "link_twist" => add(vec![Mechanism::LinkTwist { joint }]),
                "axis_skew" => add(vec![Mechanism::AxisSkew { joint }]),
                "joint_compliance" => add(vec![Mechanism::JointCompliance { joint }]),
                "joint_stiffening" => {
                    let knee = 0.12 * super::catalogue::greatest_moment(arm, joint);
                    add(vec![Mechanism::JointStiffening { joint, knee }]);
                }
                "joint_harmonic" => {
                    let ratio = arm.joints.get(joint).and_then(|row| row.gear_ratio);
                    for per_turn in (1..=8).map(f64::from).chain(ratio) {
                        add([0.0, quarter]
                            .map(|phase| Mechanism::JointHarmonic { joint, per_turn, phase })
                            .to_vec());
                    }
                }
                "joint_backlash" => add(vec![Mechanism::JointBacklash { joint }]),
                "joint_settling" => add(vec![Mechanism::JointSettling { joint, forgetting_s: 8.0 }]),
                "joint_coupling" => {
                    for driver in [joint.checked_sub(1), Some(joint + 1)]
                        .into_iter()
                        .flatten()
                        .filter(|j| *j < arm.joints.len())
                    {
                        add(vec![Mechanism::JointCoupling { joint, driver }]);
                    }
                }
                "joint_step" => {
                    for fraction in [0.3, 0.4, 0.5, 0.6, 0.7] {
                        add(vec![Mechanism::JointStep { joint, at_s: fraction * duration }]);
                    }
                }
                "link_sag" => add(vec![Mechanism::LinkSag { joint }]),
                "thermal_growth" => add(vec![Mechanism::ThermalGrowth { joint }]),
                _ => {
                    for of in [Warming::Zero, Warming::Length, Warming::Offset] {
                        for fraction in [0.15, 0.3, 0.6] {
                            add(vec![Mechanism::WarmUp { joint, of, time_constant_s: fraction * duration }]);
                        }
                    }
                }
            }
        }
    }
    all
}
