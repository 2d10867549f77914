//! Known distances that cannot all be true.

use crate::arm_model::TouchDistance;

/// Slack for rounding, mm.
const SLACK: f64 = 1e-6;

/// What two of the distances contradict each other in, and at which entry it shows; nothing if all can be true.
pub(super) fn contradiction(distances: &[TouchDistance]) -> Option<(usize, String)> {
    let mut names: Vec<&str> =
        distances.iter().flat_map(|known| &known.between).map(String::as_str).collect();
    names.sort_unstable();
    names.dedup();
    let index = |name: &str| names.iter().position(|known| *known == name).unwrap_or(0);
    let mut shortest = vec![vec![f64::INFINITY; names.len()]; names.len()];
    for (entry, known) in distances.iter().enumerate() {
        let [first, second] = &known.between;
        let (one, other) = (index(first), index(second));
        if one == other {
            return Some((entry, format!("a distance between `{first}` and itself; name two places")));
        }
        if shortest[one][other].is_finite() && (shortest[one][other] - known.length).abs() > SLACK {
            let earlier = shortest[one][other];
            return Some((
                entry,
                format!(
                    "`{first}` and `{second}` are said to be {earlier} mm apart and {} mm apart; keep one",
                    known.length
                ),
            ));
        }
        shortest[one][other] = known.length;
        shortest[other][one] = known.length;
    }
    for middle in 0..names.len() {
        for from in 0..names.len() {
            for to in 0..names.len() {
                let around = shortest[from][middle] + shortest[middle][to];
                if around < shortest[from][to] {
                    shortest[from][to] = around;
                }
            }
        }
    }
    distances.iter().enumerate().find_map(|(entry, known)| {
        let [first, second] = &known.between;
        let around = shortest[index(first)][index(second)];
        (around < known.length - SLACK).then(|| {
            (
                entry,
                format!(
                    "`{first}` and `{second}` cannot be {} mm apart: by way of the other known distances they are at most {around} mm apart",
                    known.length
                ),
            )
        })
    })
}
