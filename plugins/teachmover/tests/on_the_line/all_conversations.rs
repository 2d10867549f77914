//! Every file under `conversations/` is one.

use std::path::{Path, PathBuf};

use crate::conversation::play;

fn files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/conversations");
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn every_conversation_goes_as_its_file_says() {
    let files = files();
    assert!(files.len() > 20, "the conversations are not found");
    let threads: Vec<_> =
        files.into_iter().map(|file| (file.clone(), std::thread::spawn(move || play(&file)))).collect();
    let failed: Vec<PathBuf> =
        threads.into_iter().filter_map(|(file, thread)| thread.join().is_err().then_some(file)).collect();
    assert!(failed.is_empty(), "{failed:?}");
}
