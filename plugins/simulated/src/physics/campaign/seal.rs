//! The seal on a trial's answer. It keeps a glance from giving the answer away; it is not cryptography: anyone who has the file and this program can open
//! it, as `plumb trial reveal` does.

use serde::{Deserialize, Serialize};

use crate::physics::random::Random;

use super::case::{Case, Truth};
use super::specification::Specification;

const HEADING: &str = "plumb trial, sealed answer (a seal, not a cipher: `plumb trial reveal` opens it)";
const COLUMNS: usize = 76;

/// Why a seal does not open.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The text is no sealed answer.
    #[error("this is no sealed answer: its first line must be `{HEADING}`")]
    NotSealed,
    /// The seed's line is missing or bad.
    #[error("line 2: the sealed answer must say `seed: NUMBER`, not `{0}`")]
    Seed(String),
    /// A line with something that is not a pair of hexadecimal digits.
    #[error("line {line}: `{text}` is not hexadecimal: the sealed answer was edited or cut")]
    Digits {
        /// Line of the file.
        line: usize,
        /// What is there.
        text: String,
    },
    /// What was in it is not an answer.
    #[error("the sealed answer does not open: it was edited or cut ({0})")]
    Broken(String),
}

/// What is under the seal: the truth, and how to go on measuring.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sealed {
    /// What was hidden.
    pub truth: Truth,
    /// The campaign.
    pub specification: Specification,
}

/// Seals a case's answer.
pub fn seal(case: &Case) -> String {
    let sealed = Sealed { truth: case.truth.clone(), specification: case.specification.clone() };
    let truth = &sealed.truth;
    let hidden = veil(truth.seed, &serde_json::to_vec(&sealed).unwrap_or_default());
    let digits: String = hidden.iter().map(|byte| format!("{byte:02x}")).collect();
    let mut text = format!("{HEADING}\nseed: {}\n", truth.seed);
    let mut rest = digits.as_str();
    while !rest.is_empty() {
        let (line, after) = rest.split_at(rest.len().min(COLUMNS));
        text.push_str(line);
        text.push('\n');
        rest = after;
    }
    text
}

/// Opens a sealed answer.
pub fn open(text: &str) -> Result<Sealed, OpenError> {
    let mut lines = text.lines().enumerate();
    if lines.next().map(|(_, line)| line) != Some(HEADING) {
        return Err(OpenError::NotSealed);
    }
    let seed_line = lines.next().map_or("", |(_, line)| line);
    let seed = seed_line.strip_prefix("seed: ").and_then(|number| number.parse::<u64>().ok());
    let seed = seed.ok_or_else(|| OpenError::Seed(seed_line.to_owned()))?;
    let mut hidden = Vec::new();
    for (index, line) in lines {
        let digits = line.trim().as_bytes();
        for pair in digits.chunks(2) {
            let byte = std::str::from_utf8(pair).ok().filter(|pair| pair.len() == 2);
            let byte = byte.and_then(|pair| u8::from_str_radix(pair, 16).ok());
            let bad =
                || OpenError::Digits { line: index + 1, text: String::from_utf8_lossy(pair).into_owned() };
            hidden.push(byte.ok_or_else(bad)?);
        }
    }
    serde_json::from_slice(&veil(seed, &hidden)).map_err(|error| OpenError::Broken(error.to_string()))
}

/// The same operation veils and unveils.
fn veil(seed: u64, bytes: &[u8]) -> Vec<u8> {
    let mut stream = Random::new(seed, "seal");
    bytes.iter().map(|byte| byte ^ stream.bits().to_le_bytes()[3]).collect()
}
