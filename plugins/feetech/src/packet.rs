//! What travels on the bus: `FF FF`, the servo's number, the count of what follows, an instruction (or a servo's status), parameters, and a checksum.

/// What begins every packet.
const HEADER: [u8; 2] = [0xff, 0xff];
/// The number that means every servo; none answers to it.
pub(crate) const EVERY_SERVO: u8 = 0xfe;
/// More than any answer to what this driver asks for: a count beyond it is damage.
const LONGEST: u8 = 64;

/// What a servo can be commanded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Instruction {
    Read = 0x02,
    Write = 0x03,
    SyncRead = 0x82,
    SyncWrite = 0x83,
}

/// What a servo has answered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Its number.
    pub servo: u8,
    /// What is wrong with it, a bit each.
    pub status: u8,
    /// What it was asked for.
    pub data: Vec<u8>,
}

/// A packet for the bus.
pub(crate) fn packet(servo: u8, instruction: Instruction, parameters: &[u8]) -> Vec<u8> {
    let count = u8::try_from(parameters.len() + 2).unwrap_or(u8::MAX);
    let mut bytes = HEADER.to_vec();
    bytes.extend([servo, count, instruction as u8]);
    bytes.extend_from_slice(parameters);
    bytes.push(checksum(bytes.get(2..).unwrap_or_default()));
    bytes
}

/// Takes the first whole answer out of what was heard. Bytes that can begin none are dropped; each packet whose checksum is wrong is counted.
pub fn take_answer(heard: &mut Vec<u8>, damaged: &mut u32) -> Option<Answer> {
    loop {
        let begins = heard.windows(2).position(|pair| pair == HEADER);
        match begins {
            Some(start) => drop(heard.drain(..start)),
            None => {
                // The last byte may be the first of a header.
                let keep = usize::from(heard.last() == Some(&HEADER[0]));
                heard.drain(..heard.len() - keep);
                return None;
            }
        }
        let (servo, count) = (*heard.get(2)?, *heard.get(3)?);
        if servo == HEADER[0] || !(2..=LONGEST).contains(&count) {
            heard.drain(..1);
            continue;
        }
        let whole = heard.get(..4 + usize::from(count))?;
        let (covered, last) = whole.split_at(whole.len() - 1);
        if last.first() == Some(&checksum(covered.get(2..).unwrap_or_default())) {
            let answer = Answer {
                servo,
                status: covered.get(4).copied().unwrap_or_default(),
                data: covered.get(5..).unwrap_or_default().to_vec(),
            };
            heard.drain(..4 + usize::from(count));
            return Some(answer);
        }
        *damaged += 1;
        heard.drain(..1);
    }
}

/// All bits of the sum turned over, of everything between the header and this byte.
fn checksum(covered: &[u8]) -> u8 {
    !covered.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of the maker's protocol manual: servo 1 is asked for its position.
    #[test]
    fn a_packet_looks_as_in_the_manual() {
        let bytes = packet(1, Instruction::Read, &[0x38, 0x02]);
        assert_eq!(bytes, [0xff, 0xff, 0x01, 0x04, 0x02, 0x38, 0x02, 0xbe]);
    }

    #[test]
    fn an_answer_is_found_among_noise_and_damage() {
        let good = [0xff, 0xff, 0x01, 0x04, 0x00, 0x18, 0x05, 0xdd];
        let mut heard = vec![0x12, 0xff, 0x00, 0xff];
        heard.extend([0xff, 0xff, 0x01, 0x04, 0x00, 0x18, 0x15, 0xdd]);
        heard.extend(good);
        heard.extend([0xff, 0xff, 0x02]);
        let mut damaged = 0;
        let answer = take_answer(&mut heard, &mut damaged);
        assert_eq!(answer, Some(Answer { servo: 1, status: 0, data: vec![0x18, 0x05] }));
        assert!(damaged > 0);
        assert_eq!(take_answer(&mut heard, &mut damaged), None);
        assert_eq!(heard, [0xff, 0xff, 0x02], "what may become a packet is kept");
    }

    #[test]
    fn a_packet_that_was_cut_is_no_answer_and_does_not_swallow_the_next() {
        let mut heard = vec![0xff, 0xff, 0x01, 0x04, 0x00];
        heard.extend([0xff, 0xff, 0x02, 0x02, 0x00, 0xfb]);
        let mut damaged = 0;
        let answer = take_answer(&mut heard, &mut damaged);
        assert_eq!(answer, Some(Answer { servo: 2, status: 0, data: Vec::new() }));
        assert_eq!(damaged, 1);
    }
}
