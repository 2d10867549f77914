//! An empty pair to start from: a model file of a known robot, and a table with the right columns.

use std::path::Path;

use nalgebra::Vector3;
use plumb_document::{FileKind, read_text};
use plumb_kinematics::Motion;
use plumb_kinematics::urdf::{UrdfArm, UrdfError};
use thiserror::Error;

use crate::arm_model::Model;
use crate::file::ModelFileError;
use crate::placeholders::placeholders;
use crate::suggestion::suggestion;

/// Robots whose nominal numbers are known.
const ROBOTS: [(&str, &str); 5] = [
    ("teachmover", include_str!("../robots/teachmover.yaml")),
    ("puma560", include_str!("../robots/puma560.yaml")),
    ("ur5", include_str!("../robots/ur5.yaml")),
    ("ur10", include_str!("../robots/ur10.yaml")),
    ("panda", include_str!("../robots/panda.yaml")),
];

/// A model file and a table, to be filled in.
#[derive(Debug, Clone, PartialEq)]
pub struct Template {
    /// The robot's name: file names begin with it.
    pub name: String,
    /// The model file's text.
    pub model: String,
    /// The table's text: the header, and nothing below it.
    pub table: String,
    /// The links of a URDF file between which the arm was taken to be.
    pub ends: Option<(String, String)>,
}

/// Why there is no template.
#[derive(Debug, Error)]
pub enum TemplateError {
    /// Not a robot that is known.
    #[error(
        "`{name}` is no robot that is known, nor a number of joints such as 6, nor a file that ends in .urdf{suggestion}"
    )]
    Unknown {
        /// What was written.
        name: String,
        /// What may have been meant.
        suggestion: String,
    },
    /// A number of joints no arm has.
    #[error("an arm of {0} joints cannot be; write a number from 1 to 12")]
    Joints(usize),
    /// A URDF file that cannot be read.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// A URDF file that is no arm of this kind.
    #[error("{path}: {source}")]
    Urdf {
        /// The file.
        path: String,
        /// What is wrong with it.
        source: UrdfError,
    },
    /// The model it would write cannot be read.
    #[error(transparent)]
    Model(#[from] ModelFileError),
}

/// Names of the robots whose numbers are known.
pub fn robots() -> impl Iterator<Item = &'static str> {
    ROBOTS.iter().map(|(name, _)| *name)
}

impl Template {
    /// A pair for a known robot, or for any arm of so many joints.
    ///
    /// # Errors
    /// No such robot is known.
    pub fn of(robot: &str) -> Result<Self, TemplateError> {
        let lower = robot.to_lowercase();
        if let Some((name, text)) = ROBOTS.iter().find(|(name, _)| *name == lower) {
            return Self::from_model(name, text);
        }
        match robot.parse::<usize>() {
            Ok(joints) if (1..=12).contains(&joints) => Self::from_model("arm", &generic(joints)),
            Ok(joints) => Err(TemplateError::Joints(joints)),
            Err(_) => Err(TemplateError::Unknown {
                name: robot.to_owned(),
                suggestion: suggestion(&lower, ROBOTS.iter().map(|(name, _)| *name)),
            }),
        }
    }

    /// A pair for the arm of a URDF file, from its root to `tip` (to the end of its longest branch, where none is given).
    ///
    /// # Errors
    /// The file cannot be read, or is no arm.
    pub fn of_urdf(path: &Path, tip: Option<&str>) -> Result<Self, TemplateError> {
        let shown = path.display().to_string();
        let text = read_text(path, FileKind::URDF)
            .map_err(|source| TemplateError::File { path: shown.clone(), source: source.into() })?;
        let arm = UrdfArm::parse(&text, tip)
            .map_err(|source| TemplateError::Urdf { path: shown.clone(), source })?;
        let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' };
        let name: String = arm.name.chars().map(plain).collect();
        let name = if name.is_empty() { "arm".to_owned() } else { name };
        let template = Self::from_model(&name, &urdf_model(&name, &shown, &arm))?;
        Ok(Self { ends: Some(arm.ends), ..template })
    }

    fn from_model(name: &str, text: &str) -> Result<Self, TemplateError> {
        let model = Model::parse(&format!("{name}.yaml"), text)?;
        Ok(Self { name: name.to_owned(), model: text.to_owned(), table: table(&model), ends: None })
    }
}

/// The header of a table for this model: one column a joint and axis, then the conditions worth logging.
fn table(model: &Model) -> String {
    let joints = model.chain.len();
    let unit = |joint: usize| if model.slides(joint) { "mm" } else { "deg" };
    let mut columns: Vec<String> =
        (0..joints).map(|joint| format!("q{}_{}", joint + 1, unit(joint))).collect();
    for target in &model.targets {
        columns.extend(["x", "y", "z"].map(|axis| format!("{}_{axis}_mm", target.name)));
    }
    columns.extend(["time_s", "temperature_c", "payload_kg"].map(str::to_owned));
    columns.extend((1..=joints).map(|joint| format!("approach_q{joint}")));
    columns.push("repeat".to_owned());
    columns.join(",") + "\n"
}

/// A model file with the rows of a URDF's arm.
fn urdf_model(name: &str, path: &str, arm: &UrdfArm) -> String {
    let (root, tip) = &arm.ends;
    let mut text = format!(
        "# From {path}, `{root}` to `{tip}`: the axes of its joints as distal rows. At coordinates zero the arm stands as in the file.\n\
         arm: {name}\nconvention: distal\njoints:\n"
    );
    for note in &arm.notes {
        text.insert_str(0, &format!("# {note}.\n"));
    }
    let round = |value: f64| {
        let rounded = (value * 1e9).round() / 1e9;
        if rounded == 0.0 { 0.0 } else { rounded }
    };
    for joint in &arm.chain.joints {
        let (low, high) = joint.limits;
        let limits = match joint.motion {
            Motion::Turns => {
                format!("limits_deg: [{}, {}]", round(low.to_degrees()), round(high.to_degrees()))
            }
            Motion::Slides => format!("slides: true, limits_mm: [{}, {}]", round(low), round(high)),
        };
        text.push_str(&format!(
            "  - {{name: {:?}, a_mm: {}, alpha_deg: {}, d_mm: {}, theta_deg: {}, {limits}}}\n",
            joint.name,
            round(joint.a),
            round(joint.alpha.to_degrees()),
            round(joint.d),
            round(joint.theta.to_degrees())
        ));
    }
    let triple =
        |vector: Vector3<f64>| format!("[{}, {}, {}]", round(vector.x), round(vector.y), round(vector.z));
    if let Some(odd) = placeholders(&arm.masses) {
        text.push_str(&format!("# {odd}.\n"));
    }
    if !arm.masses.is_empty() {
        text.push_str("links:\n");
    }
    for mass in &arm.masses {
        let after = arm.chain.joints.get(mass.after).map_or("", |joint| joint.name.as_str());
        text.push_str(&format!(
            "  - {{after: {after:?}, mass_kg: {}, centre_mm: {}}}\n",
            round(mass.mass),
            triple(mass.centre)
        ));
    }
    let (roll, pitch, yaw) = arm.root_from_base.rotation.euler_angles();
    let rpy = triple(Vector3::new(roll, pitch, yaw).map(f64::to_degrees));
    let xyz = triple(arm.root_from_base.translation.vector);
    let gravity = triple(arm.root_from_base.rotation.inverse() * -Vector3::z());
    let point = triple(arm.flange_from_tip.translation.vector);
    text.push_str(&format!(
        "base: {{xyz_mm: {xyz}, rpy_deg: {rpy}, free: true}}     # where the first row stands in `{root}`; then wherever the instrument is\n\
         targets: {{p1: {{xyz_mm: {point}, free: true}}}}     # the origin of `{tip}`; write where the measured point is\n\
         free: [\"joint_zero(*)\"]\neffects: []\nmeasured_from: instrument\n\
         gravity: {gravity}     # in the frame of the first row: what is down in `{root}`. Turn it for an arm that hangs or leans\n"
    ));
    text
}

fn generic(joints: usize) -> String {
    let mut text = "# Fill in the lengths (mm) and angles (deg) of the arm, joint by joint. Distal: turn theta about z, go d along z,
# go a along x, turn alpha about x. Proximal (Craig): alpha and a of the row come before theta and d.
arm: arm
convention: distal
joints:
"
    .to_owned();
    for joint in 1..=joints {
        text.push_str(&format!(
            "  - {{name: j{joint}, a_mm: 0, alpha_deg: 0, d_mm: 0, theta_deg: 0, limits_deg: [-180, 180]}}\n"
        ));
    }
    text.push_str(
        "base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0], free: true}
targets: {p1: {xyz_mm: [0, 0, 0], free: true}}     # the measured point, from the flange; write what is known of it
free: [\"joint_zero(*)\"]                           # always refitted; later also link_length(*), or geometry(*)
effects: []                                        # what `plumb model add` and `grow` put in
measured_from: instrument                          # or world: a level frame, gravity along -z
# noise: {p1_mm: 0.05}                             # 1 sigma an axis, if it is known; returns to some poses tell it better
# gravity: [0, 0, -1]                              # what is down, in the frame of the first row; for an arm that hangs or leans
# links: [{after: j2, mass_kg: 5, centre_mm: [-200, 0, 0]}]     # for effects of gravity
",
    );
    text
}
