//! What was typed in a workcell file: its form is right; whether its names lead somewhere is not known yet.

use plumb_record::Instrument;
use serde_json::Value;

use super::{Pace, TTarget, instruments, target, tolerances};
use crate::deg_or_mm::DegOrMm;
use crate::read_context::ReadContext;
use plumb_document::{Key, MapReader, Node, Problems, Span};

/// A part that could not be read is there by its name, so that what names it is not accused.
pub(super) struct RawWorkcell {
    pub(super) name: String,
    pub(super) title: Option<String>,
    pub(super) world: Option<RawWorld>,
    /// None when nothing is known of them.
    pub(super) devices: Option<Vec<RawDevice>>,
    pub(super) plugins: Vec<(String, Span)>,
    /// None when nothing is known of them.
    pub(super) robots: Option<Vec<RawRobot>>,
    pub(super) keep_out: Vec<RawKeepOut>,
    pub(super) target: Option<TTarget>,
    pub(super) instruments: Vec<Instrument>,
    pub(super) tolerances: Vec<(Key, f64)>,
    pub(super) procedures: Vec<(String, Span)>,
    pub(super) answers: Option<(String, Span)>,
}

pub(super) struct RawWorld {
    pub(super) file: (String, Span),
    pub(super) pace: Pace,
}

pub(super) struct RawDevice {
    pub(super) name: Key,
    pub(super) plugin: (String, Span),
    pub(super) config: Value,
    pub(super) emulate: Option<(String, Span)>,
    pub(super) memory_limit_mb: Option<u64>,
    pub(super) inputs: Vec<(String, String, Span)>,
}

pub(super) struct RawRobot {
    pub(super) device: Key,
    /// Without a unit where that could not be read; None when nothing is known of them.
    pub(super) joints: Option<Vec<(Key, Option<DegOrMm>)>>,
    pub(super) model: Option<(String, Span)>,
    pub(super) model_from_drive: Vec<(Key, Node)>,
    pub(super) limits: Vec<(Key, DegOrMm, [f64; 2])>,
    pub(super) initialize: Vec<(String, Span)>,
}

pub(super) struct RawKeepOut {
    pub(super) name: String,
    pub(super) robot: (String, Span),
    pub(super) normal: [f64; 3],
    pub(super) normal_span: Span,
    pub(super) offset_mm: f64,
}

pub(super) fn read(root: &Node, context: &ReadContext<'_>) -> Option<RawWorkcell> {
    let problems = context.problems;
    let mut map = MapReader::new(root, "a cell", problems)?;
    let name = context.required_text(&mut map, "cell");
    let title = map.optional("title").and_then(|node| node.text("`title`", problems)).map(str::to_owned);
    let world = map.optional("world").and_then(|node| read_world(node, context));
    let devices = map.required("devices").and_then(|node| node.entries("`devices`", problems));
    let robots = map.known_entries("robots");
    let keep_out =
        map.optional("keep_out").and_then(|node| node.list("`keep_out`", problems)).unwrap_or_default();
    let target = map.optional("target").and_then(|node| target::read(node, context));
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
        .and_then(|node| Some((node.text("`answers`", problems)?.to_owned(), node.span)));
    map.finish();
    if let Some((name, span)) = &name {
        check_cell_name(name, *span, problems);
    }
    let read_devices =
        |devices: &[(Key, Node)]| devices.iter().map(|(key, node)| read_device(key, node, context)).collect();
    let read_robots =
        |robots: &[(Key, Node)]| robots.iter().map(|(key, node)| read_robot(key, node, context)).collect();
    Some(RawWorkcell {
        name: name.map(|(name, _)| name).unwrap_or_default(),
        title,
        world,
        plugins,
        devices: devices.map(read_devices),
        robots: robots.map(read_robots),
        keep_out: keep_out.iter().filter_map(|node| read_keep_out(node, context)).collect(),
        target,
        instruments: instruments
            .iter()
            .filter_map(|(key, node)| instruments::read(key, node, context))
            .collect(),
        tolerances,
        procedures,
        answers,
    })
}

fn check_cell_name(name: &str, span: Span, problems: &Problems) {
    if name.len() > crate::step::LONGEST_NAME {
        let help = format!("at most {}", crate::step::LONGEST_NAME);
        problems.add(span, format!("the name of the cell has {} characters", name.len()), help);
    } else if !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_') {
        let message = format!("`{name}` cannot be the name of a cell");
        problems.add(span, message, "use letters, digits, `-` and `_`");
    }
}

fn texts(node: &Node, what: &str, context: &ReadContext<'_>) -> Vec<(String, Span)> {
    let items = node.list(what, context.problems).unwrap_or_default();
    items.iter().filter_map(|item| Some((item.text(what, context.problems)?.to_owned(), item.span))).collect()
}

fn read_world(node: &Node, context: &ReadContext<'_>) -> Option<RawWorld> {
    let mut map = MapReader::new(node, "`world`", context.problems)?;
    let file = context.required_text(&mut map, "file");
    let pace = map.optional("pace").and_then(|node| node.word("pace", &["real", "fast"], context.problems));
    map.finish();
    let pace = if pace == Some(1) { Pace::Fast } else { Pace::Real };
    Some(RawWorld { file: file?, pace })
}

fn read_device(name: &Key, node: &Node, context: &ReadContext<'_>) -> RawDevice {
    crate::step::check_name(&name.name, name.span, "the name of a device", context);
    let mut device = RawDevice {
        name: name.clone(),
        plugin: (String::new(), Span::NONE),
        config: Value::Null,
        emulate: None,
        memory_limit_mb: None,
        inputs: Vec::new(),
    };
    let Some(mut map) = MapReader::new(node, "a device", context.problems) else { return device };
    device.plugin = context.required_text(&mut map, "plugin").unwrap_or(device.plugin);
    device.config = map.optional("config").map_or(Value::Null, Node::to_json);
    device.emulate = map
        .optional("emulate")
        .and_then(|node| Some((node.text("`emulate`", context.problems)?.to_owned(), node.span)));
    device.memory_limit_mb =
        map.optional("memory_limit_mb").and_then(|node| read_memory_limit(node, context));
    let wires = map.known_entries("inputs").unwrap_or_default();
    map.finish();
    let inputs = wires.iter().filter_map(|(input, node)| {
        let stream = node.text("a stream", context.problems)?;
        Some((input.name.clone(), stream.to_owned(), node.span))
    });
    device.inputs = inputs.collect();
    device
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
    context.problems.add(node.span, message, format!("give {least} to {most} MB"));
    None
}

fn read_robot(device: &Key, node: &Node, context: &ReadContext<'_>) -> RawRobot {
    let problems = context.problems;
    let mut robot = RawRobot {
        device: device.clone(),
        joints: None,
        model: None,
        model_from_drive: Vec::new(),
        limits: Vec::new(),
        initialize: Vec::new(),
    };
    let Some(mut map) = MapReader::new(node, "a robot", problems) else { return robot };
    let joints = map.required("joints").and_then(|node| node.entries("`joints`", problems));
    robot.model =
        map.optional("model").and_then(|node| Some((node.text("`model`", problems)?.to_owned(), node.span)));
    robot.model_from_drive = map.known_entries("model_from_drive").unwrap_or_default().to_vec();
    robot.limits = read_limits(map.known_entries("limits_deg"), DegOrMm::Deg, problems);
    robot.limits.extend(read_limits(map.known_entries("limits_mm"), DegOrMm::Mm, problems));
    robot.initialize =
        map.optional("initialize").map(|node| texts(node, "`initialize`", context)).unwrap_or_default();
    map.finish();
    let unit = |node: &Node| {
        let unit = node.word("unit of a joint", &["deg", "mm"], problems)?;
        [DegOrMm::Deg, DegOrMm::Mm].get(unit).copied()
    };
    robot.joints =
        joints.map(|joints| joints.iter().map(|(joint, node)| (joint.clone(), unit(node))).collect());
    robot
}

fn read_limits(
    entries: Option<&[(Key, Node)]>,
    unit: DegOrMm,
    problems: &Problems,
) -> Vec<(Key, DegOrMm, [f64; 2])> {
    let read = |(joint, node): &(Key, Node)| {
        let limits: [f64; 2] = node.numbers("the limits of a joint", problems)?;
        if limits[0] >= limits[1] {
            let message = format!("the limits of `{}` are the wrong way round", joint.name);
            problems.add(node.span, message, "write `[least, most]`");
        }
        Some((joint.clone(), unit, limits))
    };
    entries.unwrap_or_default().iter().filter_map(read).collect()
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
    let normal_span = normal_node?.span;
    Some(RawKeepOut { name: name?.0, robot: robot?, normal: normal?, normal_span, offset_mm: offset_mm? })
}
