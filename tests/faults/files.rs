//! Files that are none, and files without end, for every reader of files from outside.

use std::fs::{self, File};
use std::io::Write as _;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use nix::sys::resource::{UsageWho, getrusage};
use nix::sys::time::TimeValLike as _;

use crate::lab::Lab;
use crate::{Happened, Row};

pub(crate) const ROWS: &[&Row] = &[
    &Row {
        name: "files_that_are_none",
        done: "/dev/zero, /proc/kmsg, a named pipe, a folder and a line of 100 MB given to every reader of files",
        promise: "refused with words that name the file, within 2 s of processor time and 500 MB",
        happens: files_that_are_none,
    },
    &Row {
        name: "files_that_explode",
        done: "aliases of aliases, brackets without end, a million columns, procedures that unroll to 10^12 steps, calls of calls",
        promise: "refused with words, within 2 s of processor time and 500 MB",
        happens: files_that_explode,
    },
    &Row {
        name: "export_to_a_device",
        done: "`plumb stripe export` into /dev/full, by its name and through a link",
        promise: "ends with 2 and says why",
        happens: export_to_a_device,
    },
];

/// What is asked of the program with a file: the ending the file has, and the arguments with `{}` where it is.
const READERS: &[(&str, &[&str])] = &[
    ("yaml", &["check", "{}"]),
    ("yaml", &["run", "{}", "--headless"]),
    ("yaml", &["run", "cell.yaml", "--headless", "--answers", "{}"]),
    ("yaml", &["run", "named.yaml", "--headless"]),
    ("yaml", &["check", "named.yaml"]),
    ("yaml", &["world", "--file", "{}", "--socket", "socket"]),
    ("yaml", &["model", "compare", "{}", "--data", "table.csv"]),
    ("csv", &["model", "compare", "teachmover.model.yaml", "--data", "{}"]),
    ("csv", &["check", "over.yaml"]),
    ("urdf", &["model", "compare", "described.yaml", "--data", "table.csv"]),
    ("urdf", &["model", "template", "{}"]),
    ("ply", &["stripe", "export", "{}", "out.ply"]),
    ("pcd", &["stripe", "export", "{}", "out.ply"]),
    ("e57", &["stripe", "export", "{}", "out.ply"]),
    ("jsonl", &["watch", "{}"]),
    ("yaml", &["plugins", "verify", "{}"]),
    ("yaml", &["study", "design", "{}"]),
];

const MOST_TIME: Duration = Duration::from_secs(2);
const MOST_KILOBYTES: i64 = 500_000;

/// What a command cost, and what it said.
struct Cost {
    code: i32,
    printed: String,
    time: Duration,
    kilobytes: i64,
}

/// The arguments by which this program is asked to run another and print what it took.
const MEASURE: &str = "--measure";

/// Where this program was started to measure another: runs it, and prints processor time (ms) and memory (kB) as its last line.
pub(crate) fn measured() -> Option<i32> {
    let arguments: Vec<String> = std::env::args().collect();
    if arguments.get(1).map(String::as_str) != Some(MEASURE) {
        return None;
    }
    let status = Command::new(&arguments[2]).args(&arguments[3..]).stdin(Stdio::null()).status().unwrap();
    let usage = getrusage(UsageWho::RUSAGE_CHILDREN).unwrap();
    let time = usage.user_time().num_milliseconds() + usage.system_time().num_milliseconds();
    println!("\n{time} {}", usage.max_rss());
    Some(status.code().unwrap_or(-1))
}

fn cost_of(lab: &Lab, arguments: &[&str]) -> Cost {
    let command = lab.command(arguments);
    let variables: Vec<_> =
        command.get_envs().filter_map(|(name, value)| Some((name.to_owned(), value?.to_owned()))).collect();
    let mut measuring = Command::new(std::env::current_exe().unwrap());
    measuring.arg(MEASURE).arg(command.get_program()).args(command.get_args()).envs(variables);
    let begin = Instant::now();
    let output = measuring.current_dir(lab.path(".")).stdin(Stdio::null()).output().unwrap();
    assert!(begin.elapsed() < Duration::from_secs(60), "{arguments:?} hangs");
    let out = String::from_utf8_lossy(&output.stdout).into_owned();
    let last = out.trim_end().lines().last().unwrap_or_default().to_owned();
    let (time, kilobytes) = last.split_once(' ').unwrap_or_else(|| panic!("{out}"));
    Cost {
        code: output.status.code().unwrap_or(-1),
        printed: format!(
            "{}{}",
            String::from_utf8_lossy(&output.stderr),
            out.trim_end().trim_end_matches(&last)
        ),
        time: Duration::from_millis(time.parse().unwrap()),
        kilobytes: kilobytes.parse().unwrap(),
    }
}

/// The most that any of several commands took.
#[derive(Default)]
struct Most {
    count: usize,
    time: Duration,
    kilobytes: i64,
}

impl Most {
    fn take(&mut self, what: &str, cost: &Cost) {
        assert!(cost.code > 0 && cost.code != 101, "{what}: ended with {}: {}", cost.code, cost.printed);
        assert!(cost.time < MOST_TIME, "{what} took {:?}", cost.time);
        assert!(cost.kilobytes < MOST_KILOBYTES, "{what} took {} kB", cost.kilobytes);
        assert!(cost.printed.len() < 6000, "{what} said {} bytes", cost.printed.len());
        self.count += 1;
        self.time = self.time.max(cost.time);
        self.kilobytes = self.kilobytes.max(cost.kilobytes);
    }

    fn kept(self) -> Happened {
        let Self { count, time, kilobytes } = self;
        Happened::Kept(format!(
            "{count} refused; at most {:.2} s and {} MB",
            time.as_secs_f64(),
            kilobytes / 1000
        ))
    }
}

/// A lab whose other files name the bad one, each where it is the only way to it.
fn lab_that_names(bad: &str) -> Lab {
    let lab = Lab::new();
    lab.write("table.csv", "q1_deg,p1_x_mm,p1_y_mm,p1_z_mm\n1,2,3,4\n");
    let cell = fs::read_to_string(lab.path("cell.yaml")).unwrap();
    lab.write("named.yaml", &cell.replace("procedures: [", &format!("procedures: [{bad}, ")));
    lab.write(
        "over.yaml",
        &format!(
            "procedure: over\nsteps:\n  - {{id: a, do: {{repeat: {{over: {bad}, steps: [{{id: b, do: {{compute: {{values: {{x: 1}}}}}}}}]}}}}}}\n"
        ),
    );
    lab.write("described.yaml", &format!("arm: a\nconvention: urdf\nurdf: {bad}\n"));
    lab
}

fn files_that_are_none() -> Happened {
    let folder = tempfile::tempdir().unwrap();
    let long = folder.path().join("long");
    let mut file = File::create(&long).unwrap();
    (0..100).for_each(|_| file.write_all(&[b'a'; 1_000_000]).unwrap());
    let pipe = folder.path().join("pipe");
    nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
    let mut most = Most::default();
    for target in [Path::new("/dev/zero"), Path::new("/proc/kmsg"), &pipe, folder.path(), &long] {
        for (ending, arguments) in READERS {
            let bad = format!("bad.{ending}");
            let lab = lab_that_names(&bad);
            symlink(target, lab.path(&bad)).unwrap();
            let arguments: Vec<&str> =
                arguments.iter().map(|word| if *word == "{}" { bad.as_str() } else { word }).collect();
            // Lines of events may be many; the terminal that `watch` wants is not here to show them.
            if arguments[0] == "watch" && target == long {
                continue;
            }
            let what = format!("`plumb {}` with {}", arguments.join(" "), target.display());
            let cost = cost_of(&lab, &arguments);
            assert!(cost.printed.contains(&bad), "{what} does not name the file: {}", cost.printed);
            most.take(&what, &cost);
        }
    }
    most.kept()
}

fn files_that_explode() -> Happened {
    let lab = Lab::new();
    let mut most = Most::default();
    let laughs: String = (1..12)
        .map(|level| format!("a{level}: &a{level} [{}]\n", format!("*a{}, ", level - 1).repeat(9)))
        .collect();
    let laughs = format!("a0: &a0 [x, x, x, x, x, x, x, x, x]\n{laughs}");
    let brackets = "[".repeat(200_000);
    for (name, text) in
        [("laughs.yaml", format!("{laughs}cell: *a11\n")), ("deep.yaml", format!("cell: {brackets}"))]
    {
        lab.write(name, &text);
        for (ending, arguments) in READERS.iter().filter(|(ending, _)| *ending == "yaml") {
            let _ = ending;
            if !arguments.contains(&"{}") {
                continue;
            }
            let arguments: Vec<&str> =
                arguments.iter().map(|word| if *word == "{}" { name } else { word }).collect();
            lab.write("table.csv", "q1_deg,p1_x_mm,p1_y_mm,p1_z_mm\n1,2,3,4\n");
            most.take(&format!("`plumb {}`", arguments.join(" ")), &cost_of(&lab, &arguments));
        }
    }

    let names: Vec<String> = (0..1_000_000).map(|column| format!("c{column}")).collect();
    lab.write(
        "wide.csv",
        &format!("q1_deg,p1_x_mm,p1_y_mm,p1_z_mm,{}\n1,2,3,4{}\n", names.join(","), ",1".repeat(1_000_000)),
    );
    most.take(
        "a million columns",
        &cost_of(&lab, &["model", "compare", "teachmover.model.yaml", "--data", "wide.csv"]),
    );

    let leaf = "{id: leaf, do: {compute: {values: {x: 1}}}}";
    let turns = (0..3).fold(leaf.to_owned(), |inside, level| {
        format!("{{id: r{level}, do: {{repeat: {{times: 10000, steps: [{inside}]}}}}}}")
    });
    lab.write("turns.yaml", &format!("procedure: turns\nsteps:\n  - {turns}\n"));
    let cost = cost_of(&lab, &["check", "turns.yaml"]);
    assert!(cost.printed.contains("unrolls to 3000400040002 steps"), "{}", cost.printed);
    most.take("10^12 turns", &cost);

    // Eight levels of ten calls each.
    for level in 0..8 {
        let call = |index: usize| {
            format!("  - {{id: s{index}, do: {{call: {{procedure: p{}.yaml}}}}}}\n", level + 1)
        };
        let steps: String = if level < 7 { (0..10).map(call).collect() } else { format!("  - {leaf}\n") };
        lab.write(&format!("procedures/p{level}.yaml"), &format!("procedure: p{level}\nsteps:\n{steps}"));
    }
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/p0.yaml, ");
    let cost = cost_of(&lab, &["check", "cell.yaml"]);
    assert!(cost.printed.contains("unrolls to"), "{}", cost.printed);
    most.take("calls of calls", &cost);
    most.kept()
}

fn export_to_a_device() -> Happened {
    let lab = Lab::new();
    lab.write("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n");
    let fine = lab.plumb(&["stripe", "export", "a.ply", "b.ply"]);
    assert_eq!(fine.code(), 0, "{}", fine.all());
    let full = lab.plumb(&["stripe", "export", "a.ply", "/dev/full"]);
    assert_eq!(full.code(), 2, "{}", full.all());
    assert!(!Path::new("/dev/full.ply").exists());
    symlink("/dev/full", lab.path("full.ply")).unwrap();
    let behind = lab.plumb(&["stripe", "export", "a.ply", "full.ply"]);
    assert_eq!(behind.code(), 2, "{}", behind.all());
    Happened::Kept(crate::line_with(&full.all(), "/dev/full"))
}
