//! Limits of one input: a reader that needs more is as wrong as one that panics.

use std::collections::BTreeMap;
use std::sync::{Mutex, Once};
use std::thread;
use std::time::{Duration, Instant};

use nix::sys::resource::{Resource, getrlimit, setrlimit};
use nix::time::ClockId;

/// Processor time of one input, which a busy machine does not change.
const MOST_TIME: Duration = Duration::from_secs(2);

/// Memory of all targets that run at once, over what the program has when it begins, bytes.
const MOST_MEMORY: u64 = 1 << 30;

/// A reader that has not come back by then hangs: the whole program ends, so that the test ends with a failure.
const HANGS: Duration = Duration::from_secs(60);

/// What is being read: target, since when.
static READING: Mutex<BTreeMap<&str, (Instant, Vec<u8>)>> = Mutex::new(BTreeMap::new());

/// Reads one input within the limits.
pub(crate) fn within_limits(target: &'static str, bytes: &[u8], read: impl FnOnce(&[u8])) {
    static BEGUN: Once = Once::new();
    BEGUN.call_once(begin);
    READING.lock().unwrap().insert(target, (Instant::now(), bytes.to_vec()));
    let done = Done(target);
    let begin = processor_time();
    read(bytes);
    let took = processor_time() - begin;
    drop(done);
    assert!(took < MOST_TIME, "{target} took {took:?} for {} bytes", bytes.len());
}

/// A reader that has come back, or panicked: then what it read is kept, to be put into the corpus.
struct Done(&'static str);

impl Drop for Done {
    fn drop(&mut self) {
        let read = READING.lock().unwrap().remove(self.0);
        if let (true, Some((_, bytes))) = (thread::panicking(), read) {
            let file = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("fuzz-{}", self.0));
            let _kept = std::fs::write(&file, bytes);
            eprintln!("{} stumbled over {}", self.0, file.display());
        }
    }
}

fn processor_time() -> Duration {
    Duration::from(ClockId::CLOCK_THREAD_CPUTIME_ID.now().unwrap())
}

fn begin() {
    let statm = std::fs::read_to_string("/proc/self/statm").unwrap();
    let pages: u64 = statm.split_whitespace().next().unwrap().parse().unwrap();
    // Every thread that begins later reserves room of its own: 64 MiB each for the allocator, beside its stack.
    let threads = 72 * (1 << 20) * 64;
    let (_, most) = getrlimit(Resource::RLIMIT_AS).unwrap();
    setrlimit(Resource::RLIMIT_AS, (pages * 4096 + threads + MOST_MEMORY).min(most), most).unwrap();
    thread::spawn(|| {
        loop {
            thread::sleep(Duration::from_secs(1));
            let reading = READING.lock().unwrap();
            if let Some((target, (_, bytes))) = reading.iter().find(|(_, (since, _))| since.elapsed() > HANGS)
            {
                eprintln!("{target} hangs with {:?}", String::from_utf8_lossy(bytes));
                std::process::abort();
            }
        }
    });
}
