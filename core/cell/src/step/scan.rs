//! `scan`: a light stripe sensor is carried along a line, and at each place a stripe is taken.

use crate::expression::{Expression, Shape};
use crate::read_context::{CheckContext, ReadContext};
use crate::yaml::{MapReader, Node, Place};

/// A declared scan.
#[derive(Debug, Clone)]
pub struct ScanStep {
    /// Which robot.
    pub robot: String,
    /// Where its name stands.
    pub robot_place: Place,
    /// The light stripe sensor.
    pub sensor: String,
    /// Where its name stands.
    pub sensor_place: Place,
    /// The camera that is asked for each picture; none for one that takes them by itself.
    pub trigger: Option<(String, Place)>,
    /// Where the first stripe's middle goes, mm in the robot's base frame.
    pub from: [Expression; 3],
    /// Where the last goes at most.
    pub to: [Expression; 3],
    /// From stripe to stripe, mm.
    pub step: Expression,
    /// The point of the flange's frame that is brought to each of these places, mm.
    pub aim_mm: [f64; 3],
    /// How far the flange's axis is tilted from straight down, deg.
    pub tilt: Option<Expression>,
    /// The direction, about the vertical from the base's x, in which the flange then stands, deg.
    pub azimuth: Option<Expression>,
    /// How far the flange is turned about its own axis, deg.
    pub turn: Option<Expression>,
    /// Part of the full speed.
    pub speed: f64,
    /// How fast the aim goes along the line while the camera takes pictures by itself, mm/s; none or 0: the arm rests for each.
    pub fly: Option<Expression>,
    /// What is fitted to the points.
    pub fit: Option<Fitted>,
    /// The name of the cloud's files.
    pub save: Option<String>,
    /// The name under which the lab knows the surface.
    pub on: Option<String>,
}

/// What is fitted to the points of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fitted {
    /// A plane.
    Plane,
    /// A pyramid of four faces on a table.
    Pyramid,
    /// A ball on a table.
    Sphere,
}

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<ScanStep> {
    let mut map = MapReader::new(node, "a scan", context.problems)?;
    let robot = context.required_text(&mut map, "robot");
    let sensor = context.required_text(&mut map, "sensor");
    let text =
        |node: &Node, what: &str| node.text(what, context.problems).map(|text| (text.to_owned(), node.place));
    let trigger = map.optional("trigger").and_then(|node| text(node, "`trigger`"));
    let from = map.required("from_mm").and_then(|node| read_place(node, "`from_mm`", context));
    let to = map.required("to_mm").and_then(|node| read_place(node, "`to_mm`", context));
    let step = map.required("step_mm").and_then(|node| context.expression(node, "`step_mm`"));
    let aim_mm = map.required("aim_mm").and_then(|node| node.numbers("`aim_mm`", context.problems));
    let mut angle =
        |key: &'static str| map.optional(key).and_then(|node| context.expression(node, &format!("`{key}`")));
    let (tilt, azimuth, turn) = (angle("tilt_deg"), angle("azimuth_deg"), angle("turn_deg"));
    let fly = angle("fly_mm_s");
    let speed = context.number_or(&mut map, "speed", (0.001, 1.0), 0.5);
    let fit = map
        .optional("fit")
        .and_then(|node| node.word("surface to fit", &["plane", "pyramid", "sphere"], context.problems))
        .map(|word| {
            [Fitted::Plane, Fitted::Pyramid, Fitted::Sphere].get(word).copied().unwrap_or(Fitted::Plane)
        });
    let save = map.optional("save").and_then(|node| {
        let (name, place) = text(node, "`save`")?;
        crate::step::check_name(&name, place, "the name of a cloud", context);
        Some(name)
    });
    let on = map.optional("on").and_then(|node| text(node, "`on`")).map(|(name, _)| name);
    map.finish();
    let (robot, robot_place) = robot?;
    let (sensor, sensor_place) = sensor?;
    Some(ScanStep {
        robot,
        robot_place,
        sensor,
        sensor_place,
        trigger,
        from: from?,
        to: to?,
        step: step?,
        aim_mm: aim_mm?,
        tilt,
        azimuth,
        turn,
        speed,
        fly,
        fit,
        save,
        on,
    })
}

pub(super) fn read_place(node: &Node, what: &str, context: &ReadContext<'_>) -> Option<[Expression; 3]> {
    let items = node.list(what, context.problems)?;
    let [x, y, z] = items else {
        context.problems.add(node.place, format!("{what} has {} numbers", items.len()), "write `[x, y, z]`");
        return None;
    };
    Some([context.expression(x, what)?, context.expression(y, what)?, context.expression(z, what)?])
}

impl ScanStep {
    pub(super) fn check(&self, context: &CheckContext<'_>) {
        let _ = context.robot(&self.robot, self.robot_place);
        context.sensor(&self.sensor, self.sensor_place);
        if let Some((trigger, place)) = &self.trigger {
            context.sensor(trigger, *place);
        }
        let expressions = self.from.iter().chain(&self.to).chain([&self.step]);
        let angles = self.tilt.iter().chain(&self.azimuth).chain(&self.turn).chain(&self.fly);
        for expression in expressions.chain(angles) {
            context.check_expression(expression);
        }
    }

    /// The camera that takes pictures by itself while the arm flies.
    pub(crate) fn camera(&self) -> Option<&str> {
        self.trigger.as_ref().map(|(name, _)| name.as_str())
    }

    pub(super) fn result_shape(&self) -> Shape {
        let mut names = vec!["points", "stripes", "empty", "seconds", "camera_percent", "processing_percent"];
        match self.fit {
            None => {}
            Some(Fitted::Plane) => {
                names.extend(["rms_mm", "thickness_mm", "normal_x", "normal_y", "normal_z", "offset_mm"])
            }
            Some(Fitted::Pyramid) => names.extend(["rms_mm", "apex_x_mm", "apex_y_mm", "apex_z_mm"]),
            Some(Fitted::Sphere) => {
                names.extend(["rms_mm", "centre_x_mm", "centre_y_mm", "centre_z_mm", "radius_mm"]);
            }
        }
        Shape::Map(names.into_iter().map(|name| (name.to_owned(), Shape::Single)).collect())
    }
}
