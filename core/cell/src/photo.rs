//! Pictures an operator took: that they are there, and what they are, so that the record can name them for good.

use std::path::Path;

use plumb_document::{FileKind, read_bytes};
use plumb_record::sha256_hex;
use serde::Serialize;

/// A picture, as the record names it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Photo {
    /// The file, from the root.
    pub file: String,
    /// `png` or `jpeg`.
    pub format: &'static str,
    /// Its length.
    pub bytes: u64,
    /// Its SHA-256, in hexadecimal.
    pub sha256: String,
}

/// What the pictures there are begin with.
const FORMATS: [(&str, &[u8]); 2] = [("png", b"\x89PNG\r\n\x1a\n"), ("jpeg", b"\xff\xd8\xff")];

/// Looks at a picture.
///
/// # Errors
/// A sentence that says what is wrong with it, and what would be right.
pub fn examine(file: &str) -> Result<Photo, String> {
    let wrong = |what: &str| Err(format!("{file}: {what}"));
    let path = Path::new(file);
    let absolute = std::path::absolute(path).map_err(|error| format!("`{file}` names no file: {error}"))?;
    let content = match read_bytes(&absolute, FileKind::PHOTO) {
        Ok(content) => content,
        Err(error) => return wrong(&format!("{error}; give the path of the picture you took")),
    };
    let Some((format, _)) = FORMATS.iter().find(|(_, begin)| content.starts_with(begin)) else {
        return wrong("is neither PNG nor JPEG by what it begins with: save the picture as one of them");
    };
    Ok(Photo {
        file: absolute.display().to_string(),
        format,
        bytes: content.len() as u64,
        sha256: sha256_hex(&content),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_known_by_what_it_begins_with_and_named_by_its_content() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("arm.jpg");
        std::fs::write(&path, b"\xff\xd8\xff\xe0 and the rest").unwrap();
        let photo = examine(path.to_str().unwrap()).unwrap();
        assert_eq!((photo.format, photo.bytes, photo.sha256.len()), ("jpeg", 17, 64));
    }

    #[test]
    fn what_is_no_picture_is_said_to_be_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("arm.png");
        let path = path.to_str().unwrap();
        assert!(examine(path).unwrap_err().contains("there is no such file"));
        std::fs::write(path, "no picture").unwrap();
        assert!(examine(path).unwrap_err().contains("neither PNG nor JPEG"));
        assert!(examine(folder.path().to_str().unwrap()).unwrap_err().contains("this is a folder"));
    }
}
