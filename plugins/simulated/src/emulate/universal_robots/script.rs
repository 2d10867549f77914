//! The part of URScript that a controller is sent here: a program is a function definition, one statement a line.

use super::states::AXES;

/// A program, line by line.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Program {
    /// `sec` in place of `def`: it runs beside the program that runs.
    pub(super) secondary: bool,
    pub(super) statements: Vec<Statement>,
}

/// One statement.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Statement {
    /// rad, rad/s2, rad/s.
    MoveJ {
        joints: [f64; AXES],
        acceleration: f64,
        speed: f64,
    },
    /// rad/s2.
    StopJ {
        deceleration: f64,
    },
    WriteRegister {
        register: usize,
        value: i32,
    },
    Watchdog {
        register: usize,
        hz: f64,
        action: WatchdogAction,
    },
    Sleep {
        seconds: f64,
    },
    Message(String),
    Nothing,
}

/// What happens when inputs no longer come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WatchdogAction {
    Ignore,
    Pause,
    Stop,
}

/// Why a program does not run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ScriptError {
    /// From 1.
    pub(super) line: i32,
    pub(super) text: String,
}

/// Takes whole programs out of what a client has sent: a definition up to its `end`, or a single line by itself.
pub(super) fn take_program(heard: &mut Vec<u8>) -> Option<String> {
    let text = String::from_utf8_lossy(heard).into_owned();
    let mut length = 0;
    let mut program = String::new();
    for line in text.split_inclusive('\n') {
        if !line.ends_with('\n') {
            return None;
        }
        length += line.len();
        let bare = line.trim_end();
        if program.is_empty() && bare.is_empty() {
            heard.drain(..length);
            return take_program(heard);
        }
        program.push_str(bare);
        program.push('\n');
        let begins = program.starts_with("def ") || program.starts_with("sec ");
        if !begins || bare == "end" {
            heard.drain(..length);
            return Some(program);
        }
    }
    None
}

impl Program {
    /// Reads a program.
    pub(super) fn read(text: &str) -> Result<Self, ScriptError> {
        let lines: Vec<&str> = text.lines().collect();
        let first = lines.first().copied().unwrap_or_default();
        let defines = ["def ", "sec "].iter().any(|word| first.starts_with(word));
        let body = match (defines, lines.as_slice()) {
            (true, [head, body @ .., "end"]) if head.ends_with("():") => body,
            (true, _) => return Err(error(0, "syntax_error_on_line")),
            (false, all) => all,
        };
        let offset = usize::from(defines);
        let mut statements = Vec::new();
        for (index, line) in body.iter().enumerate() {
            let statement = statement(line.trim()).map_err(|text| error(index + offset, &text))?;
            statements.push(statement);
        }
        let secondary = first.starts_with("sec ");
        let moves = |one: &Statement| matches!(one, Statement::MoveJ { .. } | Statement::StopJ { .. });
        if secondary && statements.iter().any(moves) {
            return Err(error(1, "a secondary program must not move the robot"));
        }
        Ok(Self { secondary, statements })
    }
}

fn error(line: usize, text: &str) -> ScriptError {
    ScriptError { line: i32::try_from(line + 1).unwrap_or(i32::MAX), text: text.to_owned() }
}

fn statement(line: &str) -> Result<Statement, String> {
    let line = line.split('#').next().unwrap_or_default().trim();
    if line.is_empty() || line == "sync()" {
        return Ok(Statement::Nothing);
    }
    let (name, inner) = line
        .split_once('(')
        .and_then(|(name, rest)| Some((name, rest.strip_suffix(')')?)))
        .ok_or_else(|| "syntax_error_on_line".to_owned())?;
    let arguments = Arguments::of(inner);
    match name {
        "movej" => Ok(Statement::MoveJ {
            joints: arguments.joints()?,
            acceleration: arguments.number("a", 1, 1.4)?,
            speed: arguments.number("v", 2, 1.05)?,
        }),
        "stopj" => Ok(Statement::StopJ { deceleration: arguments.number("a", 0, 2.0)? }),
        "sleep" => Ok(Statement::Sleep { seconds: arguments.number("t", 0, 0.0)? }),
        "textmsg" => Ok(Statement::Message(inner.trim_matches('"').to_owned())),
        "write_output_integer_register" => {
            let (register, value) = (arguments.number("", 0, -1.0)?, arguments.number("", 1, 0.0)?);
            if !(0.0..48.0).contains(&register) {
                return Err(format!("there is no output register {register}"));
            }
            Ok(Statement::WriteRegister { register: register as usize, value: value as i32 })
        }
        "rtde_set_watchdog" => arguments.watchdog(),
        other => Err(format!("compile_error_name_not_found:{other}:")),
    }
}

/// What is between the parentheses of a call.
struct Arguments<'a> {
    all: Vec<&'a str>,
}

impl<'a> Arguments<'a> {
    /// Split at the commas that are in no list.
    fn of(inner: &'a str) -> Self {
        let (mut all, mut depth, mut begin) = (Vec::new(), 0_i32, 0);
        for (offset, character) in inner.char_indices() {
            match character {
                '[' => depth += 1,
                ']' => depth -= 1,
                ',' if depth == 0 => {
                    all.push(inner.get(begin..offset).unwrap_or_default().trim());
                    begin = offset + 1;
                }
                _ => {}
            }
        }
        all.push(inner.get(begin..).unwrap_or_default().trim());
        Self { all }
    }

    /// A number by its name or, without one, its index.
    fn number(&self, name: &str, index: usize, usual: f64) -> Result<f64, String> {
        let named = self.all.iter().find_map(|argument| {
            let (key, value) = argument.split_once('=')?;
            (key.trim() == name).then(|| value.trim())
        });
        let plain = self.all.get(index).filter(|argument| !argument.contains('=') && !argument.is_empty());
        let Some(text) = named.or(plain.copied()) else { return Ok(usual) };
        let number: f64 = text.parse().map_err(|_| format!("compile_error_name_not_found:{text}:"))?;
        if number.is_finite() { Ok(number) } else { Err(format!("`{text}` is no number")) }
    }

    fn joints(&self) -> Result<[f64; AXES], String> {
        let list = self.all.first().and_then(|first| first.strip_prefix('[')?.strip_suffix(']'));
        let list = list.ok_or_else(|| "movej takes a list of six joints here".to_owned())?;
        let numbers: Vec<f64> = list.split(',').filter_map(|one| one.trim().parse().ok()).collect();
        let joints: Result<[f64; AXES], _> = numbers.try_into();
        let joints = joints.map_err(|_| "movej takes a list of six joints here".to_owned())?;
        match joints.iter().all(|joint| joint.is_finite()) {
            true => Ok(joints),
            false => Err("a joint is no number".to_owned()),
        }
    }

    fn watchdog(&self) -> Result<Statement, String> {
        let [variable, hz, action] = self.all.as_slice() else {
            return Err("rtde_set_watchdog takes a variable, a frequency and an action".to_owned());
        };
        let register = variable
            .trim_matches('"')
            .strip_prefix("input_int_register_")
            .and_then(|number| number.parse().ok())
            .filter(|number| *number < 48_usize)
            .ok_or_else(|| format!("there is no input {variable}"))?;
        let hz = hz.parse().ok().filter(|hz: &f64| *hz > 0.0);
        let action = match action.trim_matches('"') {
            "ignore" => WatchdogAction::Ignore,
            "pause" => WatchdogAction::Pause,
            "stop" => WatchdogAction::Stop,
            other => return Err(format!("a watchdog cannot `{other}`")),
        };
        let hz = hz.ok_or_else(|| "the frequency of a watchdog is a positive number".to_owned())?;
        Ok(Statement::Watchdog { register, hz, action })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_is_read_as_the_manual_writes_it() {
        let text = "def go():\n  rtde_set_watchdog(\"input_int_register_24\", 10, \"stop\")\n  write_output_integer_register(24, 7)\n  movej([0, -1.57, 1.57, -1.57, 0, 0.5], a=1.4, v=0.5)\n  sleep(0.1)\n  stopj(2)\nend\n";
        let program = Program::read(text).unwrap();
        assert_eq!(
            program.statements,
            [
                Statement::Watchdog { register: 24, hz: 10.0, action: WatchdogAction::Stop },
                Statement::WriteRegister { register: 24, value: 7 },
                Statement::MoveJ {
                    joints: [0.0, -1.57, 1.57, -1.57, 0.0, 0.5],
                    acceleration: 1.4,
                    speed: 0.5
                },
                Statement::Sleep { seconds: 0.1 },
                Statement::StopJ { deceleration: 2.0 },
            ]
        );
    }

    #[test]
    fn a_mistake_is_reported_with_its_line() {
        for (text, line) in [
            ("def go():\n  fly(1)\nend\n", 2),
            ("def go():\n  sync()\n  movej([1, 2], a=1)\nend\n", 3),
            ("def go(\nend\n", 1),
            ("sec go():\n  movej([0,0,0,0,0,0])\nend\n", 2),
        ] {
            assert_eq!(Program::read(text).unwrap_err().line, line, "{text}");
        }
    }

    #[test]
    fn programs_are_taken_one_by_one_and_only_when_they_are_whole() {
        let mut heard = b"\nstopj(2)\ndef go():\n  sync()\nend\ndef more():\n".to_vec();
        assert_eq!(take_program(&mut heard).as_deref(), Some("stopj(2)\n"));
        assert_eq!(take_program(&mut heard).as_deref(), Some("def go():\n  sync()\nend\n"));
        assert_eq!(take_program(&mut heard), None);
        heard.extend(b"end\n");
        assert_eq!(take_program(&mut heard).as_deref(), Some("def more():\nend\n"));
    }
}
