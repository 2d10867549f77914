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

/// In place of a robot: poses of the flange instead of joints.
const POSES: &str = "poses";

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

/// The header of a table of poses.
const POSES_TABLE: &str = "flange_x_mm,flange_y_mm,flange_z_mm,flange_qw,flange_qx,flange_qy,flange_qz,p1_x_mm,p1_y_mm,p1_z_mm,time_s,repeat\n";

/// Why there is no template.
#[derive(Debug, Error)]
pub enum TemplateError {
    /// Not a robot that is known.
    #[error(
        "`{name}` is no robot that is known, nor a number of joints such as 6, nor `poses` (of a flange, in place of joints), nor a file that ends in .urdf{suggestion}"
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
        // Its table has poses in place of joints.
        if lower == POSES {
            let poses = Self::from_model(POSES, include_str!("../robots/poses.yaml"))?;
            return Ok(Self { table: POSES_TABLE.to_owned(), ..poses });
        }
        if let Some((name, text)) = ROBOTS.iter().find(|(name, _)| *name == lower) {
            return Self::from_model(name, text);
        }
        match robot.parse::<usize>() {
            // A larger number is a slip of the pen.
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
        // The name becomes that of files.
        let name: String = arm
            .name
            .chars()
            .map(|letter| if letter.is_ascii_alphanumeric() { letter.to_ascii_lowercase() } else { '_' })
            .collect();
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
    let mut columns: Vec<String> = (0..joints)
        .map(|joint| format!("q{}_{}", joint + 1, if model.slides(joint) { "mm" } else { "deg" }))
        .collect();
    for target in &model.targets {
        columns.extend(["x", "y", "z"].map(|axis| format!("{}_{axis}_mm", target.name)));
    }
    columns.extend(["time_s", "temperature_c", "payload_kg"].map(str::to_owned));
    columns.extend((1..=joints).map(|joint| format!("approach_q{joint}")));
    columns.push("repeat".to_owned());
    columns.join(",") + "\n"
}

/// A number to nine places: what is beyond is rounding of the file's radians. No minus before a zero.
fn round(value: f64) -> f64 {
    (value * 1e9).round() / 1e9 + 0.0
}

fn triple(vector: Vector3<f64>) -> String {
    format!("[{}, {}, {}]", round(vector.x), round(vector.y), round(vector.z))
}

/// A model file with the rows of a URDF's arm.
fn urdf_model(name: &str, path: &str, arm: &UrdfArm) -> String {
    let (root, tip) = &arm.ends;
    let mut text = format!(
        "# From {path}, `{root}` to `{tip}`: the axes of its joints as distal rows. At coordinates zero the arm is as in the file.\n\
         arm: {name}\nconvention: distal\njoints:\n"
    );
    // On top, where they are seen.
    for note in &arm.notes {
        text.insert_str(0, &format!("# {note}.\n"));
    }
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
    // In the frame of the first row, which may be on its head in the file's root link.
    let gravity = triple(arm.root_from_base.rotation.inverse() * -Vector3::z());
    let point = triple(arm.flange_from_tip.translation.vector);
    text.push_str(&format!(
        "base: {{xyz_mm: {xyz}, rpy_deg: {rpy}, free: true}}     # where the first row is in `{root}`; then wherever the instrument is\n\
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
# noise: {p1_mm: 0.05}                             # 1 sigma an axis, if it is known; returns to some poses determine it better
# gravity: [0, 0, -1]                              # what is down, in the frame of the first row; for an arm that hangs or leans
# links: [{after: j2, mass_kg: 5, centre_mm: [-200, 0, 0]}]     # for effects of gravity
",
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Table;

    #[test]
    fn every_robot_that_is_known_gives_a_model_and_a_table_for_it() {
        for robot in robots() {
            let template = Template::of(&robot.to_uppercase()).unwrap();
            let model = Model::parse("model.yaml", &template.model).unwrap();
            let cells = vec!["1"; template.table.trim().split(',').count()].join(",");
            let table = Table::parse("table.csv", &format!("{}{cells}\n", template.table)).unwrap();
            assert_eq!(table.joints, model.chain.len(), "{robot}");
            assert!(table.time.is_some() && table.payload.is_some() && table.approach.is_some());
            assert_eq!(table.positions.len(), model.targets.len());
        }
    }

    #[test]
    fn a_number_of_joints_gives_rows_to_fill_in() {
        let template = Template::of("3").unwrap();
        assert_eq!(Model::parse("model.yaml", &template.model).unwrap().chain.len(), 3);
        assert!(template.table.starts_with("q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm,time_s"));
        for count in ["0", "13"] {
            assert!(Template::of(count).unwrap_err().to_string().contains("write a number from 1 to 12"));
        }
        let unknown = Template::of("puma56").unwrap_err().to_string();
        assert!(unknown.contains("did you mean `puma560`?"), "{unknown}");
    }

    const URDF: &str = r#"<robot name="Two Links"><link name="base"/>
      <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="3"/></inertial></link><link name="hand"/>
      <joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.4"/><axis xyz="0 0 -1"/>
        <limit lower="-2" upper="2" velocity="1" effort="0"/></joint>
      <joint name="reach" type="prismatic"><parent link="upper"/><child link="hand"/><origin xyz="0.5 0 0"/><axis xyz="1 0 0"/>
        <limit lower="0" upper="0.25" velocity="1" effort="0"/></joint></robot>"#;

    #[test]
    fn the_arm_of_a_urdf_file_keeps_its_shape_its_masses_and_what_is_down() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("two.urdf");
        std::fs::write(&file, URDF).unwrap();
        let template = Template::of_urdf(&file, None).unwrap();
        assert_eq!(template.name, "two_links");
        assert_eq!(template.ends, Some(("base".to_owned(), "hand".to_owned())));
        assert!(template.table.starts_with("q1_deg,q2_mm,"));
        let model = Model::parse("model.yaml", &template.model).unwrap();
        assert_eq!(model.chain.joints[1].limits, (0.0, 250.0));
        assert_eq!(model.masses[0].mass, 3.0);
        // The first axis points down, so that the first row is upside down: what is down must be said in its frame.
        let down = model.base.pose.rotation * model.gravity.unwrap();
        assert!((down + Vector3::z()).norm() < 1e-6, "{down}");
        let at = |q: [f64; 2]| {
            crate::prediction::points(
                &model,
                None,
                &[crate::prediction::Pose { q: q.to_vec(), ..Default::default() }],
            )
            .unwrap()[0]
        };
        assert!((at([0.0, 100.0]) - Vector3::new(600.0, 0.0, 400.0)).norm() < 1e-6, "{}", at([0.0, 100.0]));
        // About -z, a positive turn goes towards -y.
        let turned = at([std::f64::consts::FRAC_PI_2, 0.0]);
        assert!((turned - Vector3::new(0.0, -500.0, 400.0)).norm() < 1e-6, "{turned}");
    }

    #[test]
    fn a_urdf_file_that_is_none_is_refused_with_its_name() {
        let message = |path: &Path| Template::of_urdf(path, None).unwrap_err().to_string();
        assert!(message(Path::new("/nowhere/arm.urdf")).contains("/nowhere/arm.urdf"));
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("no.urdf");
        std::fs::write(&file, "<sdf/>").unwrap();
        assert!(message(&file).contains("no.urdf"), "{}", message(&file));
    }
}
