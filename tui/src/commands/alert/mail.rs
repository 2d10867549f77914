//! E-mail, through the mailer of this machine.

use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use super::trouble::Trouble;

/// How long a mailer may take to take a message over. What it does with it afterwards is its own.
const WITHIN: Duration = Duration::from_secs(10);

/// How often it is looked at meanwhile.
const LOOK: Duration = Duration::from_millis(20);

/// Longest header: RFC 5322, section 2.1.1, allows 998 characters; a subject is read on one line.
const LONGEST_SUBJECT: usize = 100;

/// Longest word of RFC 2047 in characters is 75; each byte may take three, and 12 are the word's own.
const BYTES_OF_A_WORD: usize = 20;

/// Why no e-mail was sent.
#[derive(Debug, thiserror::Error)]
pub(super) enum MailError {
    #[error("`{0}` is no e-mail address: write NAME@DOMAIN, or the name of a user of this machine")]
    Address(String),
    #[error("the mailer {} cannot be started: {cause}; install one (Debian: msmtp-mta or nullmailer), or name it with --sendmail", program.display())]
    Start { program: PathBuf, cause: io::Error },
    #[error("the mailer {} took longer than {} s, and was ended", .0.display(), WITHIN.as_secs())]
    Slow(PathBuf),
    #[error("the mailer {} refused the message ({status}){reported}", program.display())]
    Refused { program: PathBuf, status: ExitStatus, reported: String },
}

/// Whom to write, and through what.
pub(super) struct Mail {
    program: PathBuf,
    to: Vec<String>,
    name: String,
}

impl Mail {
    pub(super) fn to(program: &Path, to: &[String]) -> Result<Self, MailError> {
        if let Some(wrong) = to.iter().find(|address| !is_address(address)) {
            return Err(MailError::Address(wrong.clone()));
        }
        Ok(Self {
            program: program.to_owned(),
            to: to.to_vec(),
            name: format!("e-mail to {}", to.join(", ")),
        })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn send(&self, trouble: &Trouble) -> Result<(), MailError> {
        let failed = |cause| MailError::Start { program: self.program.clone(), cause };
        // A file takes the message: a mailer that does not read cannot hold this program up.
        let mut message = tempfile_of(&self.message(trouble)).map_err(failed)?;
        io::Seek::rewind(&mut message).map_err(failed)?;
        let mut child = Command::new(&self.program)
            .args(["-i", "--"])
            .args(&self.to)
            .stdin(message)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(failed)?;
        match wait(&mut child).map_err(failed)? {
            None => Err(MailError::Slow(self.program.clone())),
            Some(status) if status.success() => Ok(()),
            Some(status) => {
                let reported = first_line(&mut child);
                Err(MailError::Refused { program: self.program.clone(), status, reported })
            }
        }
    }

    fn message(&self, trouble: &Trouble) -> String {
        format!(
            "To: {}\nSubject: {}\nMIME-Version: 1.0\nContent-Type: text/plain; charset=utf-8\nContent-Transfer-Encoding: 8bit\n\n{}\n\nSince {} UTC.\n",
            self.to.join(", "),
            subject(&trouble.text),
            trouble.text,
            trouble.since.trim_end_matches('Z').replace('T', " ")
        )
    }
}

/// A file without a name, which goes with its last handle.
fn tempfile_of(text: &str) -> io::Result<std::fs::File> {
    use std::os::unix::fs::OpenOptionsExt as _;
    let number =
        std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0, |now| now.as_nanos());
    let path = std::env::temp_dir().join(format!("plumb-alert-{}-{number}", std::process::id()));
    let mut file =
        std::fs::OpenOptions::new().read(true).write(true).create_new(true).mode(0o600).open(&path)?;
    std::fs::remove_file(&path)?;
    file.write_all(text.as_bytes())?;
    Ok(file)
}

/// Waits for the end; none when it took too long and was ended.
fn wait(child: &mut Child) -> io::Result<Option<ExitStatus>> {
    let begin = Instant::now();
    while begin.elapsed() < WITHIN {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        std::thread::sleep(LOOK);
    }
    child.kill()?;
    child.wait()?;
    Ok(None)
}

/// What it said, where it said something short.
fn first_line(child: &mut Child) -> String {
    let mut reported = [0_u8; 300];
    let read = child.stderr.as_mut().and_then(|stderr| stderr.read(&mut reported).ok()).unwrap_or(0);
    let text = String::from_utf8_lossy(reported.get(..read).unwrap_or_default()).into_owned();
    text.lines().next().map(|line| format!(": {line}")).unwrap_or_default()
}

/// Whether it may be given to a mailer as an address: no option, no second line, nothing that separates.
fn is_address(text: &str) -> bool {
    let may_be =
        |letter: char| !letter.is_control() && !letter.is_whitespace() && !",;<>()\"".contains(letter);
    !text.is_empty() && !text.starts_with(['-', '@']) && !text.ends_with('@') && text.chars().all(may_be)
}

/// A subject: one line, in ASCII or in encoded words (RFC 2047).
fn subject(text: &str) -> String {
    let line: String = text.chars().map(|letter| if letter.is_control() { ' ' } else { letter }).collect();
    let short: String = line.chars().take(LONGEST_SUBJECT).collect();
    let short = if short.len() < line.len() { format!("{short}...") } else { short };
    let whole = format!("[plumb] {short}");
    if whole.is_ascii() {
        return whole;
    }
    let mut words: Vec<String> = vec![String::new()];
    let mut bytes_of_last = 0;
    for letter in whole.chars() {
        // A letter is not parted.
        if bytes_of_last + letter.len_utf8() > BYTES_OF_A_WORD {
            words.push(String::new());
            bytes_of_last = 0;
        }
        bytes_of_last += letter.len_utf8();
        let mut bytes = [0_u8; 4];
        let encoded: String =
            letter.encode_utf8(&mut bytes).bytes().map(|byte| format!("={byte:02X}")).collect();
        if let Some(word) = words.last_mut() {
            word.push_str(&encoded);
        }
    }
    let words: Vec<String> = words.iter().map(|word| format!("=?UTF-8?Q?{word}?=")).collect();
    words.join("\n ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_subject_is_one_line_of_ascii_whatever_a_prompt_says() {
        assert_eq!(subject("bench: `Lay the target` waits"), "[plumb] bench: `Lay the target` waits");
        let injected = subject("x\r\nBcc: eve@evil.example");
        assert!(!injected.contains('\n') && !injected.contains('\r'), "{injected}");
        let encoded = subject("Prüfstand 3: Ziel auflegen, µm");
        assert!(encoded.is_ascii() && encoded.starts_with("=?UTF-8?Q?=5B=70"), "{encoded}");
        assert!(encoded.lines().all(|line| line.len() <= 76), "{encoded}");
        assert!(subject(&"x".repeat(500)).len() < 120);
    }

    #[test]
    fn an_address_is_no_option_and_no_list() {
        assert!(["ada@lab.example", "root", "a.b+c@d"].into_iter().all(is_address));
        let wrong = ["", "-t", "a b@c", "a@b\nBcc: c", "a@b,c@d", "@lab", "ada@", "<a@b>"];
        assert!(wrong.into_iter().all(|text| !is_address(text)));
    }
}
