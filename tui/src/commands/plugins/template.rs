//! The files of a plugin's project, made from the templates beside the program's source.

use std::path::Path;

/// What a plugin is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Language {
    Rust,
    C,
    Python,
}

/// A project to be made.
pub(super) struct Project<'a> {
    /// As cell files name the plugin.
    pub(super) name: &'a str,
    pub(super) is_robot: bool,
    pub(super) language: Language,
    /// The folder of the crate `plumb-plugin`, where the source is there.
    pub(super) source: Option<&'a Path>,
}

macro_rules! template {
    ($file:literal) => {
        include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/templates/plugin/", $file))
    };
}

/// The contract in C.
const HEADER: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../core/abi/include/plumb_plugin.h"));

/// What reads a cell's settings in C.
const CONFIG: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../core/abi/include/plumb_config.h"));

impl Project<'_> {
    /// What to type in the project's folder, from its source to a run.
    pub(super) fn commands(&self) -> Vec<String> {
        let build: &[&str] = match self.language {
            Language::Rust => &["cargo build", "cargo test"],
            Language::C => &["make"],
            Language::Python => &[],
        };
        let check = if self.is_robot { "plumb plugins check . --move" } else { "plumb plugins check ." };
        let run = [check, "plumb check cell.yaml", "plumb run cell.yaml --headless"];
        build.iter().chain(&run).map(|line| (*line).to_owned()).collect()
    }

    /// A name that Rust and C take.
    fn identifier(&self) -> String {
        self.name.replace('-', "_")
    }

    fn filled(&self, template: &str) -> String {
        let identifier = self.identifier();
        let words = self.name.split('-').map(|word| {
            let (first, rest) = word.split_at_checked(1).unwrap_or((word, ""));
            format!("{}{rest}", first.to_uppercase())
        });
        let kind = if self.is_robot { "robot" } else { "sensor" };
        let dependency = match self.source {
            Some(path) => format!("{{ path = {:?} }}", path.display().to_string()),
            None => format!("{:?}", env!("CARGO_PKG_VERSION")),
        };
        let code = match self.language {
            Language::Python => "driver: [python3, driver.py]".to_owned(),
            Language::Rust | Language::C => format!("library: lib{identifier}.so"),
        };
        let before = match self.language {
            Language::Python => "it starts the driver.",
            Language::Rust | Language::C => {
                "it loads anything. After a change build the library again: the same text is built into it."
            }
        };
        // With its joints or quantities named here `plumb check` finds a procedure that misspells one, or goes beyond.
        let streams = match self.is_robot {
            true => {
                "streams:\n  - {name: joints, message: joint-state/1}\njoints:\n  - {name: waist, from_deg: -90, to_deg: 90}\n  - {name: slide, from_mm: 0, to_mm: 200}\n"
            }
            false => "quantities:\n  - {name: height, unit: mm}\n",
        };
        let build: String = self.commands().iter().map(|line| format!("$ {line}\n")).collect();
        [
            ("{name}", self.name),
            ("{crate}", identifier.as_str()),
            ("{Type}", &(words.collect::<String>() + "Driver")),
            ("{kind}", kind),
            ("{Kind}", if self.is_robot { "Robot" } else { "Sensor" }),
            ("{dependency}", &dependency),
            ("{library}", &format!("lib{identifier}.so")),
            ("{before}", before),
            ("{code}", &code),
            ("{streams}", streams),
            ("{commands}", build.trim_end()),
            ("{where}", self.where_to_begin()),
        ]
        .iter()
        .fold(template.to_owned(), |text, (mark, value)| text.replace(mark, value))
    }

    fn where_to_begin(&self) -> &'static str {
        match self.language {
            Language::Rust => {
                "What talks to your device goes into `src/lib.rs`; what a cell may configure into `plugin.yaml`."
            }
            Language::C => {
                "What talks to your device goes into the C file; what a cell may configure into `plugin.yaml`, and is read by `plumb_config.h`. The contract is `plumb_plugin.h`."
            }
            Language::Python => {
                "What talks to your device goes into `driver.py`; what a cell may configure into `plugin.yaml`. `plumb_driver.py` is what it is written \
                 against, in the standard library alone."
            }
        }
    }
}

/// The files of a project, by their paths in it.
pub(super) fn files(project: &Project<'_>) -> Vec<(String, String)> {
    let robot = project.is_robot;
    let mut files = vec![
        ("plugin.yaml", template!("manifest.yaml")),
        ("README.md", template!("README.md")),
        ("cell.yaml", if robot { template!("robot.cell.yaml") } else { template!("sensor.cell.yaml") }),
        (
            "procedure.yaml",
            if robot { template!("robot.procedure.yaml") } else { template!("sensor.procedure.yaml") },
        ),
    ];
    let source = format!("{}.c", project.identifier());
    files.extend(match project.language {
        Language::Rust => vec![
            ("Cargo.toml", template!("rust/Cargo.toml")),
            ("src/lib.rs", if robot { template!("rust/robot.rs") } else { template!("rust/sensor.rs") }),
            ("tests/conformance.rs", template!("rust/conformance.rs")),
            (".gitignore", "/target\n"),
        ],
        Language::C => vec![
            ("Makefile", template!("c/Makefile")),
            (source.as_str(), if robot { template!("c/robot.c") } else { template!("c/sensor.c") }),
            (".gitignore", "*.so\nmanifest.h\n"),
        ],
        Language::Python => vec![
            ("driver.py", if robot { template!("python/robot.py") } else { template!("python/sensor.py") }),
            (".gitignore", "__pycache__/\n"),
        ],
    });
    let mut made: Vec<(String, String)> =
        files.into_iter().map(|(path, text)| (path.to_owned(), project.filled(text))).collect();
    match project.language {
        Language::Rust => {}
        Language::C => {
            let headers = [("plumb_plugin.h", HEADER), ("plumb_config.h", CONFIG)];
            made.extend(headers.map(|(name, text)| (name.to_owned(), text.to_owned())));
        }
        Language::Python => {
            let driver =
                include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../plugins/bridge/plumb_driver.py"));
            made.push(("plumb_driver.py".to_owned(), driver.to_owned()));
        }
    }
    made
}
