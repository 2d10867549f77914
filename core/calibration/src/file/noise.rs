//! `noise:`: how much each kind of reading scatters.

use plumb_document::did_you_mean;

use super::raw::RawModel;
use super::validate::Checker;
use crate::arm_model::Noise;
use crate::table::scalar::{HEIGHT, SCALARS, Scalar};

/// The keys of readings that are more than one number a row.
const KNOWN: [&str; 7] = ["p1_mm", "p1_deg", "tilt_deg", "touch_mm", "board_mm", "board_deg", "profile_mm"];

/// The column of one number whose noise a key declares.
fn of_scalar(key: &str) -> Option<&'static Scalar> {
    SCALARS.iter().find(|scalar| scalar.key() == key).copied()
}

impl Checker<'_> {
    pub(super) fn noise(&self, raw: &RawModel) -> Noise {
        let mut noise = Noise::default();
        let is_target = |name: &str| raw.targets.0.iter().any(|(known, _)| known.value == name);
        for (key, value) in &raw.noise.0 {
            let sigma = value.value;
            if sigma <= 0.0 {
                let message = format!("a noise of {sigma} cannot be");
                self.problems.add(value.span, message, "leave it out if unknown");
            }
            if let Some(scalar) = of_scalar(&key.value) {
                noise.set(scalar, scalar.inner(sigma));
                continue;
            }
            match key.value.as_str() {
                // Lying on a surface is a height of zero over it.
                "on_mm" => noise.set(&HEIGHT, sigma),
                "tilt_deg" => noise.tilt = Some(sigma.to_radians()),
                "touch_mm" => noise.touch = Some(sigma),
                "board_mm" => noise.board = Some(sigma),
                "profile_mm" => noise.profile = Some(sigma),
                "board_deg" => noise.board_rotation = Some(sigma.to_radians()),
                name if name.strip_suffix("_deg").is_some_and(is_target) => {
                    noise.orientations.push((name.trim_end_matches("_deg").to_owned(), sigma.to_radians()));
                }
                name => match name.strip_suffix("_mm") {
                    Some(target) if is_target(target) => {
                        noise.positions.push((target.to_owned(), sigma));
                    }
                    _ => {
                        let message = format!("no noise `{name}` is known");
                        let scalars: Vec<String> = SCALARS.iter().map(|scalar| scalar.key()).collect();
                        let known = KNOWN.into_iter().chain(scalars.iter().map(String::as_str));
                        self.problems.add(key.span, message, did_you_mean(name, known));
                    }
                },
            }
        }
        noise
    }
}
