//! One servo: its table of registers, and what protects it.

/// Bytes of the table.
pub(super) const TABLE: usize = 87;
/// Registers below this are kept without power.
const PERMANENT: usize = 40;
/// Counts of the encoder in a turn.
pub(super) const TURN: i32 = 4096;

const MIN_LIMIT: usize = 9;
const MAX_LIMIT: usize = 11;
const HOTTEST: usize = 13;
const OFFSET: usize = 31;
const TORQUE: usize = 40;
const GOAL: usize = 42;
const SPEED: usize = 46;
const LOCK: usize = 55;
const PRESENT: usize = 56;

/// Bits of the error byte.
const VOLTAGE: u8 = 1;
const HEAT: u8 = 4;
const OVERLOAD: u8 = 32;

/// What every servo comes with (STS3215): address, bytes.
const FACTORY: [(usize, &[u8]); 19] = [
    (0, &[3, 10, 0, 9, 3]), // firmware 3.10, low byte first, model 777
    (5, &[1, 0, 0, 1]),     // number, 1 Mbaud, no delay, answers to everything
    (MIN_LIMIT, &[0, 0]),
    (MAX_LIMIT, &[0xff, 0x0f]),
    (HOTTEST, &[70, 140, 40]), // degrees Celsius, tenths of a volt
    (16, &[0xe8, 0x03]),
    (18, &[12]), // phase: speeds in single steps, 0 is full speed
    (19, &[44, 47]),
    (21, &[32, 32, 0]),
    (24, &[16, 0, 1, 1]),
    (28, &[0xf4, 0x01]),
    (30, &[1]),
    (34, &[20, 200, 80, 10, 200, 200]),
    (48, &[0xe8, 0x03]),
    (LOCK, &[1]),
    (62, &[74, 31]),
    (80, &[1]),
    (84, &[0]),
    (85, &[0]),
];

/// A servo.
#[derive(Debug, Clone)]
pub(super) struct Servo {
    table: [u8; TABLE],
    /// What comes back with the power.
    kept: [u8; PERMANENT],
    /// Whether it hears and answers.
    pub(super) answers: bool,
    /// By how much its load pulls it short of its goal, steps.
    pub(super) sag: i32,
    /// Whether its horn was put on the other way round: it counts down where the joint's angle grows.
    pub(super) reversed: bool,
    error: u8,
}

/// What a write has changed that its shaft has to know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Changed {
    Nothing,
    /// A goal, or whether it is followed.
    Goal,
}

impl Servo {
    pub(super) fn new(id: u8, reversed: bool) -> Servo {
        let mut table = [0; TABLE];
        for (address, bytes) in FACTORY {
            for (entry, byte) in table.iter_mut().skip(address).zip(bytes) {
                *entry = *byte;
            }
        }
        table[5] = id;
        let mut kept = [0; PERMANENT];
        kept.copy_from_slice(&table[..PERMANENT]);
        Servo { table, kept, answers: true, sag: 0, reversed, error: 0 }
    }

    pub(super) fn id(&self) -> u8 {
        self.table[5]
    }

    /// Whether it confirms what is written to it.
    pub(super) fn confirms(&self) -> bool {
        self.table[8] != 0
    }

    /// How long it waits with an answer, ns: its register counts 2 us.
    pub(super) fn delay_ns(&self) -> u64 {
        u64::from(self.table[7]) * 2000
    }

    pub(super) fn error(&self) -> u8 {
        self.error
    }

    pub(super) fn holds(&self) -> bool {
        self.table[TORQUE] == 1
    }

    fn word(&self, address: usize) -> u16 {
        u16::from_le_bytes([self.table[address], self.table[address + 1]])
    }

    fn set_word(&mut self, address: usize, value: u16) {
        let [low, high] = value.to_le_bytes();
        self.table[address] = low;
        self.table[address + 1] = high;
    }

    /// What is subtracted from the encoder: 11 bits and a sign.
    pub(super) fn offset(&self) -> i32 {
        let raw = self.word(OFFSET);
        let size = i32::from(raw & 0x7ff);
        if raw & 0x800 == 0 { size } else { -size }
    }

    /// The position of the encoder to which its goal leads, load included; a goal beyond its own limits is cut.
    pub(super) fn aim(&self) -> i32 {
        let goal = self.word(GOAL).clamp(self.word(MIN_LIMIT), self.word(MAX_LIMIT));
        i32::from(goal) + self.offset() - self.sag
    }

    /// Steps a second.
    pub(super) fn speed(&self) -> f64 {
        match self.word(SPEED) & 0x7fff {
            0 => 3400.0,
            speed => f64::from(speed),
        }
    }

    /// Brings the table's live part up to date.
    pub(super) fn note(&mut self, encoder: i32, moving: bool) {
        let present = (encoder - self.offset()).rem_euclid(TURN) as u16;
        self.set_word(PRESENT, present);
        let load: u16 = if self.holds() { 60 + self.sag.unsigned_abs().min(900) as u16 } else { 0 };
        self.set_word(60, load);
        self.table[65] = self.error;
        self.table[66] = u8::from(moving);
        self.protect();
    }

    /// What is read; `None` beyond the table's end.
    pub(super) fn read(&self, address: u8, count: u8) -> Option<&[u8]> {
        let from = usize::from(address);
        self.table.get(from..from + usize::from(count))
    }

    /// What is written. `encoder` is where its shaft is.
    pub(super) fn write(&mut self, address: u8, bytes: &[u8], encoder: i32) -> Changed {
        let from = usize::from(address);
        let mut changed = Changed::Nothing;
        for (index, byte) in (from..).zip(bytes) {
            if index < 5 || (PRESENT..PRESENT + 15).contains(&index) || index >= TABLE {
                continue;
            }
            if index == TORQUE && *byte == 128 {
                self.call_middle(encoder);
                continue;
            }
            self.table[index] = *byte;
            if index < PERMANENT && self.table[LOCK] == 0 {
                self.kept[index] = *byte;
            }
            match index {
                TORQUE => {
                    self.error &= !OVERLOAD;
                    self.protect();
                    changed = Changed::Goal;
                }
                GOAL..=47 => changed = Changed::Goal,
                _ => {}
            }
        }
        changed
    }

    /// Its present position is the middle from now on: the register of torque takes 128 for that.
    fn call_middle(&mut self, encoder: i32) {
        let offset = (encoder - TURN / 2).clamp(-2047, 2047);
        let sign = if offset < 0 { 0x800 } else { 0 };
        self.set_word(OFFSET, offset.unsigned_abs() as u16 | sign);
        self.kept[OFFSET] = self.table[OFFSET];
        self.kept[OFFSET + 1] = self.table[OFFSET + 1];
    }

    /// Its load is too great: it lets go.
    pub(super) fn overload(&mut self) {
        self.error |= OVERLOAD;
        self.table[TORQUE] = 0;
    }

    pub(super) fn set_celsius(&mut self, celsius: u8) {
        self.table[63] = celsius;
        self.protect();
    }

    pub(super) fn set_decivolts(&mut self, decivolts: u8) {
        self.table[62] = decivolts;
        self.protect();
    }

    /// What is too hot lets go; a voltage out of range is only reported.
    fn protect(&mut self) {
        let set = |error: u8, bit: u8, on: bool| if on { error | bit } else { error & !bit };
        let hot = self.table[63] > self.table[HOTTEST];
        let volts_wrong = !(self.table[15]..=self.table[14]).contains(&self.table[62]);
        self.error = set(set(self.error, HEAT, hot), VOLTAGE, volts_wrong);
        if hot {
            self.table[TORQUE] = 0;
        }
    }

    /// Its power goes and comes back.
    pub(super) fn start_anew(&mut self) {
        let fresh = Servo::new(self.id(), self.reversed);
        let (kept, answers, sag) = (self.kept, self.answers, self.sag);
        *self = Servo { kept, answers, sag, ..fresh };
        self.table[..PERMANENT].copy_from_slice(&kept);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_homing_offset_shifts_what_is_shown_and_where_goals_lead() {
        let mut servo = Servo::new(3, false);
        servo.write(55, &[0], 0);
        servo.write(31, &[100, 8], 0);
        servo.note(2048, false);
        assert_eq!((servo.offset(), servo.word(PRESENT)), (-100, 2148));
        servo.write(40, &[1], 2048);
        servo.write(42, &[0, 8], 2048);
        assert_eq!(servo.aim(), 1948);
        servo.note(10, false);
        assert_eq!(servo.word(PRESENT), 110);
    }

    #[test]
    fn what_is_written_while_locked_goes_with_the_power() {
        let mut servo = Servo::new(3, false);
        servo.write(31, &[7, 0], 0);
        assert_eq!(servo.offset(), 7);
        servo.start_anew();
        assert_eq!(servo.offset(), 0);
        servo.write(55, &[0], 0);
        servo.write(31, &[7, 0], 0);
        servo.start_anew();
        assert_eq!((servo.offset(), servo.id(), servo.holds()), (7, 3, false));
    }

    #[test]
    fn it_protects_itself() {
        let mut servo = Servo::new(1, false);
        servo.write(40, &[1], 0);
        servo.overload();
        assert_eq!((servo.holds(), servo.error()), (false, OVERLOAD));
        servo.write(40, &[1], 0);
        assert_eq!((servo.holds(), servo.error()), (true, 0));
        servo.set_celsius(75);
        servo.write(40, &[1], 0);
        assert_eq!((servo.holds(), servo.error()), (false, HEAT));
        servo.set_decivolts(30);
        assert_eq!(servo.error(), HEAT | VOLTAGE);
    }
}
