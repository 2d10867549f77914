//! What a plugin says about itself before it is loaded: the file `plugin.yaml`.

use std::fmt;
use std::path::Path;
use std::time::Duration;

use plumb_document::{
    DocumentKind, FileKind, FileProblems, Node, NodeValue, Problems, parse_as, read_document, schema_of,
    typed, with_words,
};
use serde::{Deserialize, Serialize};

mod config_schema;
mod joint;

use config_schema::check_config_schema;
pub use joint::ManifestJoint;
use joint::check_joints;

use crate::message::Layout;
use crate::{InputDescription, QuantityDescription, StreamDescription, Value};

/// What a plugin says about itself before it is loaded: the file `plugin.yaml` beside its library, also built into the library.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Its name in cell files, such as `ir-proximity`: lower-case letters, digits and hyphens.
    pub id: String,
    /// What it drives, in a sentence.
    pub title: String,
    /// Its own version.
    pub version: String,
    /// The version of the C contract it was built for.
    pub contract: ContractVersion,
    /// Whether it is a robot or a sensor.
    pub kind: DeviceKind,
    /// The file name of its library, such as `libplumb_ir_proximity.so`, in the same directory. That of the bridge where there is a `driver`.
    #[serde(default)]
    pub library: String,
    /// The command that runs a driver of another language, such as `[python3, driver.py]`, in the same directory: in place of `library`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub driver: Vec<String>,
    /// The streams it emits.
    #[serde(default)]
    pub streams: Vec<StreamDescription>,
    /// The inputs a cell file wires to other devices' streams.
    #[serde(default)]
    pub inputs: Vec<InputDescription>,
    /// How long one reading of a sensor may take, s: for an instrument that averages or a balance that settles. 5 when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub read_time_limit_s: Option<f64>,
    /// The values a sensor's readings carry, so that what a procedure names of them is checked before anything is started. Left out, they are
    /// known only from its description.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quantities: Option<Vec<QuantityDescription>>,
    /// How many digital input lines the device has, as bits from 0, so that what is wired to one is checked before anything is started. Left
    /// out, they are known only from its description.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input_lines: Option<u32>,
    /// How far a robot's joints go, so that a position beyond is found before anything is started. Left out, that is known only from its description.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints: Option<Vec<ManifestJoint>>,
    /// How fast a robot is, for the time of a run that is only planned. Left out, a slow arm is assumed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub typical: Option<TypicalPace>,
    /// A JSON Schema of what a cell file may give under `config:`; null when it takes none.
    #[serde(default)]
    pub config: Value,
}

/// How fast a robot is with the settings it has when a cell gives none. Runs go by what the robot says of itself; plans are made before it is asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TypicalPace {
    /// Full speed of a joint that turns, deg/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deg_per_s: Option<f64>,
    /// Full speed of a joint that slides, mm/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mm_per_s: Option<f64>,
    /// How long a move takes beside the motion itself: to be sent to the robot, and to be known to have ended, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command_s: Option<f64>,
}

/// Levels of input lines travel as the bits of one 64-bit word.
const MOST_INPUT_LINES: u32 = 64;

/// The longest a reading may take, s.
const LONGEST_READING_S: f64 = 3600.0;

/// What a plugin drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DeviceKind {
    /// Something that moves.
    Robot,
    /// Something that measures.
    Sensor,
}

impl fmt::Display for DeviceKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Robot => "robot",
            Self::Sensor => "sensor",
        })
    }
}

/// A version of the C contract, written `[1, 0]`: a plugin of major 1 is loaded by every host of major 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ContractVersion(
    /// Changes when something is taken away or altered.
    pub u32,
    /// Changes when something is added.
    pub u32,
);

impl ContractVersion {
    /// The version this program speaks.
    pub const CURRENT: Self = Self(plumb_abi::CONTRACT_MAJOR, plumb_abi::CONTRACT_MINOR);

    /// Whether this program can load a plugin of that version.
    pub fn is_supported(self) -> bool {
        self.0 == Self::CURRENT.0
    }
}

impl fmt::Display for ContractVersion {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(&format!("{}.{}", self.0, self.1))
    }
}

/// What editors show beside a key.
const WORDS: &[(&str, &str)] = &[
    ("id", "Its name in cell files, such as ir-proximity."),
    ("title", "What it drives, in a sentence."),
    ("version", "Its own version."),
    ("contract", "The version of the C contract it was built for, as [1, 0]."),
    ("kind", "Whether it moves or measures."),
    ("library", "The file name of the library beside the manifest; a driver has none."),
    ("driver", "The command that runs a driver in another language, as [python3, driver.py]."),
    ("streams", "What it emits."),
    ("streams.max_bytes", "The longest message, where the layout has no fixed length."),
    ("streams.depth", "How many messages wait for a slow receiver."),
    (
        "streams.fields",
        "The numbers of a layout of the plugin's own, behind time_ns and sequence: procedures, `plumb streams` and Python know them by name then.",
    ),
    ("streams.fields.name", "Its name, such as weight."),
    ("streams.fields.unit", "Its unit, such as g; left out for a number without."),
    ("inputs", "What a cell file wires to other devices' streams."),
    ("read_time_limit_s", "How long one reading of a sensor may take; 5 when left out."),
    (
        "quantities",
        "The values a sensor's readings carry: what procedures name of them is then checked before anything is started.",
    ),
    ("input_lines", "How many digital input lines the device has, as bits from 0."),
    (
        "joints",
        "How far each joint of a robot goes: a place beyond is then found before anything is started.",
    ),
    ("joints.name", "As the robot describes it."),
    ("joints.from_deg", "The lowest a joint that turns may go."),
    ("joints.to_deg", "The highest a joint that turns may go."),
    ("joints.from_mm", "The lowest a joint that slides may go."),
    ("joints.to_mm", "The highest a joint that slides may go."),
    (
        "typical",
        "How fast a robot is with the settings it has when a cell gives none: for the time of a run that is only planned.",
    ),
    ("typical.deg_per_s", "Full speed of a joint that turns."),
    ("typical.mm_per_s", "Full speed of a joint that slides."),
    (
        "typical.command_s",
        "How long a move takes beside the motion itself: to be sent to the robot, and to be known to have ended.",
    ),
    (
        "config",
        "A JSON Schema of what a cell file may give under `config`. `needs_input: INPUT` marks a setting of no use without that input, `input_line_of: INPUT` the number of an input line of the device that is wired there, `is_full_speed: deg_per_s` the full speed of a robot's joints, `are_joints: true` the list of its joints, each with `name`, `from_deg` and `to_deg`.",
    ),
];

/// Why a manifest cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ManifestError {
    /// It cannot be read, or holds mistakes: all of them.
    #[error(transparent)]
    Form(#[from] FileProblems),
    /// The plugin was built for another contract.
    #[error("{origin}: plugin '{id}' was built for contract {built_for}; this program speaks {}: rebuild the plugin against contract {}.x", ContractVersion::CURRENT, ContractVersion::CURRENT.0)]
    Contract {
        /// Where the text came from.
        origin: String,
        /// The plugin.
        id: String,
        /// The version it was built for.
        built_for: ContractVersion,
    },
}

impl Manifest {
    /// The name of the file beside a library.
    pub const FILE_NAME: &'static str = "plugin.yaml";

    /// The library that runs drivers of other languages.
    pub const BRIDGE_LIBRARY: &'static str = "libplumb_bridge.so";

    /// The name in the manifest that is built into the bridge.
    pub const BRIDGE_ID: &'static str = "bridge";

    /// How long one reading of the sensor may take.
    pub fn read_time_limit(&self) -> Duration {
        self.read_time_limit_s.map_or(crate::conformance::CALL_WITHIN, Duration::from_secs_f64)
    }

    /// The JSON Schema of manifests, for editors.
    pub fn schema() -> Value {
        with_words(schema_of::<Self>(), "A plugin's manifest", WORDS)
    }

    /// Reads a manifest file.
    ///
    /// # Errors
    /// [`ManifestError`], naming the file and every position.
    pub fn read(path: &Path) -> Result<Self, ManifestError> {
        let text = read_document(path, FileKind::MANIFEST)?;
        Self::parse(&text, &path.display().to_string())
    }

    /// Reads a manifest from its text; `origin` is named in errors.
    ///
    /// # Errors
    /// [`ManifestError`], naming the origin and every position.
    pub fn parse(text: &str, origin: &str) -> Result<Self, ManifestError> {
        let (file, problems) = (Path::new(origin), Problems::default());
        let root = parse_as(DocumentKind::Manifest, file, text, &problems)?;
        // The version first: a manifest of another contract may hold what this one does not know.
        if let Some((id, built_for)) = built_for(&root).filter(|(_, version)| !version.is_supported()) {
            return Err(ManifestError::Contract { origin: origin.to_owned(), id, built_for });
        }
        let manifest: Option<Self> = typed(&root, "a manifest", &problems);
        if let Some(manifest) = &manifest {
            manifest.check(&root, &problems);
        }
        problems.into_result(file, text)?;
        let mut manifest =
            manifest.ok_or_else(|| FileProblems::whole_file(file, "this is no manifest", ""))?;
        if !manifest.driver.is_empty() {
            manifest.library = Self::BRIDGE_LIBRARY.to_owned();
        }
        Ok(manifest)
    }

    /// Values that could not be read are empty or NaN, and not looked at.
    fn check(&self, root: &Node, problems: &Problems) {
        if !self.id.is_empty() && !is_plain(&self.id) {
            let message = format!("`id` is `{}`", self.id);
            problems.add(root.span_at(&["id"]), message, "use lower-case letters, digits and hyphens");
        }
        if self.library.contains(['/', '\\']) {
            let message = format!("`library` is `{}`", self.library);
            let help = "give the file name alone; the library lies beside its manifest";
            problems.add(root.span_at(&["library"]), message, help);
        }
        self.check_code(root, problems);
        self.check_time_limit(root, problems);
        self.check_lists(root, problems);
        self.check_typical(root, problems);
        root.get("config").into_iter().for_each(|schema| check_config_schema(schema, problems));
        let streams = root.get("streams").map(Node::items).unwrap_or_default();
        for (stream, node) in self.streams.iter().zip(streams) {
            check_stream(stream, node, problems);
        }
        let inputs = root.get("inputs").map(Node::items).unwrap_or_default();
        for (input, node) in self.inputs.iter().zip(inputs) {
            if !input.name.is_empty() && !is_plain(&input.name) {
                let message = format!("an input is called `{}`", input.name);
                let help = "use lower-case letters, digits and hyphens";
                problems.add(node.span_at(&["name"]), message, help);
            }
        }
    }

    /// Either a library or a driver. One that was given and could not be read has been reported.
    fn check_code(&self, root: &Node, problems: &Problems) {
        let (library, driver) = (root.get("library"), root.get("driver"));
        if library.is_none() && driver.is_none() {
            problems.add(root.span, "a manifest needs the key `library`, or `driver`", "");
        } else if library.is_some() && driver.is_some() {
            let message = "a manifest has `library` or `driver`, not both";
            problems.add(root.span_at(&["driver"]), message, "a driver runs in a library of plumb's own");
        } else if driver.is_some_and(|node| matches!(node.value, NodeValue::List(_)))
            && self.driver.is_empty()
        {
            let help = "give the command that runs it, as in [python3, driver.py]";
            problems.add(root.span_at(&["driver"]), "`driver` is empty", help);
        }
    }

    /// Whether it is of this kind; a kind that could not be read may be any, and has been reported.
    fn may_be(&self, kind: DeviceKind, root: &Node) -> bool {
        let written = root.get("kind").map(|node| &node.value);
        let is_known = |known: DeviceKind| written == Some(&NodeValue::Text(known.to_string()));
        self.kind == kind || ![DeviceKind::Robot, DeviceKind::Sensor].into_iter().any(is_known)
    }

    /// What is listed of readings and lines.
    fn check_lists(&self, root: &Node, problems: &Problems) {
        if self.quantities.is_some() && !self.may_be(DeviceKind::Sensor, root) {
            let help = "only a sensor's readings carry quantities: take it away";
            problems.add(root.span_at(&["quantities"]), "a robot lists `quantities`", help);
        }
        let listed = self.quantities.as_deref().unwrap_or_default();
        let nodes = root.get("quantities").map(Node::items).unwrap_or_default();
        for (index, (quantity, node)) in listed.iter().zip(nodes).enumerate() {
            let name = &quantity.name;
            let is_word = name.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_');
            let is_repeated = listed.iter().take(index).any(|before| before.name == *name);
            if !name.is_empty() && (!is_word || is_repeated) {
                let message = format!("a quantity is called `{name}`");
                let help = "use letters, digits and `_`, and each name once: expressions name it so";
                problems.add(node.span_at(&["name"]), message, help);
            }
        }
        if self.joints.is_some() && !self.may_be(DeviceKind::Robot, root) {
            let help = "only a robot has joints: take it away";
            problems.add(root.span_at(&["joints"]), "a sensor lists `joints`", help);
        }
        let joints = root.get("joints").map(Node::items).unwrap_or_default();
        check_joints(self.joints.as_deref().unwrap_or_default(), joints, problems);
        if let Some(lines) = self.input_lines.filter(|lines| *lines > MOST_INPUT_LINES) {
            let help = format!("give at most {MOST_INPUT_LINES}");
            problems.add(root.span_at(&["input_lines"]), format!("`input_lines` is {lines}"), help);
        }
    }

    fn check_typical(&self, root: &Node, problems: &Problems) {
        let Some(typical) = self.typical else { return };
        if !self.may_be(DeviceKind::Robot, root) {
            problems.add(root.span_at(&["typical"]), "a sensor has no `typical` pace", "take it away");
            return;
        }
        let TypicalPace { deg_per_s, mm_per_s, command_s } = typical;
        for (key, number) in [("deg_per_s", deg_per_s), ("mm_per_s", mm_per_s), ("command_s", command_s)] {
            // What is no number at all has been reported already, and counts as one that is not a number.
            let wrong = number.filter(|number| *number <= 0.0 || number.is_infinite());
            if let Some(number) = wrong {
                let span = root.span_at(&["typical", key]);
                problems.add(span, format!("`{key}` is {number}"), "give a number above 0");
            }
        }
    }

    fn check_time_limit(&self, root: &Node, problems: &Problems) {
        let Some(limit) = self.read_time_limit_s.filter(|limit| !limit.is_nan()) else { return };
        if !self.may_be(DeviceKind::Sensor, root) || limit <= 0.0 || limit > LONGEST_READING_S {
            problems.add(
                root.span_at(&["read_time_limit_s"]),
                format!("`read_time_limit_s` is {limit}"),
                format!(
                    "give a sensor more than 0 and at most {LONGEST_READING_S} s; a robot has no readings"
                ),
            );
        }
    }
}

/// The name of a plugin and the contract it was built for, as far as they can be read.
fn built_for(root: &Node) -> Option<(String, ContractVersion)> {
    let NodeValue::Text(id) = &root.get("id")?.value else { return None };
    let [NodeValue::Number(major), NodeValue::Number(minor)] =
        root.get("contract")?.items().iter().map(|node| node.value.clone()).collect::<Vec<_>>()[..]
    else {
        return None;
    };
    let whole =
        |number: f64| (number.fract() == 0.0 && (0.0..1e9).contains(&number)).then_some(number as u32);
    Some((id.clone(), ContractVersion(whole(major)?, whole(minor)?)))
}

fn is_plain(name: &str) -> bool {
    !name.is_empty()
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_')
}

fn check_stream(stream: &StreamDescription, node: &Node, problems: &Problems) {
    if !stream.name.is_empty() && (!is_plain(&stream.name) || stream.name == "health") {
        problems.add(
            node.span_at(&["name"]),
            format!("a stream is called `{}`", stream.name),
            "use lower-case letters, and not the host's own `health`",
        );
    }
    check_fields(stream, node, problems);
    let length = Layout::of(stream).and_then(|layout| layout.length());
    let unknown = !stream.message.is_empty() && length.is_none();
    if unknown
        && node.get("fields").is_none()
        && stream.max_bytes.is_none()
        && node.get("max_bytes").is_none()
    {
        problems.add(
            node.span_at(&["message"]),
            format!("a stream's message is `{}`", stream.message),
            "give `max_bytes` for a layout without a fixed length, or list its numbers under `fields`",
        );
    }
}

/// What a manifest says of a layout of the plugin's own.
fn check_fields(stream: &StreamDescription, node: &Node, problems: &Problems) {
    let Some(listed) = node.get("fields") else { return };
    if Layout::known(&stream.message).is_some() {
        let message = format!("the fields of `{}` are known", stream.message);
        problems.add(listed.span, message, "leave `fields` out, or give a layout of your own another name");
    } else if stream.max_bytes.is_some() {
        let help = "leave `max_bytes` out: the fields say how long a message is";
        problems.add(node.span_at(&["max_bytes"]), "a stream has `fields` or `max_bytes`, not both", help);
    }
    let mut before: Vec<&str> = vec!["time_ns", "sequence", "reserved", "joints"];
    for (field, node) in stream.fields.iter().zip(listed.items()) {
        if field.name.is_empty() {
            continue;
        }
        let span = node.span_at(&["name"]);
        let is_word = !field.name.contains('-') && !field.name.starts_with(|c: char| c.is_ascii_digit());
        if !is_plain(&field.name) || !is_word {
            let help = "use lower-case letters, digits and `_`, beginning with a letter";
            problems.add(span, format!("a field is called `{}`", field.name), help);
        } else if before.contains(&field.name.as_str()) {
            problems.add(
                span,
                format!("a field is called `{}`, as another", field.name),
                "choose another name",
            );
        }
        before.push(&field.name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "
id: ir-proximity
title: An infrared proximity sensor on a digital line
version: 0.1.0
contract: [1, 0]
kind: sensor
library: libplumb_ir_proximity.so
streams:
  - {name: edges, message: proximity-edge/1}
inputs:
  - {name: line, message: digital-inputs/1}
config:
  type: object
  properties:
    bit: {type: integer, minimum: 0, maximum: 63}
";

    #[test]
    fn a_manifest_is_read_with_its_schema() {
        let manifest = Manifest::parse(GOOD, "plugin.yaml").unwrap();
        assert_eq!(manifest.id, "ir-proximity");
        assert_eq!(manifest.contract, ContractVersion(1, 0));
        assert_eq!(manifest.kind, DeviceKind::Sensor);
        assert_eq!(manifest.config["properties"]["bit"]["maximum"], 63);
    }

    #[test]
    fn an_unknown_key_is_named_with_its_position() {
        let text = GOOD.replace("title:", "tittle:");
        let message = Manifest::parse(&text, "plugin.yaml").unwrap_err().to_string();
        assert_eq!(
            message,
            "plugin.yaml:3:1: unknown key `tittle` in a manifest\n    3 | tittle: An infrared proximity sensor on a digital line\n      | ^^^^^^\n  = did you mean `title`?\n"
        );
    }

    #[test]
    fn a_manifest_of_another_contract_names_both_versions_whatever_else_it_holds() {
        let text = GOOD.replace("[1, 0]", "[2, 3]").replace("title:", "headline:");
        let message = Manifest::parse(&text, "plugin.yaml").unwrap_err().to_string();
        assert_eq!(
            message,
            format!(
                "plugin.yaml: plugin 'ir-proximity' was built for contract 2.3; this program speaks {}: \
                 rebuild the plugin against contract 1.x",
                ContractVersion::CURRENT
            )
        );
    }

    #[test]
    fn mistakes_are_reported_once_and_in_words_of_the_file() {
        for (text, expected) in [
            (GOOD.replace("version: 0.1.0", "version: 0.1.0\nid: again"), "the key `id` "),
            (format!("{GOOD}---\nid: second\n"), "a second document begins here"),
            ("id: [".to_owned(), ""),
            (String::new(), ""),
        ] {
            let message = Manifest::parse(&text, "plugin.yaml").unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
            assert_eq!(message.matches("plugin.yaml").count(), 1, "{message}");
            for name in ["Policy", "Options", "udget", "breached", "CommentBytes"] {
                assert!(!message.contains(name), "{message}");
            }
        }
    }

    #[test]
    fn a_sensor_may_say_how_long_a_reading_takes() {
        let slow = Manifest::parse(&format!("{GOOD}read_time_limit_s: 60\n"), "plugin.yaml").unwrap();
        assert_eq!(slow.read_time_limit(), Duration::from_secs(60));
        assert_eq!(Manifest::parse(GOOD, "plugin.yaml").unwrap().read_time_limit(), Duration::from_secs(5));
        for wrong in ["0", "-1", "1e9"] {
            let text = format!("{GOOD}read_time_limit_s: {wrong}\n");
            let message = Manifest::parse(&text, "plugin.yaml").unwrap_err().to_string();
            assert!(message.contains("give a sensor more than 0 and at most 3600 s"), "{message}");
        }
        let robot = GOOD.replace("kind: sensor", "kind: robot") + "read_time_limit_s: 3\n";
        assert!(Manifest::parse(&robot, "plugin.yaml").is_err());
    }

    #[test]
    fn every_mistake_is_reported_at_once() {
        let text = GOOD.replace("id: ir", "id: IR").replace("kind: sensor", "kind: sensro");
        let text = text.replace("name: edges", "name: health").replace("version: 0.1.0\n", "");
        let message = Manifest::parse(&text, "plugin.yaml").unwrap_err().to_string();
        for expected in [
            "plugin.yaml:2:1: a manifest needs the key `version`",
            "plugin.yaml:2:5: `id` is `IR-proximity`",
            "plugin.yaml:5:7: `kind` is `sensro`, which is not known",
            "did you mean `sensor`?",
            "plugin.yaml:8:12: a stream is called `health`",
        ] {
            assert!(message.contains(expected), "{expected}: {message}");
        }
        assert_eq!(message.matches("plugin.yaml:").count(), 4, "{message}");
    }

    /// `a robot lists quantities` was said beside it.
    #[test]
    fn a_slip_in_the_kind_is_one_mistake_whatever_else_the_manifest_lists() {
        for more in [
            "quantities: [{name: height, unit: mm}]\n",
            "read_time_limit_s: 3\n",
            "joints: []\n",
            "typical: {command_s: 0.1}\n",
        ] {
            let text = GOOD.replace("kind: sensor", "kind: sensr").replace("quantities: []\n", "") + more;
            let message = Manifest::parse(&text, "plugin.yaml").unwrap_err().to_string();
            assert!(message.contains("`kind` is `sensr`, which is not known"), "{message}");
            assert_eq!(message.matches("plugin.yaml:").count(), 1, "{more}: {message}");
        }
    }

    #[test]
    fn a_library_elsewhere_is_refused() {
        let text = GOOD.replace("libplumb", "../libplumb");
        let message = Manifest::parse(&text, "plugin.yaml").unwrap_err().to_string();
        assert!(
            message.starts_with("plugin.yaml:7:10: `library` is `../libplumb_ir_proximity.so`\n"),
            "{message}"
        );
        assert!(
            message.contains("give the file name alone; the library lies beside its manifest"),
            "{message}"
        );
    }

    #[test]
    fn a_layout_without_a_length_is_refused() {
        let text = GOOD.replace("proximity-edge/1", "frame/1");
        let message = Manifest::parse(&text, "plugin.yaml").unwrap_err().to_string();
        assert!(message.contains("a stream's message is `frame/1`\n"), "{message}");
        assert!(message.contains("give `max_bytes`"), "{message}");
    }
}
