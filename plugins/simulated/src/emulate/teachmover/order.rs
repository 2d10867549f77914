//! What a line from the host asks of the controller, read as generously as real controllers have been seen to read.
//!
//! Programs that drive real arms send blanks after commas, a comma before the carriage return, decimals, and speeds far too high; all of
//! these are taken. Command words are upper case. That anything else is answered with 0 is assumed.

/// How many motors a move names.
const MOTORS: usize = 6;

/// The largest speed the controller keeps; more is taken for this.
const GREATEST_SPEED: i64 = 245;

/// What a line asks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Order {
    /// Turn the motors by these half-steps.
    Turn { speed: u8, half_steps: [i32; MOTORS], outputs: Option<u8> },
    /// Report registers, inputs and key.
    Read,
    /// Close the hand until its switch trips.
    Grasp,
    /// Let the operator teach by hand.
    Teach,
    /// Forget where the arm is and let the motors go.
    Forget,
    /// Carry out the taught program.
    Perform,
    /// Report the taught program.
    List,
    /// Keep a line of a taught program.
    Keep([u16; 8]),
    /// Answer to another character.
    Rename(u8),
    /// Speak more slowly.
    ReplyDelay(u8),
}

/// Reads a line, without its recognition character and carriage return; `None` for one that is no order.
pub(super) fn read(line: &[u8]) -> Option<Order> {
    let line = line.trim_ascii();
    let end = line.iter().position(|byte| !byte.is_ascii_uppercase()).unwrap_or(line.len());
    let (word, rest) = line.split_at(end);
    // Real programs end words that take nothing with a blank, or with ", 0".
    Some(match word {
        b"STEP" => turn(&numbers(rest)?)?,
        b"READ" => Order::Read,
        b"CLOSE" => Order::Grasp,
        b"SET" => Order::Teach,
        b"RESET" => Order::Forget,
        b"RUN" => Order::Perform,
        b"QDUMP" => Order::List,
        b"QWRITE" => keep(&numbers(rest)?)?,
        b"ARM" => Order::Rename(*rest.trim_ascii().first().filter(|byte| byte.is_ascii_graphic())?),
        b"DELAY" => Order::ReplyDelay(u8::try_from(*numbers(rest)?.first()?).ok()?),
        _ => return None,
    })
}

fn turn(numbers: &[i64]) -> Option<Order> {
    let (&speed, rest) = numbers.split_first()?;
    let mut half_steps = [0; MOTORS];
    for (entry, number) in half_steps.iter_mut().zip(rest.get(..MOTORS)?) {
        // A register has sixteen bits.
        *entry = i32::from(i16::try_from(*number).ok()?);
    }
    let outputs = rest.get(MOTORS).map(|number| (*number & 0x1f) as u8);
    let speed = u8::try_from(speed.clamp(0, GREATEST_SPEED)).ok()?;
    Some(Order::Turn { speed, half_steps, outputs })
}

fn keep(numbers: &[i64]) -> Option<Order> {
    let mut words = [0; 8];
    for (entry, number) in words.iter_mut().zip(numbers.get(..8)?) {
        *entry = u16::try_from(*number).ok()?;
    }
    Some(Order::Keep(words))
}

/// The numbers of a line; decimals lose what is behind their point. `None` when something is no number.
fn numbers(text: &[u8]) -> Option<Vec<i64>> {
    let mut text = text.trim_ascii();
    // "@STEP,220,..." is as good as "@STEP 220,...", and a comma may be at the end.
    text = text.strip_prefix(b",").unwrap_or(text);
    text = text.trim_ascii_end().strip_suffix(b",").unwrap_or(text);
    if text.trim_ascii().is_empty() {
        return Some(Vec::new());
    }
    text.split(|byte| *byte == b',').map(number).collect()
}

fn number(text: &[u8]) -> Option<i64> {
    let text = text.trim_ascii();
    let (negative, digits) = match text.split_first()? {
        (b'-', rest) => (true, rest),
        (b'+', rest) => (false, rest),
        _ => (false, text),
    };
    let mut parts = digits.splitn(2, |byte| *byte == b'.');
    let (whole, fraction) = (parts.next()?, parts.next().unwrap_or_default());
    if whole.is_empty() || whole.len() > 9 || !whole.iter().chain(fraction).all(u8::is_ascii_digit) {
        return None;
    }
    let value = whole.iter().fold(0, |value, digit| value * 10 + i64::from(digit - b'0'));
    Some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn step(speed: u8, half_steps: [i32; 6], outputs: Option<u8>) -> Option<Order> {
        Some(Order::Turn { speed, half_steps, outputs })
    }

    #[test]
    fn lines_of_programs_that_drive_real_arms_are_read() {
        for (line, order) in [
            ("STEP 220,1,-2,3,0,0,3", step(220, [1, -2, 3, 0, 0, 3], None)),
            ("STEP 220, 0, 0, 0, 0, 0, -32", step(220, [0, 0, 0, 0, 0, -32], None)),
            ("STEP 232,10,0,0,0,0,0,", step(232, [10, 0, 0, 0, 0, 0], None)),
            ("STEP 240,1,2,3,4,5,6,9", step(240, [1, 2, 3, 4, 5, 6], Some(9))),
            ("STEP 240, 884.0,1255.77,0,0,0,0", step(240, [884, 1255, 0, 0, 0, 0], None)),
            ("STEP 88500,0,0,0,0,0,0", step(245, [0; 6], None)),
            ("STEP,100,1,1,1,1,1,1", step(100, [1; 6], None)),
            ("READ", Some(Order::Read)),
            ("CLOSE ", Some(Order::Grasp)),
            ("CLOSE, 0", Some(Order::Grasp)),
            ("RESET, 0", Some(Order::Forget)),
            ("QWRITE 1,65281,0,0,0,0,0,0", Some(Order::Keep([1, 65281, 0, 0, 0, 0, 0, 0]))),
            ("ARM #", Some(Order::Rename(b'#'))),
            ("DELAY 5", Some(Order::ReplyDelay(5))),
        ] {
            assert_eq!(read(line.as_bytes()), order, "{line}");
        }
    }

    #[test]
    fn what_is_no_order_is_none() {
        for line in [
            "",
            "STOP",
            "read",
            "STEP",
            "STEP 220,1,2,3",
            "STEP 220,1,2,x,4,5,6",
            "STEP 220,1,2,,4,5,6",
            "STEP 220,40000,0,0,0,0,0",
            "STEP 220,1-1,0,0,0,0,0",
            "QWRITE 1,2,3",
            "QWRITE 1,2,3,4,5,6,7,65536",
            "ARM",
            "DELAY",
            "DELAY -1",
        ] {
            assert_eq!(read(line.as_bytes()), None, "{line}");
        }
    }

    proptest! {
        #[test]
        fn no_bytes_make_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..120)) {
            let _ = read(&bytes);
        }

        #[test]
        fn nothing_near_an_order_makes_the_reader_panic(text in "(STEP|QWRITE|ARM|DELAY|READ)[-+. ,0-9A-Z\r]{0,60}") {
            let _ = read(text.as_bytes());
        }

        #[test]
        fn a_move_is_read_whatever_blanks_are_between(half_steps in prop::array::uniform6(-9999..9999_i32), blank in " {0,2}") {
            let list: Vec<String> = half_steps.iter().map(|count| format!("{blank}{count}")).collect();
            prop_assert_eq!(read(format!("STEP 10,{}", list.join(",")).as_bytes()), step(10, half_steps, None));
        }
    }
}
