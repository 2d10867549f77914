//! The token that lets somebody answer.

use std::fs::{self, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use plumb_record::sha256_hex;

/// Fewest characters of a token: 128 bits in hexadecimal.
const SHORTEST: usize = 32;

/// Rights that a group or everybody has.
const OTHERS: u32 = 0o077;

/// Why a token cannot be used.
#[derive(Debug, thiserror::Error)]
pub(super) enum TokenError {
    #[error("cannot read the token in {}: {cause}; `plumb serve --new-token {}` makes one", path.display(), path.display())]
    Read { path: PathBuf, cause: io::Error },
    #[error("others may read {}: chmod 600 {}", path.display(), path.display())]
    NotPrivate { path: PathBuf },
    #[error("the token in {} is shorter than {SHORTEST} characters: `plumb serve --new-token FILE` makes a good one", path.display())]
    Short { path: PathBuf },
    #[error("cannot write a token to {}: {cause}", path.display())]
    Write { path: PathBuf, cause: io::Error },
}

/// A token, as its hash: comparing hashes takes the same time whatever was guessed.
#[derive(Debug, Clone)]
pub(super) struct Token(String);

impl Token {
    pub(super) fn read(path: &Path) -> Result<Self, TokenError> {
        let read = |cause| TokenError::Read { path: path.to_owned(), cause };
        let rights = fs::metadata(path).map_err(read)?.permissions().mode();
        if rights & OTHERS != 0 {
            return Err(TokenError::NotPrivate { path: path.to_owned() });
        }
        let text = fs::read_to_string(path).map_err(read)?;
        let text = text.trim();
        if text.chars().count() < SHORTEST {
            return Err(TokenError::Short { path: path.to_owned() });
        }
        Ok(Self(sha256_hex(text.as_bytes())))
    }

    pub(super) fn is(&self, given: &str) -> bool {
        self.0 == sha256_hex(given.trim().as_bytes())
    }
}

/// Writes a new token, for its owner alone. A file that is there is left as it is.
pub(super) fn write_new(path: &Path) -> Result<(), TokenError> {
    let write = |cause| TokenError::Write { path: path.to_owned(), cause };
    let token = random_key().map_err(write)?;
    let mut file = OpenOptions::new().write(true).create_new(true).mode(0o600).open(path).map_err(write)?;
    writeln!(file, "{token}").map_err(write)
}

/// 128 bits from the system's generator, in hexadecimal.
pub(super) fn random_key() -> io::Result<String> {
    let mut bytes = [0_u8; 16];
    fs::File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_token_is_its_owners_alone_and_opens() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("token");
        write_new(&path).expect("written");
        let token = Token::read(&path).expect("read");
        let text = fs::read_to_string(&path).expect("read");
        assert!(token.is(&text) && !token.is("") && !token.is(&text[1..]));
        assert!(write_new(&path).is_err(), "one that is there is not overwritten");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).expect("changed");
        assert!(Token::read(&path).expect_err("refused").to_string().contains("chmod 600"));
    }

    #[test]
    fn a_short_token_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("token");
        fs::write(&path, "secret\n").expect("written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).expect("changed");
        assert!(matches!(Token::read(&path), Err(TokenError::Short { .. })));
    }
}
