//! The bus: who hears a request, and who answers.

use super::framing::{Request, status_packet};
use super::servo::{Changed, Servo};
use super::shafts::{Aim, ShaftError, Shafts};

const PING: u8 = 1;
const READ: u8 = 2;
const WRITE: u8 = 3;
const SYNC_READ: u8 = 0x82;
const SYNC_WRITE: u8 = 0x83;
/// The number that all servos hear.
const ALL: u8 = 254;

/// What goes out: how long the servo waits first, ns, and its bytes.
pub(super) type Answer = (u64, Vec<u8>);

/// The servos on their bus.
pub(super) struct ServoBus {
    pub(super) servos: Vec<Servo>,
    shafts: Shafts,
    /// How many answers will be lost on the way.
    pub(super) lose: u32,
    /// How many answers will be cut in the middle.
    pub(super) cut: u32,
    /// Whether there is power.
    powered: bool,
}

impl ServoBus {
    pub(super) fn new(servos: Vec<Servo>, shafts: Shafts) -> ServoBus {
        ServoBus { servos, shafts, lose: 0, cut: 0, powered: true }
    }

    /// What the encoders show, and which shafts move.
    pub(super) fn look(&mut self, now_ns: u64) -> Result<Vec<(i32, bool)>, ShaftError> {
        let positions = self.shafts.read(now_ns)?;
        let seen = self.servos.iter().zip(positions);
        Ok(seen.map(|(servo, (counts, moves))| (mirrored(servo, counts).round() as i32, moves)).collect())
    }

    /// Brings every table up to date.
    fn refresh(&mut self, now_ns: u64) -> Result<Vec<(i32, bool)>, ShaftError> {
        let seen = self.look(now_ns)?;
        for (servo, (encoder, moves)) in self.servos.iter_mut().zip(&seen) {
            servo.note(*encoder, *moves);
        }
        Ok(seen)
    }

    /// Carries out a request, and gives what the servos answer.
    pub(super) fn hear(&mut self, request: &Request, now_ns: u64) -> Result<Vec<Answer>, ShaftError> {
        if !self.powered {
            return Ok(Vec::new());
        }
        let seen = self.refresh(now_ns)?;
        let answers = match (request.instruction, request.parameters.as_slice()) {
            (PING, []) => {
                self.answer(|servo| servo.id() == request.id || request.id == ALL, |_| Some(Vec::new()))
            }
            (READ, [address, count]) => self.answer(
                |servo| servo.id() == request.id,
                |servo| servo.read(*address, *count).map(<[u8]>::to_vec),
            ),
            (WRITE, [address, bytes @ ..]) => {
                self.write_each(&[(request.id, bytes)], *address, &seen, now_ns)?;
                self.answer(|servo| servo.id() == request.id && servo.confirms(), |_| Some(Vec::new()))
            }
            (SYNC_READ, [address, count, ids @ ..]) => {
                // They answer in the order in which they are named.
                let one = |id: &u8| {
                    self.answer(
                        |servo| servo.id() == *id,
                        |servo| servo.read(*address, *count).map(<[u8]>::to_vec),
                    )
                };
                ids.iter().flat_map(one).collect()
            }
            (SYNC_WRITE, [address, count, rest @ ..]) => {
                let blocks = rest.chunks_exact(usize::from(*count) + 1).filter_map(<[u8]>::split_first);
                let blocks: Vec<(u8, &[u8])> = blocks.map(|(id, bytes)| (*id, bytes)).collect();
                self.write_each(&blocks, *address, &seen, now_ns)?;
                Vec::new()
            }
            _ => Vec::new(),
        };
        Ok(self.on_their_way(answers))
    }

    fn answer(&self, who: impl Fn(&Servo) -> bool, what: impl Fn(&Servo) -> Option<Vec<u8>>) -> Vec<Answer> {
        let answering = self.servos.iter().filter(|servo| servo.answers && who(servo));
        answering
            .filter_map(|servo| {
                Some((servo.delay_ns(), status_packet(servo.id(), servo.error(), &what(servo)?)))
            })
            .collect()
    }

    /// What becomes of answers: some are lost, some are cut.
    fn on_their_way(&mut self, answers: Vec<Answer>) -> Vec<Answer> {
        let mut arriving = Vec::new();
        for (delay, mut bytes) in answers {
            if self.lose > 0 {
                self.lose -= 1;
                continue;
            }
            if self.cut > 0 {
                self.cut -= 1;
                bytes.truncate(bytes.len() / 2);
            }
            arriving.push((delay, bytes));
        }
        arriving
    }

    fn write_each(
        &mut self,
        blocks: &[(u8, &[u8])],
        address: u8,
        seen: &[(i32, bool)],
        now_ns: u64,
    ) -> Result<(), ShaftError> {
        let mut moves = false;
        for (id, bytes) in blocks {
            for (servo, (encoder, _)) in self.servos.iter_mut().zip(seen) {
                if servo.answers && (servo.id() == *id || *id == ALL) {
                    moves |= servo.write(address, bytes, *encoder) == Changed::Goal;
                }
            }
        }
        if moves { self.drive(now_ns) } else { Ok(()) }
    }

    /// Has every shaft follow its servo.
    pub(super) fn drive(&mut self, now_ns: u64) -> Result<(), ShaftError> {
        let aim = |servo: &Servo| {
            let counts = mirrored(servo, f64::from(servo.aim()));
            servo.holds().then_some(Aim { counts, speed: servo.speed() })
        };
        let aims: Vec<Option<Aim>> = self.servos.iter().map(aim).collect();
        for blocked in self.shafts.drive(&aims, now_ns)? {
            if let Some(servo) = self.servos.get_mut(blocked) {
                servo.overload();
            }
        }
        Ok(())
    }

    /// The power goes, or comes back: then every servo starts anew, and none holds.
    pub(super) fn power(&mut self, on: bool, now_ns: u64) -> Result<(), ShaftError> {
        self.powered = on;
        self.servos.iter_mut().for_each(Servo::start_anew);
        self.drive(now_ns)
    }
}

/// What an encoder shows, or the shaft's position for what it is to show, of a horn that may sit the other way round.
fn mirrored(servo: &Servo, counts: f64) -> f64 {
    if servo.reversed { 4096.0 - counts } else { counts }
}
