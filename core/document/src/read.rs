//! Opening and reading within limits.

use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, BufRead, BufReader, Read};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

use nix::fcntl::OFlag;
use nix::sys::statfs::{FsType, PROC_SUPER_MAGIC, SYSFS_MAGIC, fstatfs};

use crate::error::FOLDER;
use crate::{FileKind, ReadError};

/// File systems whose files are questions to the kernel: reading one may take what another program waits for, or wait itself.
const OF_THE_KERNEL: [FsType; 2] = [PROC_SUPER_MAGIC, SYSFS_MAGIC];

/// The longest line of a file that is read line by line, bytes: an event with a picture of a scan in it has some 100 kB.
const LONGEST_LINE: u64 = 16 << 20;

/// A file that ends with an error where it goes on past the limit of its kind.
#[derive(Debug)]
pub struct LimitedReader {
    file: File,
    kind: FileKind,
    left: u64,
}

impl LimitedReader {
    /// Its size when it was opened, bytes.
    ///
    /// # Errors
    /// What the system says.
    pub fn size(&self) -> io::Result<u64> {
        self.file.metadata().map(|known| known.len())
    }
}

impl Read for LimitedReader {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if into.is_empty() {
            return Ok(0);
        }
        // One byte past the limit is asked for, to distinguish a file that ends there from one that does not.
        let most = usize::try_from(self.left.saturating_add(1)).unwrap_or(usize::MAX).min(into.len());
        let read = self.file.read(into.get_mut(..most).unwrap_or_default())?;
        let Some(left) = self.left.checked_sub(read as u64) else {
            return Err(ReadError::Endless { kind: self.kind }.into());
        };
        self.left = left;
        Ok(read)
    }
}

/// Opens a regular file of this kind. Never waits: a pipe is refused before it is opened.
///
/// # Errors
/// [`ReadError`]: it is not there, no regular file, or larger than any of its kind.
pub fn open(path: &Path, kind: FileKind) -> Result<LimitedReader, ReadError> {
    // Looked at before it is opened, since opening alone can wait (a pipe) or do something (a device).
    let known = std::fs::metadata(path)?;
    regular(&known)?;
    let flags = OFlag::O_NONBLOCK | OFlag::O_NOCTTY | OFlag::O_CLOEXEC;
    let file = OpenOptions::new().read(true).custom_flags(flags.bits()).open(path)?;
    // And again, since another may be there by now.
    let known = file.metadata()?;
    regular(&known)?;
    let system = fstatfs(&file).map_err(io::Error::from)?.filesystem_type();
    if OF_THE_KERNEL.contains(&system) {
        return Err(ReadError::NoFile {
            what: "a file of the kernel's own (/proc or /sys)",
            help: "copy what it says into a file and name that",
        });
    }
    if known.len() > kind.most_bytes {
        return Err(ReadError::TooLarge { bytes: known.len(), kind });
    }
    Ok(LimitedReader { file, kind, left: kind.most_bytes })
}

fn regular(known: &Metadata) -> Result<(), ReadError> {
    let no_file = |what, help| Err(ReadError::NoFile { what, help });
    let of_a_file = "only regular files are read: save what it gives into one and name that";
    let form = known.file_type();
    if form.is_file() {
        Ok(())
    } else if form.is_dir() {
        no_file(FOLDER, "name a file in it")
    } else if form.is_fifo() {
        no_file("a named pipe", of_a_file)
    } else if form.is_socket() {
        no_file("a socket", of_a_file)
    } else {
        no_file("a device", of_a_file)
    }
}

/// The bytes of a regular file.
///
/// # Errors
/// [`ReadError`]
pub fn read_bytes(path: &Path, kind: FileKind) -> Result<Vec<u8>, ReadError> {
    let mut file = open(path, kind)?;
    let size = file.size()?.min(kind.most_bytes);
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(size).unwrap_or(0)).map_err(io::Error::from)?;
    match file.read_to_end(&mut bytes) {
        Ok(_) => Ok(bytes),
        Err(error) => Err(error.downcast::<ReadError>().unwrap_or_else(ReadError::System)),
    }
}

/// The text of a regular file, without a byte order mark.
///
/// # Errors
/// [`ReadError`]
pub fn read_text(path: &Path, kind: FileKind) -> Result<String, ReadError> {
    text_of(read_bytes(path, kind)?)
}

/// Bytes as text, without a byte order mark.
///
/// # Errors
/// [`ReadError::NoText`] with the line that is none.
pub fn text_of(bytes: Vec<u8>) -> Result<String, ReadError> {
    let mut text = String::from_utf8(bytes).map_err(|error| {
        let good = error.as_bytes().iter().take(error.utf8_error().valid_up_to());
        ReadError::NoText { line: good.filter(|byte| **byte == b'\n').count() + 1 }
    })?;
    if text.starts_with('\u{feff}') {
        text.drain(..'\u{feff}'.len_utf8());
    }
    Ok(text)
}

/// The lines of a source, each within a limit, with an error and an end where one is longer or no text.
pub fn lines(source: impl Read) -> impl Iterator<Item = Result<String, ReadError>> {
    let mut source = BufReader::new(source);
    let (mut line, mut ended) = (0, false);
    std::iter::from_fn(move || {
        if ended {
            return None;
        }
        line += 1;
        let next = next_line(&mut source, line);
        ended = !matches!(next, Some(Ok(_)));
        next
    })
}

fn next_line(source: &mut impl BufRead, line: usize) -> Option<Result<String, ReadError>> {
    let mut bytes = Vec::new();
    match source.take(LONGEST_LINE).read_until(b'\n', &mut bytes) {
        Err(error) => return Some(Err(error.into())),
        Ok(0) => return None,
        Ok(_) => {}
    }
    if bytes.last() == Some(&b'\n') {
        bytes.pop();
    } else if bytes.len() as u64 == LONGEST_LINE {
        return Some(Err(ReadError::LongLine { line, most_bytes: LONGEST_LINE }));
    }
    Some(String::from_utf8(bytes).map_err(|_| ReadError::NoText { line }))
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;
    use std::os::unix::net::UnixListener;

    use super::*;

    const SMALL: FileKind = FileKind { name: "a small file", most_bytes: 8 };

    fn refused(path: &Path) -> String {
        read_text(path, SMALL).expect_err("it is refused").to_string()
    }

    #[test]
    fn what_is_no_regular_file_is_refused_with_words_and_without_a_wait() {
        let folder = tempfile::tempdir().expect("a folder");
        let pipe = folder.path().join("pipe");
        nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).expect("a pipe");
        let socket = folder.path().join("socket");
        let _listener = UnixListener::bind(&socket).expect("a socket");
        for (path, words) in [
            (pipe.as_path(), "a named pipe"),
            (&socket, "a socket"),
            (folder.path(), "a folder; name a file in it"),
            (Path::new("/dev/zero"), "a device"),
            (Path::new("/proc/kmsg"), "a file of the kernel's own"),
            (Path::new("/proc/self/status"), "a file of the kernel's own"),
            (&folder.path().join("missing"), "there is no such file"),
        ] {
            let message = refused(path);
            assert!(message.contains(words), "{}: {message}", path.display());
        }
    }

    #[test]
    fn a_file_is_read_up_to_its_limit_and_refused_beyond_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        std::fs::write(&path, "12345678").expect("written");
        assert_eq!(read_text(&path, SMALL).expect("just small enough"), "12345678");
        std::fs::write(&path, "123456789").expect("written");
        assert_eq!(
            refused(&path),
            "it has 9 bytes; a small file has at most 8 bytes: see whether this is the right file"
        );
    }

    #[test]
    fn a_file_that_grows_while_it_is_read_ends_at_its_limit() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        std::fs::write(&path, "1234").expect("written");
        let mut file = open(&path, SMALL).expect("open");
        let mut writer = OpenOptions::new().append(true).open(&path).expect("open to write");
        writer.write_all(b"56789").expect("written");
        let mut text = String::new();
        let error = file.read_to_string(&mut text).expect_err("too much");
        assert!(error.to_string().contains("goes on past 8 bytes"), "{error}");
    }

    #[test]
    fn a_byte_order_mark_is_left_out_and_bytes_that_are_no_text_are_reported_with_their_line() {
        assert_eq!(text_of("\u{feff}a".into()).expect("text"), "a");
        assert_eq!(
            text_of(b"a\nb\xff".to_vec()).expect_err("no text").to_string(),
            "line 2 is not UTF-8 text; save the file as UTF-8"
        );
    }

    #[test]
    fn lines_without_end_are_an_error_instead_of_a_full_memory() {
        let read: Vec<String> = lines(&b"a\n\nb"[..]).map(|line| line.expect("a line")).collect();
        assert_eq!(read, ["a", "", "b"]);
        let mut endless = lines(io::repeat(b'x'));
        let error = endless.next().expect("an answer").expect_err("too long");
        assert_eq!(error.to_string(), "line 1 is longer than 16 MiB: see whether this is the right file");
        assert!(endless.next().is_none());
    }
}
