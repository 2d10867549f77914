//! Who has a file open, as the system tells it.

use std::fs;
use std::path::Path;

/// The processes that have the database `path`, or a file beside it that belongs to it, open: `4711 (sqlite3)`. Only those of the same user
/// can be seen.
pub(crate) fn holders_of(path: &Path) -> Vec<String> {
    let Ok(processes) = fs::read_dir("/proc") else { return Vec::new() };
    let Ok(path) = fs::canonicalize(path) else { return Vec::new() };
    let name = path.as_os_str().to_string_lossy().into_owned();
    let mut holders = Vec::new();
    for process in processes.flatten() {
        let number = process.file_name().to_string_lossy().into_owned();
        if number.parse::<u32>().is_err() || !has_open(&process.path(), &name) {
            continue;
        }
        let command = fs::read_to_string(process.path().join("comm")).unwrap_or_default();
        holders.push(format!("{number} ({})", command.trim_end()));
    }
    holders
}

fn has_open(process: &Path, name: &str) -> bool {
    let Ok(files) = fs::read_dir(process.join("fd")) else { return false };
    files.flatten().filter_map(|file| fs::read_link(file.path()).ok()).any(|target| {
        let target = target.to_string_lossy();
        target.strip_prefix(name).is_some_and(|rest| matches!(rest, "" | "-wal" | "-shm" | "-journal"))
    })
}
