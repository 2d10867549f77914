//! Made-up machines and measurements: plain trigonometry, no code of the laboratory.

use plumb_calibration::arm_model::Model;
use plumb_calibration::table::Table;
use plumb_diagnosis::laboratory::{Laboratory, Options};

/// Numbers that look random and never change.
pub(crate) struct Xorshift(u64);

impl Xorshift {
    pub(crate) fn seeded(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x2545_f491_4f6c_dd1d)
    }

    /// Uniform in 0 .. 1.
    pub(crate) fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform between two numbers.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Gaussian, of this sigma.
    pub(crate) fn noise(&mut self, sigma: f64) -> f64 {
        let (first, second) = (self.unit().max(1e-12), self.unit());
        sigma * (-2.0 * first.ln()).sqrt() * (std::f64::consts::TAU * second).cos()
    }
}

/// A laboratory from texts.
pub(crate) fn laboratory(model: &str, table: &str, options: Options) -> Laboratory {
    try_laboratory(model, table, options).unwrap()
}

/// What a model and a table say when brought together: the laboratory, or the error in words.
pub(crate) fn try_laboratory(model: &str, table: &str, options: Options) -> Result<Laboratory, String> {
    let model = Model::parse("model.yaml", model).map_err(|error| error.to_string())?;
    let table = Table::parse("table.csv", table).map_err(|error| error.to_string())?;
    Laboratory::new(model, table, options).map_err(|error| error.to_string())
}

/// A planar arm of two links, 200 and 150 mm, its base and its point known.
pub(crate) const TWO_LINKS: &str = "
arm: two-links
convention: distal
joints:
  - {name: shoulder, a_mm: 200, limits_deg: [-170, 170]}
  - {name: elbow, a_mm: 150, limits_deg: [-150, 150]}
base: {xyz_mm: [0, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
free: []
measured_from: world
";

/// Where the tip of the two links is, mm, for joint angles in degrees.
pub(crate) fn two_links_tip(shoulder: f64, elbow: f64) -> (f64, f64) {
    let (first, second) = (shoulder.to_radians(), (shoulder + elbow).to_radians());
    (200.0 * first.cos() + 150.0 * second.cos(), 200.0 * first.sin() + 150.0 * second.sin())
}

/// A column that turns, and two links in a vertical plane: 300 high, 200 and 150 mm long.
pub(crate) const COLUMN_ARM: &str = "
arm: column
convention: distal
joints:
  - {name: waist, d_mm: 300, alpha_deg: 90}
  - {name: shoulder, a_mm: 200}
  - {name: elbow, a_mm: 150}
";

/// Where the column arm's tip is, mm, for joint angles in degrees.
pub(crate) fn column_tip(q: [f64; 3]) -> [f64; 3] {
    let [waist, shoulder, elbow] = q.map(f64::to_radians);
    let radius = 200.0 * shoulder.cos() + 150.0 * (shoulder + elbow).cos();
    let height = 300.0 + 200.0 * shoulder.sin() + 150.0 * (shoulder + elbow).sin();
    [radius * waist.cos(), radius * waist.sin(), height]
}

/// Many poses of the column arm, degrees.
pub(crate) fn column_poses(count: usize, seed: u64) -> Vec<[f64; 3]> {
    let mut rng = Xorshift::seeded(seed);
    let mut pose = || [rng.between(-150.0, 150.0), rng.between(-20.0, 100.0), rng.between(-120.0, -10.0)];
    (0..count).map(|_| pose()).collect()
}
