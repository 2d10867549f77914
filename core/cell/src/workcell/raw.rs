//! What was typed in a workcell file: its form is right; whether its names lead somewhere is not known yet.

use plumb_record::Instrument;
use serde_json::Value;

use super::{Pace, instruments, tolerances};
use crate::read_context::{DegOrMm, ReadContext};
use crate::yaml::{Key, MapReader, Node, Place};

pub(super) struct RawWorkcell {
    pub(super) name: String,
    pub(super) title: Option<String>,
    pub(super) world: Option<RawWorld>,
    pub(super) devices: Vec<RawDevice>,
    pub(super) plugins: Vec<(String, Place)>,
    pub(super) robots: Vec<RawRobot>,
    pub(super) keep_out: Vec<RawKeepOut>,
    pub(super) instruments: Vec<Instrument>,
    pub(super) tolerances: Vec<(Key, f64)>,
    pub(super) procedures: Vec<(String, Place)>,
    pub(super) answers: Option<(String, Place)>,
}

pub(super) struct RawWorld {
    pub(super) file: (String, Place),
    pub(super) pace: Pace,
}

pub(super) struct RawDevice {
    pub(super) name: Key,
    pub(super) plugin: (String, Place),
    pub(super) config: Value,
    pub(super) emulate: Option<(String, Place)>,
    pub(super) memory_limit_mb: Option<u64>,
    pub(super) inputs: Vec<(String, String, Place)>,
}

pub(super) struct RawRobot {
    pub(super) device: Key,
    pub(super) joints: Vec<(Key, DegOrMm)>,
    pub(super) model: Option<(String, Place)>,
    pub(super) model_from_drive: Vec<(Key, Node)>,
    pub(super) limits: Vec<(Key, DegOrMm, [f64; 2])>,
    pub(super) initialize: Vec<(String, Place)>,
}

pub(super) struct RawKeepOut {
    pub(super) name: String,
    pub(super) robot: (String, Place),
    pub(super) normal: [f64; 3],
    pub(super) normal_place: Place,
    pub(super) offset_mm: f64,
}

pub(super) fn read(root: &Node, context: &ReadContext<'_>) -> Option<RawWorkcell> {
    let problems = context.problems;
    let mut map = MapReader::new(root, "a cell", problems)?;
    let name = context.required_text(&mut map, "cell");
    let title = map.optional("title").and_then(|node| node.text("`title`", problems)).map(str::to_owned);
    let world = map.optional("world").and_then(|node| read_world(node, context));
    let devices =
        map.required("devices").and_then(|node| node.entries("`devices`", problems)).unwrap_or_default();
    let robots =
        map.optional("robots").and_then(|node| node.entries("`robots`", problems)).unwrap_or_default();
    let keep_out =
        map.optional("keep_out").and_then(|node| node.list("`keep_out`", problems)).unwrap_or_default();
    let instruments = map
        .optional("instruments")
        .and_then(|node| node.entries("`instruments`", problems))
        .unwrap_or_default();
    let tolerances = tolerances::read(&mut map, context);
    let procedures =
        map.required("procedures").map(|node| texts(node, "`procedures`", context)).unwrap_or_default();
    let plugins = map.optional("plugins").map(|node| texts(node, "`plugins`", context)).unwrap_or_default();
    let answers = map
        .optional("answers")
        .and_then(|node| Some((node.text("`answers`", problems)?.to_owned(), node.place)));
    map.finish();
    let (name, place) = name?;
    if name.len() > crate::step::LONGEST_NAME {
        let help = format!("at most {}", crate::step::LONGEST_NAME);
        problems.add(place, format!("the name of the cell has {} characters", name.len()), help);
    } else if !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_') {
        problems.add(
            place,
            format!("`{name}` cannot be the name of a cell"),
            "use letters, digits, `-` and `_`",
        );
    }
    Some(RawWorkcell {
        name,
        title,
        world,
        plugins,
        devices: devices.iter().filter_map(|(key, node)| read_device(key, node, context)).collect(),
        robots: robots.iter().filter_map(|(key, node)| read_robot(key, node, context)).collect(),
        keep_out: keep_out.iter().filter_map(|node| read_keep_out(node, context)).collect(),
        instruments: instruments
            .iter()
            .filter_map(|(key, node)| instruments::read(key, node, context))
            .collect(),
        tolerances,
        procedures,
        answers,
    })
}

fn texts(node: &Node, what: &str, context: &ReadContext<'_>) -> Vec<(String, Place)> {
    let items = node.list(what, context.problems).unwrap_or_default();
    items
        .iter()
        .filter_map(|item| Some((item.text(what, context.problems)?.to_owned(), item.place)))
        .collect()
}

fn read_world(node: &Node, context: &ReadContext<'_>) -> Option<RawWorld> {
    let mut map = MapReader::new(node, "`world`", context.problems)?;
    let file = context.required_text(&mut map, "file");
    let pace = map.optional("pace").and_then(|node| node.word("pace", &["real", "fast"], context.problems));
    map.finish();
    let pace = if pace == Some(1) { Pace::Fast } else { Pace::Real };
    Some(RawWorld { file: file?, pace })
}

fn read_device(name: &Key, node: &Node, context: &ReadContext<'_>) -> Option<RawDevice> {
    crate::step::check_name(&name.name, name.place, "the name of a device", context);
    let mut map = MapReader::new(node, "a device", context.problems)?;
    let plugin = context.required_text(&mut map, "plugin");
    let config = map.optional("config").map_or(Value::Null, Node::to_json);
    let emulate = map
        .optional("emulate")
        .and_then(|node| Some((node.text("`emulate`", context.problems)?.to_owned(), node.place)));
    let memory_limit_mb = map.optional("memory_limit_mb").and_then(|node| read_memory_limit(node, context));
    let wires = map
        .optional("inputs")
        .and_then(|node| node.entries("`inputs`", context.problems))
        .unwrap_or_default();
    map.finish();
    let inputs = wires.iter().filter_map(|(input, node)| {
        let stream = node.text("a stream", context.problems)?;
        Some((input.name.clone(), stream.to_owned(), node.place))
    });
    let inputs = inputs.collect();
    Some(RawDevice { name: name.clone(), inputs, plugin: plugin?, config, emulate, memory_limit_mb })
}

/// The least and the most memory a device's process may be given, MB: a host alone takes a tenth of the least.
const MEMORY_LIMITS_MB: (f64, f64) = (64.0, 1_000_000.0);

fn read_memory_limit(node: &Node, context: &ReadContext<'_>) -> Option<u64> {
    let limit = node.number("`memory_limit_mb`", context.problems)?;
    let (least, most) = MEMORY_LIMITS_MB;
    if (least..=most).contains(&limit) {
        return Some(limit as u64);
    }
    let message = format!("`memory_limit_mb` is {limit}");
    context.problems.add(node.place, message, format!("give {least} to {most} MB"));
    None
}

fn read_robot(device: &Key, node: &Node, context: &ReadContext<'_>) -> Option<RawRobot> {
    let problems = context.problems;
    let mut map = MapReader::new(node, "a robot", problems)?;
    let joints =
        map.required("joints").and_then(|node| node.entries("`joints`", problems)).unwrap_or_default();
    let model =
        map.optional("model").and_then(|node| Some((node.text("`model`", problems)?.to_owned(), node.place)));
    let from_drive = map
        .optional("model_from_drive")
        .and_then(|node| node.entries("`model_from_drive`", problems))
        .unwrap_or_default();
    let limits_deg = map
        .optional("limits_deg")
        .and_then(|node| node.entries("`limits_deg`", problems))
        .unwrap_or_default();
    let limits_mm =
        map.optional("limits_mm").and_then(|node| node.entries("`limits_mm`", problems)).unwrap_or_default();
    let initialize =
        map.optional("initialize").map(|node| texts(node, "`initialize`", context)).unwrap_or_default();
    map.finish();
    let unit = |node: &Node| match node.word("unit of a joint", &["deg", "mm"], problems) {
        Some(0) => Some(DegOrMm::Deg),
        Some(_) => Some(DegOrMm::Mm),
        None => None,
    };
    let read_limits = |entries: &[(Key, Node)], unit: DegOrMm| -> Vec<(Key, DegOrMm, [f64; 2])> {
        entries
            .iter()
            .filter_map(|(joint, node)| {
                let limits: [f64; 2] = node.numbers("the limits of a joint", problems)?;
                if limits[0] >= limits[1] {
                    problems.add(
                        node.place,
                        format!("the limits of `{}` are the wrong way round", joint.name),
                        "write `[least, most]`",
                    );
                }
                Some((joint.clone(), unit, limits))
            })
            .collect()
    };
    let mut limits = read_limits(limits_deg, DegOrMm::Deg);
    limits.extend(read_limits(limits_mm, DegOrMm::Mm));
    Some(RawRobot {
        device: device.clone(),
        joints: joints.iter().filter_map(|(joint, node)| Some((joint.clone(), unit(node)?))).collect(),
        model,
        model_from_drive: from_drive.to_vec(),
        limits,
        initialize,
    })
}

fn read_keep_out(node: &Node, context: &ReadContext<'_>) -> Option<RawKeepOut> {
    let mut map = MapReader::new(node, "a keep-out plane", context.problems)?;
    let name = context.required_text(&mut map, "name");
    let robot = context.required_text(&mut map, "robot");
    let plane = map.required("plane");
    map.finish();
    let mut map = MapReader::new(plane?, "a plane", context.problems)?;
    let normal_node = map.required("normal");
    let normal = normal_node.and_then(|node| node.numbers("`normal`", context.problems));
    let offset_mm = map.required("offset_mm").and_then(|node| node.number("`offset_mm`", context.problems));
    map.finish();
    let normal_place = normal_node?.place;
    Some(RawKeepOut { name: name?.0, robot: robot?, normal: normal?, normal_place, offset_mm: offset_mm? })
}
