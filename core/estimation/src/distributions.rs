//! Tails and quantiles of the normal, chi squared and F distributions (continued fractions and series as in
//! Abramowitz & Stegun, chapters 6 and 26).

/// ln Gamma(x), x > 0 (Lanczos, g = 7).
fn ln_gamma(x: f64) -> f64 {
    const COEFFICIENTS: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    let x = x - 1.0;
    let t = x + 7.5;
    let tail = COEFFICIENTS.iter().enumerate().skip(1).map(|(index, c)| c / (x + index as f64));
    let series: f64 = COEFFICIENTS[0] + tail.sum::<f64>();
    0.5 * (2.0 * std::f64::consts::PI).ln() + (x + 0.5) * t.ln() - t + series.ln()
}

/// Upper regularized incomplete gamma function Q(a, x).
fn gamma_tail(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        for _ in 0..10_000 {
            n += 1.0;
            term *= x / n;
            sum += term;
            if term < sum * 1e-16 {
                break;
            }
        }
        return (1.0 - front * sum).clamp(0.0, 1.0);
    }
    let tiny = 1e-300;
    let mut b = x + 1.0 - a;
    let mut c = 1.0 / tiny;
    let mut d = 1.0 / b;
    let mut fraction = d;
    for i in 1..10_000 {
        let i = f64::from(i);
        let an = -i * (i - a);
        b += 2.0;
        d = an * d + b;
        d = if d.abs() < tiny { 1.0 / tiny } else { 1.0 / d };
        c = b + an / c;
        if c.abs() < tiny {
            c = tiny;
        }
        fraction *= d * c;
        if (d * c - 1.0).abs() < 1e-15 {
            break;
        }
    }
    (front * fraction).clamp(0.0, 1.0)
}

/// Regularized incomplete beta function I_x(a, b).
fn beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    let front = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * (1.0 - x).ln()).exp();
    if x < (a + 1.0) / (a + b + 2.0) {
        front * beta_fraction(a, b, x) / a
    } else {
        1.0 - front * beta_fraction(b, a, 1.0 - x) / b
    }
}

fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    let tiny = 1e-300;
    let guard = |value: f64| if value.abs() < tiny { tiny } else { value };
    let mut c = 1.0;
    let mut d = 1.0 / guard(1.0 - (a + b) * x / (a + 1.0));
    let mut fraction = d;
    for m in 1..10_000 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = 1.0 / guard(1.0 + even * d);
        c = guard(1.0 + even / c);
        fraction *= d * c;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / guard(1.0 + odd * d);
        c = guard(1.0 + odd / c);
        fraction *= d * c;
        if (d * c - 1.0).abs() < 1e-15 {
            break;
        }
    }
    fraction
}

/// P(chi squared with `freedom` degrees > `value`).
pub fn chi_squared_tail(value: f64, freedom: f64) -> f64 {
    if !(value.is_finite() && freedom > 0.0) {
        return if value == f64::INFINITY { 0.0 } else { 1.0 };
    }
    gamma_tail(0.5 * freedom, 0.5 * value)
}

/// The value below which chi squared with `freedom` degrees lies with `probability`: Newton's steps from Wilson and
/// Hilferty's approximation.
pub fn chi_squared_quantile(probability: f64, freedom: f64) -> f64 {
    if probability <= 0.0 || freedom <= 0.0 {
        return 0.0;
    }
    let ninth = 2.0 / (9.0 * freedom);
    let mut value = freedom * (1.0 - ninth + normal_quantile(probability) * ninth.sqrt()).powi(3);
    if value <= 0.0 || value.is_nan() {
        value = 1e-3 * freedom;
    }
    let half = 0.5 * freedom;
    for _ in 0..60 {
        let density = ((half - 1.0) * (0.5 * value).ln() - 0.5 * value - ln_gamma(half)).exp() * 0.5;
        let step = (1.0 - chi_squared_tail(value, freedom) - probability) / density.max(1e-300);
        let next = (value - step).clamp(0.2 * value, 5.0 * value);
        if (next - value).abs() <= 1e-13 * value {
            return next;
        }
        value = next;
    }
    value
}

/// P(F with `above` and `below` degrees of freedom > `value`).
pub fn f_tail(value: f64, above: f64, below: f64) -> f64 {
    if value.is_nan() || value <= 0.0 || above <= 0.0 || below <= 0.0 {
        return 1.0;
    }
    if value == f64::INFINITY {
        return 0.0;
    }
    beta(0.5 * below, 0.5 * above, below / (below + above * value))
}

/// P(standard normal > `value`).
pub fn normal_tail(value: f64) -> f64 {
    let half = 0.5 * gamma_tail(0.5, 0.5 * value * value);
    if value >= 0.0 { half } else { 1.0 - half }
}

/// The value below which a standard normal lies with `probability` (Abramowitz & Stegun 26.2.23, then Newton's steps).
pub fn normal_quantile(probability: f64) -> f64 {
    if !(probability > 0.0 && probability < 1.0) {
        return if probability >= 1.0 { f64::INFINITY } else { f64::NEG_INFINITY };
    }
    let tail = probability.min(1.0 - probability);
    let t = (-2.0 * tail.ln()).sqrt();
    let mut value = t
        - (2.515_517 + t * (0.802_853 + t * 0.010_328))
            / (1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308)));
    for _ in 0..4 {
        let density = (-0.5 * value * value).exp() / (2.0 * std::f64::consts::PI).sqrt();
        value += (normal_tail(value) - tail) / density.max(1e-300);
    }
    if probability < 0.5 { -value } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(value: f64, expected: f64) {
        assert!((value / expected - 1.0).abs() < 1e-8, "{value} against {expected}");
    }

    #[test]
    fn tails_match_published_tables() {
        // R: pchisq(3.841458820694124, 1, lower = FALSE), pchisq(100, 80, lower = FALSE), pf(4, 3, 20, lower = FALSE),
        // pf(1.5, 60, 200, lower = FALSE), pnorm(5, lower = FALSE).
        close(chi_squared_tail(3.841_458_820_694_124, 1.0), 0.05);
        close(normal_tail(5.0), 2.866_515_718_791_94e-7);
        close(f_tail(4.351_243_503_329_29, 1.0, 20.0), 0.05);
        close(f_tail(3.098_391_212_418_07, 3.0, 20.0), 0.05);
    }

    #[test]
    fn quantiles_undo_tails() {
        for (probability, freedom) in [(0.5, 3.0), (0.9, 1.0), (0.99, 40.0), (0.5, 4000.0)] {
            close(1.0 - chi_squared_tail(chi_squared_quantile(probability, freedom), freedom), probability);
        }
        close(normal_quantile(0.975), 1.959_963_984_540_054);
    }

    #[test]
    fn far_tails_do_not_vanish_early() {
        assert!(f_tail(80.0, 2.0, 300.0) > 1e-30 && f_tail(80.0, 2.0, 300.0) < 1e-25);
    }

    #[test]
    fn tails_agree_by_closed_forms() {
        for value in [0.01, 0.7, 3.0, 12.0, 60.0] {
            // Chi squared with 2 and 4 degrees; F with 2 above; F with 1 and 1 is Cauchy's distribution squared.
            close(chi_squared_tail(value, 2.0), (-0.5 * value).exp());
            close(chi_squared_tail(value, 4.0), (-0.5 * value).exp() * (1.0 + 0.5 * value));
            close(f_tail(value, 2.0, 7.0), (1.0 + 2.0 * value / 7.0).powf(-3.5));
            close(f_tail(value, 1.0, 1.0), 1.0 - 2.0 / std::f64::consts::PI * value.sqrt().atan());
        }
        close(chi_squared_quantile(0.9, 2.0), -2.0 * 0.1_f64.ln());
    }

    #[test]
    fn f_with_many_degrees_below_is_chi_squared() {
        let many = 1e7;
        for (value, above) in [(1.0, 3.0), (2.5, 10.0)] {
            assert!((f_tail(value, above, many) / chi_squared_tail(value * above, above) - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn what_is_no_number_is_no_evidence() {
        assert_eq!((f_tail(f64::NAN, 1.0, 5.0), chi_squared_tail(f64::NAN, 2.0)), (1.0, 1.0));
        assert_eq!((f_tail(f64::INFINITY, 1.0, 5.0), chi_squared_tail(f64::INFINITY, 2.0)), (0.0, 0.0));
        assert_eq!(
            (f_tail(-1.0, 1.0, 5.0), f_tail(3.0, 1.0, 0.0), chi_squared_tail(3.0, 0.0)),
            (1.0, 1.0, 1.0)
        );
        assert_eq!((normal_quantile(0.0), normal_quantile(1.0)), (f64::NEG_INFINITY, f64::INFINITY));
        assert_eq!(chi_squared_quantile(0.0, 3.0), 0.0);
    }
}
