//! A transcript played: what the program sends is held against what was sent then, and answered as then.

use super::file::{Entry, Sender, Transcript, shown};

/// Bytes around a difference that are shown.
const AROUND: usize = 24;

/// Where what the program sends is not what was sent then.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// The line of the transcript on which its turn begins; none when the transcript was at its end.
    pub line: Option<usize>,
    /// Which of the program's turns, from 1.
    pub turn: usize,
    /// Which byte of that turn, from 1.
    pub byte: usize,
    /// What was sent then, as a transcript shows it.
    pub then: String,
    /// What is sent now, up to the byte that differs.
    pub now: String,
}

impl std::fmt::Display for Difference {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.line {
            Some(line) => write!(
                formatter,
                "line {line} of the transcript, turn {} of the program, byte {}: it sent {} then, and sends {} now",
                self.turn, self.byte, self.then, self.now
            ),
            None => write!(formatter, "after the end of the transcript the program sends {}", self.now),
        }
    }
}

/// How far a transcript was played.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Progress {
    /// Turns of the program that came as they did then.
    pub turns: usize,
    /// Of so many in all.
    pub of: usize,
    /// Questions that came more often than then, and were answered as before.
    pub repeated: usize,
    /// Questions that came less often than then.
    pub left_out: usize,
    /// The first difference; from there on nothing is answered.
    pub difference: Option<Difference>,
}

/// Plays a transcript.
///
/// A program that asks again and again until something has happened does so as often as its clock lets it, and not as often as then. So a question that was just answered may come
/// again (and is answered as it was), and repetitions of a question in the transcript may be left out. Everything else must be as it was, byte by byte.
#[derive(Debug)]
pub struct Player {
    entries: Vec<Entry>,
    /// The next entry.
    next: usize,
    /// The program's turn that was answered last.
    former: Option<usize>,
    /// What has come of the turn under way.
    coming: Vec<u8>,
    progress: Progress,
}

/// What a turn under way may become.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Candidate {
    /// The next turn of the transcript.
    Next(usize),
    /// The turn before, again.
    Again(usize),
    /// One behind repetitions that are left out.
    Beyond(usize),
}

impl Player {
    /// At the beginning of a transcript.
    pub fn new(transcript: Transcript) -> Self {
        let of = transcript.entries.iter().filter(|entry| entry.sender == Sender::Program).count();
        Self {
            entries: transcript.entries,
            next: 0,
            former: None,
            coming: Vec::new(),
            progress: Progress { of, ..Progress::default() },
        }
    }

    /// How far it is.
    pub fn progress(&self) -> &Progress {
        &self.progress
    }

    /// What the device sent before the program sent anything.
    pub fn begin(&mut self) -> Vec<u8> {
        self.answer(0)
    }

    /// The program sends a byte; what the device sends then.
    pub fn hear(&mut self, byte: u8) -> Vec<u8> {
        if self.progress.difference.is_some() {
            return Vec::new();
        }
        self.coming.push(byte);
        let candidates = self.candidates();
        let fits = |candidate: &&Candidate| self.bytes_of(**candidate).starts_with(&self.coming);
        let Some(first) = candidates.iter().find(fits).copied() else {
            self.note_difference();
            return Vec::new();
        };
        let whole = candidates.iter().find(|candidate| self.bytes_of(**candidate) == self.coming).copied();
        match whole {
            Some(Candidate::Next(index)) => self.take(index),
            // A longer turn that begins like this one is still possible: it is waited for.
            Some(_) if matches!(first, Candidate::Next(_)) => Vec::new(),
            Some(Candidate::Again(index)) => {
                self.progress.repeated += 1;
                self.coming.clear();
                self.answered_then(index)
            }
            Some(Candidate::Beyond(index)) => {
                let between = self.entries.get(self.next..index).unwrap_or_default();
                self.progress.left_out +=
                    between.iter().filter(|entry| entry.sender == Sender::Program).count();
                self.take(index)
            }
            None => Vec::new(),
        }
    }

    /// The turns that may come, in the order in which they are thought of.
    fn candidates(&self) -> Vec<Candidate> {
        let mut candidates = Vec::new();
        let next = self.turn_from(self.next);
        candidates.extend(next.map(Candidate::Next));
        candidates.extend(self.former.map(Candidate::Again));
        if let (Some(former), Some(next)) = (self.former, next)
            && self.same(former, next)
        {
            let mut index = next;
            while let Some(later) = self.turn_from(index + 1) {
                index = later;
                if !self.same(former, index) {
                    candidates.push(Candidate::Beyond(index));
                    break;
                }
            }
        }
        candidates
    }

    fn turn_from(&self, from: usize) -> Option<usize> {
        (from..self.entries.len())
            .find(|index| self.entries.get(*index).is_some_and(|entry| entry.sender == Sender::Program))
    }

    fn same(&self, one: usize, other: usize) -> bool {
        let bytes = |index: usize| self.entries.get(index).map(|entry| &entry.bytes);
        bytes(one) == bytes(other)
    }

    fn bytes_of(&self, candidate: Candidate) -> &[u8] {
        let (Candidate::Next(index) | Candidate::Again(index) | Candidate::Beyond(index)) = candidate;
        self.entries.get(index).map_or(&[], |entry| &entry.bytes)
    }

    fn take(&mut self, index: usize) -> Vec<u8> {
        self.progress.turns += 1;
        self.former = Some(index);
        self.coming.clear();
        self.answer(index + 1)
    }

    /// What the device sends from an entry on, until the program has to send.
    fn answer(&mut self, from: usize) -> Vec<u8> {
        self.next = from;
        match self.entries.get(from) {
            Some(entry) if entry.sender == Sender::Device => {
                self.next = from + 1;
                entry.bytes.clone()
            }
            _ => Vec::new(),
        }
    }

    fn answered_then(&self, turn: usize) -> Vec<u8> {
        let answer = self.entries.get(turn + 1).filter(|entry| entry.sender == Sender::Device);
        answer.map_or(Vec::new(), |entry| entry.bytes.clone())
    }

    fn note_difference(&mut self) {
        let expected = self.turn_from(self.next).and_then(|index| self.entries.get(index));
        let then = expected.map_or(&[][..], |entry| &entry.bytes);
        let same = then.iter().zip(&self.coming).take_while(|(then, now)| then == now).count();
        let around = |bytes: &[u8]| {
            let end = bytes.len().min(same + AROUND);
            shown(bytes.get(same.saturating_sub(AROUND)..end).unwrap_or_default())
        };
        self.progress.difference = Some(Difference {
            line: expected.map(|entry| entry.line),
            turn: self.progress.turns + self.progress.left_out + 1,
            byte: same + 1,
            then: around(then),
            now: around(&self.coming),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn played(transcript: &str, sent: &str) -> (String, Progress) {
        let mut player = Player::new(Transcript::parse(transcript).unwrap());
        let mut answers = player.begin();
        for byte in sent.bytes() {
            answers.extend(player.hear(byte));
        }
        (String::from_utf8(answers).unwrap(), player.progress().clone())
    }

    const LOG: &str = "< \".\"\n> \"go\\r\"\n< \"1\"\n> \"at?\\r\"\n< \"5\"\n> \"at?\\r\"\n< \"9\"\n> \"end\\r\"\n< \"!\"\n";

    #[test]
    fn what_is_as_it_was_is_answered_as_it_was() {
        let (answers, progress) = played(LOG, "go\rat?\rat?\rend\r");
        assert_eq!((answers.as_str(), progress.turns, progress.of), (".159!", 4, 4));
        assert_eq!((progress.repeated, progress.left_out, progress.difference), (0, 0, None));
    }

    #[test]
    fn a_question_may_come_more_often_or_less_often_than_then() {
        let (answers, progress) = played(LOG, "go\rat?\rat?\rat?\rat?\rend\r");
        assert_eq!((answers.as_str(), progress.repeated, progress.difference), (".15999!", 2, None));
        let (answers, progress) = played(LOG, "go\rat?\rend\r");
        assert_eq!((answers.as_str(), progress.left_out, progress.difference), (".15!", 1, None));
    }

    #[test]
    fn a_difference_is_reported_with_where_and_what_and_nothing_is_answered_after_it() {
        let (answers, progress) = played(LOG, "go\rat?\rat?\reld\rend\r");
        assert_eq!(answers, ".159");
        let difference = progress.difference.unwrap();
        assert_eq!((difference.line, difference.turn, difference.byte), (Some(8), 4, 2));
        assert_eq!(
            difference.to_string(),
            "line 8 of the transcript, turn 4 of the program, byte 2: it sent \"end\\r\" then, and sends \"el\" now"
        );
        let (_, progress) = played(LOG, "go\rat?\rat?\rend\rmore");
        assert_eq!(
            progress.difference.unwrap().to_string(),
            "after the end of the transcript the program sends \"m\""
        );
    }
}
