//! What `--effect` says: `NAME`, `NAME(PLACE)`, `NAME(PLACE, DETAIL)`, with `=3x` for three times the noise or `=0.05deg` for a size.

use std::f64::consts::PI;
use std::str::FromStr;

use plumb_simulated::physics::campaign::catalogue::Choice;
use plumb_simulated::physics::campaign::specification::{Requested, Size};
use thiserror::Error;

/// Times the noise when a request gives no size.
const USUAL_RATIO: f64 = 3.0;

/// Why a request cannot be read.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum EffectRequestError {
    /// Not of the form at all.
    #[error("--effect {0}: write NAME, NAME(PLACE) or NAME(PLACE, DETAIL), and =3x or =0.05deg for the size")]
    Form(String),
    /// A size that is none.
    #[error(
        "--effect {request}: `{size}` is not a size; write 3x for three times the noise, or a number with deg, mrad, rad, um, mm, deg/m or urad/m, or alone"
    )]
    Size {
        /// The whole request.
        request: String,
        /// Its size.
        size: String,
    },
}

/// One `--effect`.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectRequest(pub Option<Requested>);

impl FromStr for EffectRequest {
    type Err = EffectRequestError;

    fn from_str(text: &str) -> Result<Self, EffectRequestError> {
        if text.trim() == "none" {
            return Ok(Self(None));
        }
        let (what, size) = match text.split_once('=') {
            Some((what, size)) => (what.trim(), read_size(text, size.trim())?),
            None => (text.trim(), Size::OverNoise(USUAL_RATIO)),
        };
        let bad = || EffectRequestError::Form(text.to_owned());
        let (name, inside) = match what.split_once('(') {
            Some((name, rest)) => (name.trim(), Some(rest.strip_suffix(')').ok_or_else(bad)?)),
            None => (what, None),
        };
        let named =
            !name.is_empty() && name.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_');
        let mut parts = inside
            .unwrap_or_default()
            .split(',')
            .map(str::trim)
            .filter(|part| !part.is_empty())
            .map(str::to_owned);
        let (site, detail) = (parts.next().filter(|site| site != "*"), parts.next());
        if !named || parts.next().is_some() {
            return Err(bad());
        }
        Ok(Self(Some(Requested { choice: Choice { name: name.to_owned(), site, detail }, size })))
    }
}

fn read_size(request: &str, size: &str) -> Result<Size, EffectRequestError> {
    let bad = || EffectRequestError::Size { request: request.to_owned(), size: size.to_owned() };
    let units = ["deg/m", "urad/m", "mrad", "rad", "deg", "um", "mm", "x", ""];
    let (digits, unit) =
        units.iter().find_map(|unit| Some((size.strip_suffix(unit)?, *unit))).ok_or_else(bad)?;
    let number: f64 = digits.trim().parse().map_err(|_| bad())?;
    if !number.is_finite() || (unit == "x" && number <= 0.0) {
        return Err(bad());
    }
    Ok(match unit {
        "x" => Size::OverNoise(number),
        "deg" => Size::Exact(number * PI / 180.0),
        "deg/m" => Size::Exact(number * PI / 180e3),
        "urad/m" => Size::Exact(number * 1e-9),
        "mrad" | "um" => Size::Exact(number * 1e-3),
        _ => Size::Exact(number),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> (String, Option<String>, Option<String>, Size) {
        let Requested { choice, size } = text.parse::<EffectRequest>().unwrap().0.unwrap();
        (choice.name, choice.site, choice.detail, size)
    }

    #[test]
    fn a_request_names_effect_site_detail_and_size() {
        assert_eq!(read("joint_backlash"), ("joint_backlash".into(), None, None, Size::OverNoise(3.0)));
        assert_eq!(
            read("joint_harmonic(waist, 20) = 1.5x"),
            ("joint_harmonic".into(), Some("waist".into()), Some("20".into()), Size::OverNoise(1.5))
        );
        assert_eq!(
            read("warm_up(*, length)=0.2mm"),
            ("warm_up".into(), None, Some("length".into()), Size::Exact(0.2))
        );
        assert_eq!(read("joint_compliance(elbow)=1.5e-5").3, Size::Exact(1.5e-5));
        assert_eq!(read("joint_backlash(elbow)=180deg").3, Size::Exact(PI));
        assert_eq!(read("axis_yaw(x)=180deg/m").3, Size::Exact(PI / 1000.0));
        assert_eq!(read("axis_yaw(x)=350urad/m").3, Size::Exact(350.0 * 1e-9));
        assert_eq!("none".parse::<EffectRequest>().unwrap(), EffectRequest(None));
    }

    #[test]
    fn bad_requests_say_what_would_be_right() {
        let message = |text: &str| text.parse::<EffectRequest>().unwrap_err().to_string();
        assert!(
            message("joint_backlash(elbow")
                .starts_with("--effect joint_backlash(elbow: write NAME, NAME(PLACE)")
        );
        assert!(message("joint_backlash=0.1 furlong").contains("`0.1 furlong` is not a size"));
        assert!(message("joint_backlash=-3x").contains("`-3x` is not a size"));
        assert!(message("a(b, c, d)").contains("write NAME"));
    }
}
