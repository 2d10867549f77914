//! What reads the controllers' answers, fed with answers that were cut, joined and damaged.
//!
//! Beside not coming down, what a parser takes must be what is there: a state or a program it has read, written out anew, is read the same.

use std::time::{Duration, Instant};

use plumb_puma::reply::{Ending, Reply, sign};
use plumb_teachmover::protocol::{ControllerState, PrintableBytes, parse_program, parse_state, parse_status};

/// A parser's name, what its controller says, and the parser: whether it took anything from the bytes.
type Row = (&'static str, &'static [&'static [u8]], fn(&[u8]) -> bool);

const PARSERS: [Row; 2] =
    [("VAL-II", &VAL_SAYS, read_val), ("TeachMover", &TEACHMOVER_SAYS, read_teachmover)];

const VAL_SAYS: [&[u8]; 12] = [
    b"\r\n    X/JT1    Y/JT2    Z/JT3    O/JT4    A/JT5    T/JT6\r\n",
    b"  -90.000  -180.000   180.000  -100.250     0.000  -135.500\r\n",
    b" -90.00-180.00 180.00-100.25   0.00-135.50  12.00\r\n",
    b"Change? ",
    b"CHANGES?",
    b"Change?\r\0\0\n",
    b"Are you sure (Y/N)? ",
    b"*Joint 3 out of range*\r\n.",
    b"[Fatal] Panic command\r\n.",
    b"\r\nVAL-II  1.4B\r\nLoad VAL from floppy (Y/N)? N\r\n.",
    b"* ",
    b". ",
];

const TEACHMOVER_SAYS: [&[u8]; 9] = [
    b"0",
    b"1",
    b"2",
    b"-5,0,1162,384,384,-1162,1797",
    b" 32767, -32768, 2147483647, -2147483648, 0, 0, 65535, ",
    b"1 2 3 4 5 6 7",
    b"0,65281,4660,22136,39612,1,2,3\r",
    b"1 0 0 0 0 0 0 -1\r",
    b",99999999999999999999,",
];

/// Feeds each parser for so many seconds, both at once.
pub(crate) fn measure(seconds: usize) -> super::Measured {
    let duration = Duration::from_secs(seconds as u64);
    let lines: Vec<String> = std::thread::scope(|scope| {
        let feeding = PARSERS.map(|parser| scope.spawn(move || feed(parser, duration)));
        feeding.into_iter().map(|one| one.join()).collect::<Result<_, _>>()
    })
    .map_err(|_| "a parser came down: what it was fed is above")?;
    lines.iter().for_each(|line| println!("{line}"));
    Ok(())
}

fn feed((name, says, read): Row, duration: Duration) -> String {
    let (begun, mut rng, mut fed, mut taken) = (Instant::now(), Xorshift(0x2026_1985), 0_u64, 0_u64);
    while begun.elapsed() < duration {
        for _ in 0..1000 {
            let bytes = rng.damaged(says);
            taken += u64::from(read(&bytes));
            fed += 1;
        }
    }
    format!(
        "{name}: {fed} answers in {:.0} s, something taken from {taken} of them, nothing open",
        begun.elapsed().as_secs_f64()
    )
}

fn read_val(bytes: &[u8]) -> bool {
    let _ = sign(bytes);
    let reply = Reply::of(bytes, Ending::Command);
    let read = reply.rows();
    assert!(read.iter().flatten().all(|number| number.is_finite()), "no number: {bytes:?}");
    let _ = (reply.controller_error(), reply.is_greeting());
    !read.is_empty()
}

fn read_teachmover(bytes: &[u8]) -> bool {
    let (status, state, program) = (parse_status(bytes), parse_state(bytes), parse_program(bytes));
    let _ = PrintableBytes(bytes).to_string();
    if let Ok(state) = state {
        assert_eq!(parse_state(&written(&state)), Ok(state), "read otherwise than written: {bytes:?}");
    }
    if let Ok(program) = &program {
        let words = program.iter().flat_map(|line| line.0).map(|word| word.to_string());
        let text = words.collect::<Vec<_>>().join(",");
        assert_eq!(
            parse_program(text.as_bytes()).as_ref(),
            Ok(program),
            "read otherwise than written: {bytes:?}"
        );
    }
    status.is_ok() || state.is_ok() || program.is_ok_and(|program| !program.is_empty())
}

/// A state as the controller writes it.
fn written(state: &ControllerState) -> Vec<u8> {
    let last = u32::from(state.key.0) * 256 + u32::from(state.inputs);
    let registers = state.registers.0.iter().map(i32::to_string);
    registers.chain([last.to_string()]).collect::<Vec<_>>().join(",").into_bytes()
}

/// A small generator (xorshift): its speed is what lets millions of answers be made.
struct Xorshift(u64);

impl Xorshift {
    fn below(&mut self, most: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) as usize % most.max(1)
    }

    /// Up to five answers one after the other, with up to seven bytes cut off, put in, taken out or changed.
    fn damaged(&mut self, says: &[&[u8]]) -> Vec<u8> {
        let mut bytes = Vec::new();
        for _ in 0..self.below(6) {
            bytes.extend_from_slice(says[self.below(says.len())]);
        }
        for _ in 0..self.below(8) {
            let (index, byte) = (self.below(bytes.len()), self.below(256) as u8);
            match self.below(4) {
                0 => bytes.truncate(index),
                1 => bytes.insert(index, byte),
                2 if !bytes.is_empty() => drop(bytes.remove(index)),
                _ => bytes.iter_mut().skip(index).take(1).for_each(|kept| *kept = byte),
            }
        }
        bytes
    }
}
