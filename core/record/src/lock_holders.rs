//! Who has a file open, as the system reports it.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_that_has_the_database_or_a_file_of_it_open_is_named_with_its_number() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("plumb.sqlite3");
        fs::write(&path, "").expect("written");
        assert!(holders_of(&path).is_empty(), "nobody has it open");
        let comm = fs::read_to_string("/proc/self/comm").expect("a name");
        let own = format!("{} ({})", std::process::id(), comm.trim_end());
        for beside in ["", "-wal", "-shm", "-journal"] {
            let name = format!("{}{beside}", path.display());
            let _open = fs::File::create(&name).expect("open");
            assert_eq!(holders_of(&path), [own.as_str()], "{name}");
        }
        let _other = fs::File::create(directory.path().join("plumb.sqlite3-copy")).expect("open");
        assert!(holders_of(&path).is_empty(), "a copy is no part of it");
    }
}
