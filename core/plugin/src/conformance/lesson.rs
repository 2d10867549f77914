//! What the contract says where a check fails, and what its author may change.

/// What the contract says about a check, and what to look at when it fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lesson {
    /// What the contract says.
    pub contract: &'static str,
    /// What to change.
    pub change: &'static str,
}

/// What has a lesson and is no check of its own: each shows in whatever check meets it.
pub(super) const CALL_ENDS: &str = "its calls end in time";
pub(super) const PROCESS_LIVES: &str = "its process lives on";

/// The lesson of each check, by its name.
const LESSONS: &[(&str, Lesson)] = &[
    (
        "its manifest is good",
        Lesson {
            contract: "plugin.yaml names the plugin, its kind, its streams and inputs, and its configuration as a JSON Schema; it is read before any code is",
            change: "mend the lines named; `plumb check plugin.yaml` shows each with its place",
        },
    ),
    (
        "it is loaded and its device is made",
        Lesson {
            contract: "the library has the one symbol plumb_plugin_NAME, the same manifest built in, and a `create` that connects within 15 s and moves nothing",
            change: "build it again after each change of plugin.yaml; give what `create` needs with --config",
        },
    ),
    (
        "its functions are whole",
        Lesson {
            contract: "`extension` gives the table of its kind for that name and NULL for any other; `size` is the table's, and the required functions are there",
            change: "compare with core/abi/examples/counting_arm, or let export_robot! or export_sensor! write the tables",
        },
    ),
    (
        "it is at rest before anything is asked of it",
        Lesson {
            contract: "`stop` brings the robot to rest within the stop time it describes, also when no call of plumb's made it move",
            change: "let `stop` end every motion of the controller, and read `moving` from the controller instead of remembering it",
        },
    ),
    (
        "its manifest lists the quantities, input lines and joints it describes",
        Lesson {
            contract: "a manifest that lists `quantities` (names and units), `input_lines` (their count, bits from 0) or `joints` (their ranges) lists those of the description: `plumb check` believes it",
            change: "make the manifest say what `describe` says, or leave the key out",
        },
    ),
    (
        "its description makes sense",
        Lesson {
            contract: "a description never changes; joints have ranges, speeds and homes that can be, quantities names and units that a procedure can write",
            change: "mend the number, name or unit that is named; make descriptions from constants",
        },
    ),
    (
        "it is at rest when it is read",
        Lesson {
            contract: "`read_joints` answers within 5 s, with as many finite numbers as there are joints, and `moving` 0 while nothing moves",
            change: "read the controller's own state, in rad and mm; give an error where it does not answer",
        },
    ),
    (
        "a move ends at its target",
        Lesson {
            contract: "`move_joints` returns when the robot is at rest at its target, to the resolution it describes; joints are rad and mm",
            change: "wait until the controller says that it is at rest; convert units on both ways; describe the true resolution",
        },
    ),
    (
        "a relative move adds to where the joints are",
        Lesson {
            contract: "with `relative` 1 the target is added to where the joints are when the move begins",
            change: "read the joints and add; in Rust, `motion.end_from(&joints)` does both kinds",
        },
    ),
    (
        "joints that take no part stay where they are",
        Lesson {
            contract: "a joint whose bit in `joint_mask` is 0 stays; its target is not looked at and may be no number",
            change: "take the target of such a joint from where it is",
        },
    ),
    (
        "its joint stream ends at rest where the move ended",
        Lesson {
            contract: "while it moves and when it has come to rest a robot emits its joints on `joints`; the last message of a move has `moving` 0",
            change: "emit once more, with `moving` 0, before `move_joints` returns",
        },
    ),
    (
        "its times are those of the cell's clock",
        Lesson {
            contract: "every time_ns is taken from the host's now_ns when the value was measured; it is never 0 and never the time of day",
            change: "call now_ns (host.now_ns()) where the value is read",
        },
    ),
    (
        "its times never go back",
        Lesson {
            contract: "what comes later on a stream is not dated earlier, and a state read after a move is not older than the move's end",
            change: "take each time when its value is read, and do not hand out values that were kept",
        },
    ),
    (
        "its input stream closes every move",
        Lesson {
            contract: "a robot with input lines ends every move with a message on `inputs` with `changed` 0, not older than the state the move returns",
            change: "take the state first, then emit `inputs` once more with `changed` 0",
        },
    ),
    (
        "its input lines can be read at rest",
        Lesson {
            contract: "a robot with input lines has `read_inputs`: the host closes readings at rest with it",
            change: "add `read_inputs`, or describe no lines",
        },
    ),
    (
        "a stop ends a move in time",
        Lesson {
            contract: "a move looks at should_stop at least every 50 ms, brings the robot to rest and returns PLUMB_STOPPED within the stop time described",
            change: "wait in pieces (host.wait), tell the controller to stop, and describe the stop_time_ms that it needs",
        },
    ),
    (
        "a stop holds until it is activated again",
        Lesson {
            contract: "after a stop every move is refused with PLUMB_STOPPED until `activate`; then it moves again",
            change: "look at should_stop before the first step of a move as well",
        },
    ),
    (
        "a device wired to it learns of it at rest",
        Lesson {
            contract: "after a reading at rest there is a message on each stream that is not older than what was read; the host adds what a robot leaves out",
            change: "declare the stream `joints` (and `inputs` with `read_inputs`) in plugin.yaml",
        },
    ),
    (
        "it can be armed, polled and read at once",
        Lesson {
            contract: "`arm`, `poll` and a first `read` work right after `create`, within 5 s; a reading may take `read_time_limit_s` of the manifest",
            change: "answer with PLUMB_EMPTY (None) where nothing is there yet; declare read_time_limit_s for a slow instrument",
        },
    ),
    (
        "its readings hold what its description says",
        Lesson {
            contract: "a reading holds every quantity of the description and no other, finite, with a standard uncertainty of 0 or more",
            change: "give an error where the instrument has no value, in place of a number that is none",
        },
    ),
    (
        "its readings are dated by the cell's clock",
        Lesson {
            contract: "time_ns is the cell's clock when the value was measured; a sensor without inputs always has a reading",
            change: "call now_ns (host.now_ns()) where the instrument is read",
        },
    ),
    (
        "a reading asked for after a moment is not an older one",
        Lesson {
            contract: "`read(after_ns)` gives nothing that was measured before after_ns: the arm may have moved since",
            change: "measure anew in `read`, or return PLUMB_EMPTY (None) until a newer value is there",
        },
    ),
    (
        "it does not claim to have seen what has not come",
        Lesson {
            contract: "a sensor on another device's stream answers only for what it has seen of that stream",
            change: "compare after_ns with the time of the last message, and return PLUMB_EMPTY (None) before",
        },
    ),
    (
        "it reports lost messages and goes on",
        Lesson {
            contract: "messages lost on an input are reported once, with PLUMB_INPUT_LOST from `poll` or `read`; after that the sensor goes on",
            change: "pass on what `receive` returns",
        },
    ),
    (
        "it refuses settings it does not know",
        Lesson {
            contract: "`configure` refuses what it does not know, with PLUMB_REFUSED, or is not there (PLUMB_UNSUPPORTED)",
            change: "read settings into a type that denies unknown fields, or leave `configure` out",
        },
    ),
    (
        "it emits what its manifest declares",
        Lesson {
            contract: "a plugin emits on the streams of its manifest alone, in the layout each declares",
            change: "declare the stream, or mend its layout",
        },
    ),
    (
        CALL_ENDS,
        Lesson {
            contract: "a call that moves nothing ends within 5 s (`activate` 60 s, `set_zero` 900 s, a `read` what read_time_limit_s of the manifest says)",
            change: "give an error where the device does not answer, in place of waiting for it; declare read_time_limit_s for a slow instrument",
        },
    ),
    (
        PROCESS_LIVES,
        Lesson {
            contract: "a call returns, with an error where something went wrong; it does not exit, abort, unwind or crash",
            change: "hold it with a debugger: `plumb run --debugger` gives it all the time it wants, and `ps` shows its process",
        },
    ),
];

/// What the contract says where this check fails, and what to change.
pub fn lesson(check: &str) -> Option<Lesson> {
    LESSONS.iter().find(|(name, _)| *name == check).map(|(_, lesson)| *lesson)
}
