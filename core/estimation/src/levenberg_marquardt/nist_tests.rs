//! Nonlinear regression problems of the NIST Statistical Reference Datasets (StRD, https://www.itl.nist.gov/div898/strd/nls,
//! public domain), with their certified values. Misra1a and Rat42 are of lower, MGH09 and Thurber of higher difficulty.

use super::*;

/// A response and its predictor.
type Data = [(f64, f64)];

/// The model's value and its derivatives by the parameters, at a predictor.
type Curve = fn(&[f64], f64) -> (f64, Vec<f64>);

/// A curve through data.
struct Regression<'d> {
    data: &'d Data,
    curve: Curve,
}

impl Problem for Regression<'_> {
    type State = DVector<f64>;

    fn normal_equations(&self, state: &DVector<f64>) -> NormalEquations {
        let mut normal = NormalEquations::zeros(state.len());
        for (response, predictor) in self.data {
            let (value, slopes) = (self.curve)(state.as_slice(), *predictor);
            normal.take(&[response - value], &DMatrix::from_column_slice(state.len(), 1, &slopes));
        }
        normal
    }

    fn stepped(&self, state: &DVector<f64>, change: &DVector<f64>) -> DVector<f64> {
        state + change
    }

    fn is_finite(&self, state: &DVector<f64>) -> bool {
        state.iter().all(|value| value.is_finite())
    }
}

/// NIST's certified answer: parameters and the residual sum of squares.
struct Certified<'c> {
    parameters: &'c [f64],
    squares: f64,
}

/// A descent ends where a step promises less than a thousandth of a residual's own variance: the sum of squares agrees to that, and
/// parameters to a small fraction of their own standard errors.
fn agrees(data: &Data, curve: Curve, start: &[f64], certified: &Certified<'_>) {
    let problem = Regression { data, curve };
    let settings = Settings { steps: 500, damping: CAREFUL };
    let start = DVector::from_column_slice(start);
    let found = descend(&problem, &start, &[], settings, &Progress::unwatched()).unwrap();
    assert!(found.converged, "after {} steps", found.steps);
    let freedom = (data.len() - start.len()) as f64;
    let excess = found.normal.squares - certified.squares;
    assert!(excess.abs() < 1e-2 * certified.squares / freedom, "{} too much", excess / certified.squares);
    let covariance =
        RankRevealingCholesky::new(&found.normal.matrix).inverse() * (certified.squares / freedom);
    for (index, expected) in certified.parameters.iter().enumerate() {
        let error = (found.state[index] - expected).abs() / covariance[(index, index)].sqrt();
        assert!(
            error < 0.1,
            "parameter {index}: {} against {expected}, {error} standard errors",
            found.state[index]
        );
    }
}

/// Monomolecular growth: `b1 (1 - exp(-b2 x))`.
fn misra1a(b: &[f64], x: f64) -> (f64, Vec<f64>) {
    let decay = (-b[1] * x).exp();
    (b[0] * (1.0 - decay), vec![1.0 - decay, b[0] * x * decay])
}

/// Misra, D., 1978: dental research, monomolecular adsorption.
const MISRA1A: &Data = &[
    (10.07, 77.6),
    (14.73, 114.9),
    (17.94, 141.1),
    (23.93, 190.8),
    (29.61, 239.9),
    (35.18, 289.0),
    (40.02, 332.8),
    (44.82, 378.4),
    (50.76, 434.8),
    (55.05, 477.3),
    (61.01, 536.8),
    (66.4, 593.1),
    (75.47, 689.1),
    (81.78, 760.0),
];

#[test]
fn misra1a_from_both_starts() {
    let certified =
        Certified { parameters: &[238.942_129_18, 5.501_564_318_1e-4], squares: 0.124_551_388_94 };
    agrees(MISRA1A, misra1a, &[500.0, 1e-4], &certified);
    agrees(MISRA1A, misra1a, &[250.0, 5e-4], &certified);
}

/// Sigmoidal growth: `b1 / (1 + exp(b2 - b3 x))`.
fn rat42(b: &[f64], x: f64) -> (f64, Vec<f64>) {
    let growth = (b[1] - b[2] * x).exp();
    let below = 1.0 + growth;
    (b[0] / below, vec![1.0 / below, -b[0] * growth / below.powi(2), b[0] * x * growth / below.powi(2)])
}

/// Ratkowsky, D., 1983: pasture yield.
const RAT42: &Data = &[
    (8.93, 9.0),
    (10.8, 14.0),
    (18.59, 21.0),
    (22.33, 28.0),
    (39.35, 42.0),
    (56.11, 57.0),
    (61.73, 63.0),
    (64.62, 70.0),
    (67.08, 79.0),
];

#[test]
fn rat42_from_both_starts() {
    let certified = Certified {
        parameters: &[72.462_237_576, 2.618_076_840_2, 6.735_920_006_6e-2],
        squares: 8.056_522_933_8,
    };
    agrees(RAT42, rat42, &[100.0, 1.0, 0.1], &certified);
    agrees(RAT42, rat42, &[75.0, 2.5, 0.07], &certified);
}

/// A ratio of quadratics: `b1 (x^2 + b2 x) / (x^2 + b3 x + b4)`.
fn mgh09(b: &[f64], x: f64) -> (f64, Vec<f64>) {
    let (above, below) = (x * x + b[1] * x, x * x + b[2] * x + b[3]);
    let by_below = -b[0] * above / (below * below);
    (b[0] * above / below, vec![above / below, b[0] * x / below, by_below * x, by_below])
}

/// Kowalik, J. and Osborne, M., 1978: enzyme kinetics.
const MGH09: &Data = &[
    (0.1957, 4.0),
    (0.1947, 2.0),
    (0.1735, 1.0),
    (0.16, 0.5),
    (0.0844, 0.25),
    (0.0627, 0.167),
    (0.0456, 0.125),
    (0.0342, 0.1),
    (0.0323, 0.0833),
    (0.0235, 0.0714),
    (0.0246, 0.0625),
];

#[test]
fn mgh09_from_the_near_start() {
    let certified = Certified {
        parameters: &[0.192_806_934_58, 0.191_282_328_73, 0.123_056_506_93, 0.136_062_330_68],
        squares: 3.075_056_038_5e-4,
    };
    agrees(MGH09, mgh09, &[0.25, 0.39, 0.415, 0.39], &certified);
}

/// A ratio of cubics: `(b1 + b2 x + b3 x^2 + b4 x^3) / (1 + b5 x + b6 x^2 + b7 x^3)`.
fn thurber(b: &[f64], x: f64) -> (f64, Vec<f64>) {
    let above = b[0] + x * (b[1] + x * (b[2] + x * b[3]));
    let below = 1.0 + x * (b[4] + x * (b[5] + x * b[6]));
    let powers = [1.0, x, x * x, x.powi(3)];
    let up = powers.iter().map(|power| power / below);
    let down = powers.iter().skip(1).map(|power| -above * power / (below * below));
    (above / below, up.chain(down).collect())
}

/// Thurber, R., 1979: electron mobility of a semiconductor.
const THURBER: &Data = &[
    (80.574, -3.067),
    (84.248, -2.981),
    (87.264, -2.921),
    (87.195, -2.912),
    (89.076, -2.84),
    (89.608, -2.797),
    (89.868, -2.702),
    (90.101, -2.699),
    (92.405, -2.633),
    (95.854, -2.481),
    (100.696, -2.363),
    (101.06, -2.322),
    (401.672, -1.501),
    (390.724, -1.46),
    (567.534, -1.274),
    (635.316, -1.212),
    (733.054, -1.1),
    (759.087, -1.046),
    (894.206, -0.915),
    (990.785, -0.714),
    (1090.109, -0.566),
    (1080.914, -0.545),
    (1122.643, -0.4),
    (1178.351, -0.309),
    (1260.531, -0.109),
    (1273.514, -0.103),
    (1288.339, 0.01),
    (1327.543, 0.119),
    (1353.863, 0.377),
    (1414.509, 0.79),
    (1425.208, 0.963),
    (1421.384, 1.006),
    (1442.962, 1.115),
    (1464.35, 1.572),
    (1468.705, 1.841),
    (1447.894, 2.047),
    (1457.628, 2.2),
];

#[test]
fn thurber_from_the_near_start() {
    let certified = Certified {
        parameters: &[
            1_288.139_680_0,
            1_491.079_253_5,
            583.238_368_77,
            75.416_644_291,
            0.966_295_028_64,
            0.397_972_857_97,
            4.972_729_734_9e-2,
        ],
        squares: 5_642.708_239_7,
    };
    agrees(THURBER, thurber, &[1300.0, 1500.0, 500.0, 75.0, 1.0, 0.4, 0.05], &certified);
}
