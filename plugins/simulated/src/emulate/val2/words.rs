//! Commands as they are typed: abbreviated to what is still unique, with their arguments.

use super::dialect::ControllerError;

/// What the monitor can be commanded.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Command {
    Nothing,
    Where,
    Here(String),
    Point(String),
    Speed(Option<f64>),
    Calibrate,
    Abort,
    Execute(String),
    Move(String),
    /// A precision point, and its six angles, degrees.
    Set(String, [f64; 6]),
    /// Joint from 1, degrees, percent.
    Drive(usize, f64, f64),
    Ready,
    /// Righty, lefty and the like: what the arm's configuration is to be for positions, which joints do not mind.
    Configuration,
}

const COMMANDS: [&str; 9] =
    ["ABORT", "CALIBRATE", "DIRECTORY", "DO", "EXECUTE", "HERE", "POINT", "SPEED", "WHERE"];
const INSTRUCTIONS: [&str; 9] =
    ["ABOVE", "BELOW", "DRIVE", "FLIP", "LEFTY", "MOVE", "READY", "RIGHTY", "SET"];

pub(super) fn parse(line: &str) -> Result<Command, ControllerError> {
    let line = line.trim().to_ascii_uppercase();
    if line.is_empty() {
        return Ok(Command::Nothing);
    }
    let (word, rest) = split(&line);
    match unique(word, &COMMANDS)? {
        "ABORT" => Ok(Command::Abort),
        "CALIBRATE" => Ok(Command::Calibrate),
        "WHERE" => Ok(Command::Where),
        "HERE" => point_name(rest).map(Command::Here),
        "POINT" => point_name(rest).map(Command::Point),
        "EXECUTE" if !rest.is_empty() => Ok(Command::Execute(split(rest).0.to_owned())),
        "SPEED" if rest.is_empty() => Ok(Command::Speed(None)),
        "SPEED" => {
            let percent = number(rest)?;
            if (0.01..=300.0).contains(&percent) {
                Ok(Command::Speed(Some(percent)))
            } else {
                Err(ControllerError::Argument)
            }
        }
        "DO" => instruction(rest),
        _ => Err(ControllerError::Syntax),
    }
}

fn instruction(line: &str) -> Result<Command, ControllerError> {
    let (word, rest) = split(line);
    match unique(word, &INSTRUCTIONS)? {
        "MOVE" => point_name(rest).map(Command::Move),
        "READY" => Ok(Command::Ready),
        "SET" => set(rest),
        "DRIVE" => {
            let parts: Vec<&str> = rest.split(',').map(str::trim).collect();
            let [joint, degrees, percent] = parts.as_slice() else { return Err(ControllerError::Syntax) };
            let joint: usize = joint.parse().map_err(|_| ControllerError::JointNumber)?;
            if !(1..=6).contains(&joint) {
                return Err(ControllerError::JointNumber);
            }
            let (degrees, percent) = (number(degrees)?, number(percent)?);
            if !(0.01..=300.0).contains(&percent) {
                return Err(ControllerError::Argument);
            }
            Ok(Command::Drive(joint, degrees, percent))
        }
        _ => Ok(Command::Configuration),
    }
}

/// `#NAME=#PPOINT(j1,j2,j3,j4,j5,j6)`, as clients of later controllers of the family set their points (RX90, RX60L). Omitted angles are 0.
fn set(text: &str) -> Result<Command, ControllerError> {
    let (name, value) = text.split_once('=').ok_or(ControllerError::Syntax)?;
    let value = value.trim().strip_prefix("#PPOINT").ok_or(ControllerError::Syntax)?.trim();
    let inside =
        value.strip_prefix('(').and_then(|value| value.strip_suffix(')')).ok_or(ControllerError::Syntax)?;
    let mut angles = [0.0; 6];
    for (angle, typed) in angles.iter_mut().zip(changes(inside)?) {
        *angle = typed.unwrap_or(0.0);
    }
    Ok(Command::Set(point_name(name)?, angles))
}

/// The values typed after a question for changes: omitted ones keep their commas.
pub(super) fn changes(line: &str) -> Result<Vec<Option<f64>>, ControllerError> {
    let parts: Vec<&str> = line.split(',').map(str::trim).collect();
    if parts.len() > 6 {
        return Err(ControllerError::Syntax);
    }
    let value = |part: &&str| if part.is_empty() { Ok(None) } else { angle(part).map(Some) };
    parts.iter().map(value).collect()
}

/// An angle as the terminal takes it: from -180 up to, but not, 180 degrees.
fn angle(text: &str) -> Result<f64, ControllerError> {
    let angle = number(text)?;
    if (-180.0..180.0).contains(&angle) { Ok(angle) } else { Err(ControllerError::Argument) }
}

fn number(text: &str) -> Result<f64, ControllerError> {
    let plain = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit() || b"+-.".contains(&byte));
    text.parse().ok().filter(|_| plain).ok_or(ControllerError::Syntax)
}

fn point_name(text: &str) -> Result<String, ControllerError> {
    let name = text.trim();
    let good = name.strip_prefix('#').is_some_and(|rest| {
        (1..=5).contains(&rest.len()) && rest.bytes().all(|byte| byte.is_ascii_alphanumeric())
    });
    if good { Ok(name.to_owned()) } else { Err(ControllerError::Argument) }
}

fn split(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace).map_or((line, ""), |(word, rest)| (word, rest.trim()))
}

fn unique(word: &str, known: &[&'static str]) -> Result<&'static str, ControllerError> {
    if let Some(exact) = known.iter().find(|candidate| **candidate == word) {
        return Ok(exact);
    }
    let mut fitting = known.iter().filter(|candidate| !word.is_empty() && candidate.starts_with(word));
    match (fitting.next(), fitting.next()) {
        (Some(only), None) => Ok(only),
        (Some(_), Some(_)) => Err(ControllerError::Ambiguous),
        _ => Err(ControllerError::Unknown),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_abbreviated_to_what_is_unique() {
        assert_eq!(parse("where"), Ok(Command::Where));
        assert_eq!(parse("w"), Ok(Command::Where));
        assert_eq!(parse("d"), Err(ControllerError::Ambiguous));
        assert_eq!(parse("do dr 4,-62.5,75"), Ok(Command::Drive(4, -62.5, 75.0)));
        assert_eq!(parse("do ready"), Ok(Command::Ready));
        assert_eq!(parse("here #p1"), Ok(Command::Here("#P1".to_owned())));
        let angles = [0.0, -90.0, 90.5, 0.0, 0.0, 0.0];
        assert_eq!(parse("do set #p1=#ppoint(0,-90,90.5,,0,0)"), Ok(Command::Set("#P1".to_owned(), angles)));
        assert_eq!(parse("drive 4,1,1"), Err(ControllerError::Unknown), "an instruction wants its DO");
    }

    #[test]
    fn wrong_arguments_are_complained_of() {
        assert_eq!(parse("do drive 7,1,50"), Err(ControllerError::JointNumber));
        assert_eq!(parse("do drive 1,x,50"), Err(ControllerError::Syntax));
        assert_eq!(parse("speed 0"), Err(ControllerError::Argument));
        assert_eq!(parse("point p1"), Err(ControllerError::Argument));
        assert_eq!(parse("do set #p1=(0,0,0,0,0,0)"), Err(ControllerError::Syntax));
        assert_eq!(parse("do set #p1=#ppoint(200)"), Err(ControllerError::Argument));
        assert!(parse("do s #p1=#ppoint(1)").is_ok(), "abbreviated as any instruction");
        assert_eq!(changes("1,,180"), Err(ControllerError::Argument));
        assert_eq!(changes("1,,-180"), Ok(vec![Some(1.0), None, Some(-180.0)]));
    }
}
