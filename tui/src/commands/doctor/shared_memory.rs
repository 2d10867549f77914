//! Shared memory: is it there, may it be written, is there enough.

use std::fs;
use std::path::Path;

use super::finding::{Finding, size, space_at};

const TOPIC: &str = "shared memory";

/// Where POSIX shared memory lies.
const DIRECTORY: &str = "/dev/shm";

/// Less than this is too little: a cell of two devices takes about 5 MB, one with a camera 60 MB.
const ENOUGH: u64 = 64_000_000;

pub(super) fn look() -> Vec<Finding> {
    let directory = Path::new(DIRECTORY);
    let mount =
        "mount it: sudo mount -t tmpfs -o size=1G,mode=1777 tmpfs /dev/shm (in a container: --shm-size=1g)";
    if !directory.is_dir() {
        return vec![Finding::wrong(TOPIC, format!("there is no {DIRECTORY}"), mount)];
    }
    let probe = directory.join(format!("plumb-doctor-{}", std::process::id()));
    let written = fs::write(&probe, b"a try");
    let _removed = fs::remove_file(&probe);
    if let Err(error) = written {
        let text = format!("{DIRECTORY} cannot be written: {error}");
        return vec![Finding::wrong(TOPIC, text, "give it back its rights: sudo chmod 1777 /dev/shm")];
    }
    vec![match space_at(directory) {
        Err(error) => Finding::note(TOPIC, format!("{DIRECTORY}: its size is not known: {error}")),
        Ok((free, all)) if free < ENOUGH => {
            let text = format!("{DIRECTORY}: {} free of {}", size(free), size(all));
            let more = "plumb doctor --clean removes what dead runs left; `ls -lS /dev/shm` shows what else is there; \
                        sudo mount -o remount,size=1G /dev/shm makes it larger";
            Finding::wrong(TOPIC, text, more)
        }
        Ok((free, all)) => Finding::good(TOPIC, format!("{DIRECTORY}: {} free of {}", size(free), size(all))),
    }]
}
