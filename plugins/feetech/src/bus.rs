//! A conversation on the bus: one question at a time, each with a deadline, asked again where an answer was lost or damaged.

use std::time::{Duration, Instant};

use plumb_serial_line::{OpenFailure, SerialLine, Unplugged, WriteError, WriteFailure};

use crate::packet::{Answer, EVERY_SERVO, Instruction, packet, take_answer};
use crate::registers::Register;

/// How often a question is asked in all.
const TRIES: u32 = 3;
/// A line on which nothing has come for so long holds nothing of an earlier answer.
const QUIET: Duration = Duration::from_millis(3);
/// The longest the line is listened to until it is quiet.
const QUIET_WITHIN: Duration = Duration::from_millis(100);

/// What went wrong on the bus.
#[derive(Clone, Debug, thiserror::Error)]
pub(crate) enum BusError {
    /// The port cannot be opened.
    #[error("{port}: {failure}")]
    Open { port: String, failure: OpenFailure },
    /// The adapter is gone.
    #[error("{0}")]
    Unplugged(#[from] Unplugged),
    /// The adapter takes no bytes.
    #[error("the bus adapter took too little: {0}")]
    Write(WriteError),
    /// Servos did not answer; some answers may have come damaged.
    #[error("no answer from {servos:?}")]
    Silent { servos: Vec<u8>, damaged: u32 },
}

impl From<WriteError> for BusError {
    /// An adapter that is pulled out in the middle of a write is gone, as one that is pulled out in the middle of a read.
    fn from(error: WriteError) -> Self {
        match error.failure {
            WriteFailure::Unplugged(unplugged) => Self::Unplugged(unplugged),
            WriteFailure::Full { .. } => Self::Write(error),
        }
    }
}

/// How the line did.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counts {
    /// Questions and orders.
    pub(crate) packets: u64,
    /// Answers that did not come.
    pub(crate) lost: u64,
    /// Answers whose checksum was wrong.
    pub(crate) damaged: u64,
}

/// The bus.
#[derive(Debug)]
pub(crate) struct Bus {
    line: SerialLine,
    within: Duration,
    /// Whether something may still be under way that belongs to a question given up.
    unsettled: bool,
    pub(crate) counts: Counts,
}

impl Bus {
    pub(crate) fn open(port: &str, baud: u32, within: Duration) -> Result<Self, BusError> {
        let line = SerialLine::open(port, baud)
            .map_err(|failure| BusError::Open { port: port.to_owned(), failure })?;
        Ok(Self { line, within, unsettled: true, counts: Counts::default() })
    }

    /// One register's value.
    pub(crate) fn read(&mut self, servo: u8, register: Register) -> Result<u16, BusError> {
        let answer = self.read_block(servo, register.address, register.length)?;
        let byte = |index: usize| answer.data.get(index).copied().unwrap_or_default();
        Ok(u16::from_le_bytes([byte(0), byte(1)]))
    }

    /// A block of registers of one servo.
    pub(crate) fn read_block(&mut self, servo: u8, address: u8, length: u8) -> Result<Answer, BusError> {
        let question = packet(servo, Instruction::Read, &[address, length]);
        let mut answers = self.ask(&question, &[servo], length)?;
        answers.pop().ok_or(BusError::Silent { servos: vec![servo], damaged: 0 })
    }

    /// The same block of several servos, in one question; those whose answers were lost are asked again by themselves.
    pub(crate) fn read_all(
        &mut self,
        servos: &[u8],
        address: u8,
        length: u8,
    ) -> Result<Vec<Answer>, BusError> {
        let mut parameters = vec![address, length];
        parameters.extend_from_slice(servos);
        let question = packet(EVERY_SERVO, Instruction::SyncRead, &parameters);
        let (mut answers, _) = self.listen_after(&question, servos, length)?;
        let (mut silent, mut damaged_in_all) = (Vec::new(), 0);
        for servo in servos
            .iter()
            .filter(|servo| answers.iter().all(|answer| answer.servo != **servo))
            .copied()
            .collect::<Vec<_>>()
        {
            match self.read_block(servo, address, length) {
                Ok(answer) => answers.push(answer),
                Err(BusError::Silent { damaged, .. }) => {
                    silent.push(servo);
                    damaged_in_all += damaged;
                }
                Err(error) => return Err(error),
            }
        }
        match silent.is_empty() {
            true => Ok(answers),
            false => Err(BusError::Silent { servos: silent, damaged: damaged_in_all }),
        }
    }

    /// Writes one register; the servo confirms it.
    pub(crate) fn write(&mut self, servo: u8, register: Register, value: u16) -> Result<(), BusError> {
        let [low, high] = value.to_le_bytes();
        let bytes = [register.address, low, high];
        let parameters = bytes.get(..1 + usize::from(register.length)).unwrap_or(&bytes);
        self.ask(&packet(servo, Instruction::Write, parameters), &[servo], 0).map(drop)
    }

    /// Writes blocks of the same registers to several servos at once. Nobody confirms it: read it back.
    pub(crate) fn write_all(
        &mut self,
        address: u8,
        length: u8,
        blocks: &[(u8, Vec<u8>)],
    ) -> Result<(), BusError> {
        let mut parameters = vec![address, length];
        for (servo, block) in blocks {
            parameters.push(*servo);
            parameters.extend_from_slice(block);
        }
        self.settle()?;
        self.send(&packet(EVERY_SERVO, Instruction::SyncWrite, &parameters))
    }

    /// Asks until all that are expected have answered.
    fn ask(&mut self, question: &[u8], servos: &[u8], length: u8) -> Result<Vec<Answer>, BusError> {
        let mut damaged_in_all = 0;
        for _ in 0..TRIES {
            let (answers, damaged) = self.listen_after(question, servos, length)?;
            if answers.len() == servos.len() {
                return Ok(answers);
            }
            damaged_in_all += damaged;
        }
        Err(BusError::Silent { servos: servos.to_vec(), damaged: damaged_in_all })
    }

    /// Asks once, and gives the answers that came in time, and how many came damaged.
    fn listen_after(
        &mut self,
        question: &[u8],
        servos: &[u8],
        length: u8,
    ) -> Result<(Vec<Answer>, u32), BusError> {
        self.settle()?;
        self.send(question)?;
        let expected = (6 + usize::from(length)) * servos.len() + question.len();
        let deadline = Instant::now() + self.within + self.line.duration(expected);
        let (mut heard, mut answers, mut damaged) = (Vec::new(), Vec::<Answer>::new(), 0);
        let mut echo_looked_for = false;
        while answers.len() < servos.len() {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            heard.extend(self.line.read(left)?);
            // Adapters without a switch of direction bring back what was sent; read as an answer it would be one.
            if !echo_looked_for && heard.len() >= question.len() {
                echo_looked_for = true;
                if heard.starts_with(question) {
                    heard.drain(..question.len());
                }
            }
            if !echo_looked_for && question.starts_with(&heard) {
                continue;
            }
            while let Some(answer) = take_answer(&mut heard, &mut damaged) {
                let known = answers.iter().any(|other| other.servo == answer.servo);
                if servos.contains(&answer.servo) && answer.data.len() == usize::from(length) && !known {
                    answers.push(answer);
                }
            }
        }
        let missing = servos.len() - answers.len();
        self.unsettled = missing > 0;
        self.counts.lost += missing as u64;
        self.counts.damaged += u64::from(damaged);
        Ok((answers, damaged))
    }

    /// Lets what belongs to an earlier question go by: an answer has no number by which it could be known as late.
    fn settle(&mut self) -> Result<(), BusError> {
        let deadline = Instant::now() + QUIET_WITHIN;
        let quiet = if self.unsettled { QUIET } else { Duration::ZERO };
        while !self.line.read(quiet)?.is_empty() && Instant::now() < deadline {}
        self.unsettled = false;
        Ok(())
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), BusError> {
        self.counts.packets += 1;
        let limit = self.within + self.line.duration(bytes.len());
        Ok(self.line.write(bytes, limit)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_adapter_that_goes_in_mid_write_is_gone_and_one_that_takes_no_more_is_not() {
        let gone = WriteFailure::Unplugged(Unplugged { cause: "I/O error".to_owned() });
        let full = WriteFailure::Full { waited: Duration::from_millis(20) };
        assert!(matches!(WriteError { sent: 0, failure: gone }.into(), BusError::Unplugged(_)));
        assert!(matches!(WriteError { sent: 3, failure: full }.into(), BusError::Write(_)));
    }
}
