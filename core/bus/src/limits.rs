//! What the system allows a process that takes part in a cell: open files, address space, threads. Without enough of them the layers below fail
//! somewhere, in words of their own; so this is looked at first.

use std::sync::mpsc::channel;
use std::thread;

use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit, setrlimit};

/// The open files a process needs: a cell of eight devices takes about half as many.
const FILES_NEEDED: u64 = 256;

/// What the number of open files is raised to where the system lets us.
const FILES_WANTED: u64 = 4096;

/// The address space a process needs, bytes: shared memory of a camera, the stacks of its threads, and the program itself.
const ADDRESSES_NEEDED: u64 = 1 << 30;

/// Where POSIX shared memory lies.
const SHARED_MEMORY: &str = "/dev/shm";

/// The shared memory a process needs at least, bytes: a cell of two devices takes 5 MB.
const SHARED_MEMORY_NEEDED: u64 = 2 << 20;

/// The threads a process needs beside those it has.
const THREADS_NEEDED: usize = 16;

/// Below this many processes and threads of a user it is tried whether there are enough left.
const FEW_PROCESSES: u64 = 4096;

/// Makes sure that the system allows this process what it needs, and raises the number of open files where that is allowed.
///
/// # Errors
/// What is too little, as a sentence with both numbers and how to raise it.
pub fn check_limits() -> Result<(), String> {
    raise_open_files();
    too_few_files(limit(Resource::RLIMIT_NOFILE))?;
    too_little_space(limit(Resource::RLIMIT_AS))?;
    too_little_shared_memory(shared_memory_free())?;
    too_few_threads(limit(Resource::RLIMIT_NPROC), can_start_threads)
}

/// How many files this process may have open.
pub fn open_files_allowed() -> u64 {
    limit(Resource::RLIMIT_NOFILE)
}

/// The limit that is in force; none is as much as there can be.
fn limit(resource: Resource) -> u64 {
    getrlimit(resource).map_or(RLIM_INFINITY, |(soft, _)| soft)
}

fn raise_open_files() {
    if let Ok((soft, hard)) = getrlimit(Resource::RLIMIT_NOFILE)
        && let Some(requested) = raised(soft, hard)
    {
        // What cannot be raised is reported below when it is too little.
        let _ = setrlimit(Resource::RLIMIT_NOFILE, requested, hard);
    }
}

/// What a limit of open files is raised to; none where it is high enough.
fn raised(soft: u64, hard: u64) -> Option<u64> {
    (soft < FILES_WANTED).then_some(FILES_WANTED.min(hard))
}

/// Free bytes where POSIX shared memory lies; none where the system does not say.
fn shared_memory_free() -> Option<u64> {
    let known = nix::sys::statvfs::statvfs(SHARED_MEMORY).ok()?;
    Some(known.blocks_available().saturating_mul(known.fragment_size()))
}

fn too_little_shared_memory(free: Option<u64>) -> Result<(), String> {
    match free.filter(|free| *free < SHARED_MEMORY_NEEDED) {
        None => Ok(()),
        Some(free) => Err(format!(
            "shared memory is full: {SHARED_MEMORY} has {} kB free and a device needs {} kB: `plumb doctor --clean` removes what dead runs left, \
             `sudo mount -o remount,size=1G {SHARED_MEMORY}` makes it larger",
            free / 1024,
            SHARED_MEMORY_NEEDED / 1024
        )),
    }
}

fn too_few_files(allowed: u64) -> Result<(), String> {
    if allowed >= FILES_NEEDED {
        return Ok(());
    }
    Err(format!("too many open files: raise `ulimit -n` ({allowed} now, {FILES_NEEDED} needed)"))
}

fn too_little_space(allowed: u64) -> Result<(), String> {
    if allowed >= ADDRESSES_NEEDED {
        return Ok(());
    }
    let (now, needed) = (allowed / 1024, ADDRESSES_NEEDED / 1024);
    Err(format!("too little address space: raise `ulimit -v` ({now} kB now, {needed} kB needed)"))
}

/// Where few processes are allowed, it is tried whether the threads can be started.
fn too_few_threads(processes: u64, can_start: impl FnOnce(usize) -> bool) -> Result<(), String> {
    if processes >= FEW_PROCESSES || can_start(THREADS_NEEDED) {
        return Ok(());
    }
    Err(format!(
        "too few threads: the system gives this program less than the {THREADS_NEEDED} more it needs: raise `ulimit -u` ({processes} now, for all \
         processes and threads of this user)"
    ))
}

/// Whether some more threads can be started at once. They end before this returns.
fn can_start_threads(count: usize) -> bool {
    let (end, ended) = channel::<()>();
    let ended = std::sync::Arc::new(std::sync::Mutex::new(ended));
    let threads: Vec<_> = (0..count)
        .map_while(|_| {
            let ended = std::sync::Arc::clone(&ended);
            let wait = move || {
                // Until the sender is dropped; one thread after another.
                let _ = ended.lock().map(|ended| ended.recv());
            };
            thread::Builder::new().spawn(wait).ok()
        })
        .collect();
    let started = threads.len();
    drop(end);
    for thread in threads {
        // A thread that waits for nothing does not panic.
        let _ = thread.join();
    }
    started == count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_little_of_anything_is_reported_with_both_numbers() {
        assert_eq!(
            too_few_files(20).unwrap_err(),
            "too many open files: raise `ulimit -n` (20 now, 256 needed)"
        );
        assert_eq!(too_little_shared_memory(Some(SHARED_MEMORY_NEEDED)), Ok(()));
        let full = too_little_shared_memory(Some(200 << 10)).unwrap_err();
        assert!(full.contains("has 200 kB free and a device needs 2048 kB"), "{full}");
        assert_eq!(
            too_little_space(512 << 20).unwrap_err(),
            "too little address space: raise `ulimit -v` (524288 kB now, 1048576 kB needed)"
        );
        assert!(too_few_files(RLIM_INFINITY).is_ok() && too_little_space(RLIM_INFINITY).is_ok());
    }

    #[test]
    fn open_files_are_raised_to_what_is_wanted_and_allowed_and_never_lowered() {
        assert_eq!(raised(1024, 1 << 20), Some(4096));
        assert_eq!(raised(1024, 2048), Some(2048), "the system allows no more");
        assert_eq!(raised(4095, 1 << 20), Some(4096));
        assert_eq!((raised(4096, 1 << 20), raised(1 << 20, 1 << 20)), (None, None));
        let (soft, hard) = getrlimit(Resource::RLIMIT_NOFILE).unwrap();
        // The tests beside this one need far fewer.
        setrlimit(Resource::RLIMIT_NOFILE, soft.min(1000), hard).unwrap();
        raise_open_files();
        assert_eq!(open_files_allowed(), hard.min(FILES_WANTED));
    }

    #[test]
    fn threads_are_tried_only_where_few_processes_are_allowed() {
        assert_eq!(too_few_threads(4096, |_| panic!("there are enough")), Ok(()));
        assert_eq!(too_few_threads(RLIM_INFINITY, |_| panic!("there are enough")), Ok(()));
        assert_eq!(too_few_threads(4095, |count| count == 16), Ok(()));
        let error = too_few_threads(4095, |_| false).unwrap_err();
        assert!(error.contains("less than the 16 more it needs: raise `ulimit -u` (4095 now"), "{error}");
    }

    #[test]
    fn the_free_shared_memory_of_this_machine_is_known() {
        assert!(shared_memory_free().unwrap() > 4096);
    }

    #[test]
    fn this_machine_allows_enough_for_its_tests() {
        check_limits().unwrap();
        assert!(open_files_allowed() >= FILES_NEEDED);
        assert!(can_start_threads(THREADS_NEEDED));
    }
}
