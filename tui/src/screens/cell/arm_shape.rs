//! What of a robot can be drawn: the points along it for the joints it reports, and marks on the table.

use std::fmt;
use std::sync::Arc;

use plumb_calibration::arm_model::Model;
use plumb_calibration::arm_model::SurfaceShape;
use plumb_cell::event::NamedValue;
use plumb_cell::workcell::{RobotSetting, Workcell};
use plumb_cell::{DegOrMm, surface_called};
use plumb_kinematics::LinkFrames;

/// Gives the points along an arm, base first, in the frame of the cell in mm, for the joints a robot reports.
type Skeleton = dyn Fn(&[NamedValue]) -> Option<Vec<[f64; 3]>> + Send + Sync;

/// Edges nearer to the table than this are drawn on it, mm.
const ON_THE_TABLE: f64 = 5.0;

/// The least vertical part of the normal of a plane that is level, 1: within 2.6 degrees, which no drawing shows.
const LEVEL: f64 = 0.999;

/// What of an arm can be drawn.
#[derive(Clone)]
pub(crate) struct ArmShape {
    /// The robot, as the cell calls it.
    pub device: String,
    skeleton: Arc<Skeleton>,
    /// Edges on the table: a name and the distance from the base's axis, mm.
    pub marks: Vec<(String, f64)>,
    /// The highest level plane that the cell keeps this robot above, mm over the frame of the cell.
    pub kept_above: Option<f64>,
}

impl ArmShape {
    /// An arm whose points `skeleton` gives, over a table with `marks` at these distances (mm) from the base's axis.
    pub(crate) fn new(
        device: &str,
        skeleton: impl Fn(&[NamedValue]) -> Option<Vec<[f64; 3]>> + Send + Sync + 'static,
        marks: Vec<(String, f64)>,
    ) -> Self {
        Self { device: device.to_owned(), skeleton: Arc::new(skeleton), marks, kept_above: None }
    }

    /// The first robot of a cell whose model file says what it is like.
    pub(crate) fn of_cell(cell: &Workcell) -> Option<Self> {
        let shape = cell.robots.iter().find_map(of_robot)?;
        let planes = cell.keep_out.iter().filter(|plane| plane.robot == shape.device);
        let level = planes.filter(|plane| plane.normal[2] > LEVEL).map(|plane| plane.offset_mm);
        Some(Self { kept_above: level.max_by(f64::total_cmp), ..shape })
    }

    /// Where the table is drawn, mm over the frame of the cell: where the cell keeps the robot above, else where its base is.
    pub(crate) fn table(&self) -> f64 {
        self.kept_above.unwrap_or(0.0)
    }

    /// Whether something at this height (mm) is where the cell lets nothing of the robot be.
    pub(crate) fn is_kept_out(&self, height: f64) -> bool {
        self.kept_above.is_some_and(|least| height < least)
    }

    /// The points along the arm for these joints; none if they do not fit the arm.
    pub(crate) fn points(&self, joints: &[NamedValue]) -> Option<Vec<[f64; 3]>> {
        let points = (self.skeleton)(joints)?;
        points.iter().flatten().all(|coordinate| coordinate.is_finite()).then_some(points)
    }
}

impl fmt::Debug for ArmShape {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = formatter.debug_struct("ArmShape");
        text.field("device", &self.device).field("marks", &self.marks).finish_non_exhaustive()
    }
}

/// The shape of a robot with a model file. A file that cannot be understood was refused when the cell was read.
fn of_robot(robot: &RobotSetting) -> Option<ArmShape> {
    let file = robot.model.clone()?;
    let model = Model::parse(&file.file.display().to_string(), &file.text).ok()?;
    let marks = marks(&model);
    let names = robot.joints.clone();
    let skeleton = move |values: &[NamedValue]| {
        let drive = names.iter().map(|(name, unit)| {
            let value = values.iter().find(|value| value.name == *name)?.value;
            Some(if *unit == DegOrMm::Deg { value.to_radians() } else { value })
        });
        let drive: Vec<f64> = drive.collect::<Option<_>>()?;
        let link_frames = LinkFrames::of(&model.chain, &file.model_joints(&drive), &[]);
        let world_from_base = model.base.pose;
        let ends = link_frames.joints.iter().map(|frame| (world_from_base * frame.end).translation.vector);
        let points = std::iter::once(world_from_base.translation.vector).chain(ends);
        Some(points.map(Into::into).collect())
    };
    Some(ArmShape::new(&robot.device, skeleton, marks))
}

/// The edges that lie on the table.
fn marks(model: &Model) -> Vec<(String, f64)> {
    let mark = |surface: &plumb_calibration::arm_model::Surface| match &surface.shape {
        SurfaceShape::Line { point, direction }
            if point.z.abs() < ON_THE_TABLE && direction.z.abs() < 0.1 =>
        {
            let across = point.xy().perp(&direction.xy().normalize()).abs();
            (across > 1.0).then(|| (surface_called(&surface.name), across))
        }
        _ => None,
    };
    model.surfaces.iter().filter_map(mark).collect()
}
