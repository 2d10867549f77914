//! One arm written down in many ways is one arm: the diagnosis does not depend on the convention, on where rows are along parallel axes, on which way a joint counts, or on which end
//! of the base is up. Arms, poses and what is hidden are drawn at random; the readings come from plain matrices, no code of the laboratory.

use std::fmt::Write as _;

use nalgebra::{Matrix4, Rotation3, Translation3, Vector3, Vector4};
use plumb_calibration::arm_model::Model;
use plumb_calibration::table::Table;
use plumb_diagnosis::laboratory::{Laboratory, Options};
use plumb_diagnosis::split::Holdout;
use plumb_diagnosis::{Diagnosis, Verdict};
use plumb_estimation::{Progress, for_each};
use plumb_report::diagnosis_sentence;

use super::made_up::Xorshift;

const JOINTS: usize = 4;
const NAMES: [&str; JOINTS] = ["one", "two", "three", "four"];
const POSES: usize = 60;

/// Standard deviation of a reading, mm.
const NOISE: f64 = 0.05;

/// An arm by distal rows (Denavit & Hartenberg 1955), mm and rad: what hangs on each link, kg at mm in the frame after its row, and the point on the hand.
struct Arm {
    a: [f64; JOINTS],
    alpha: [f64; JOINTS],
    d: [f64; JOINTS],
    masses: [(f64, Vector3<f64>); JOINTS],
    point: Vector3<f64>,
}

/// What is hidden.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Hidden {
    Nothing,
    /// rad a N m.
    Compliance(usize, f64),
    /// rad, by the side of approach.
    Play(usize, f64),
    /// rad, and periods a turn.
    Wave(usize, f64, f64),
    /// Turn for turn of another joint.
    Coupling(usize, usize, f64),
}

impl Hidden {
    fn is(self) -> Option<(&'static str, &'static str)> {
        match self {
            Self::Nothing => None,
            Self::Compliance(joint, _) => Some(("joint_compliance", NAMES[joint])),
            Self::Play(joint, _) => Some(("joint_backlash", NAMES[joint])),
            Self::Wave(joint, ..) => Some(("joint_harmonic", NAMES[joint])),
            Self::Coupling(joint, ..) => Some(("joint_coupling", NAMES[joint])),
        }
    }
}

fn turn(axis: Vector3<f64>, angle: f64) -> Matrix4<f64> {
    Rotation3::new(axis * angle).to_homogeneous()
}

fn shift(x: f64, y: f64, z: f64) -> Matrix4<f64> {
    Translation3::new(x, y, z).to_homogeneous()
}

fn at(frame: &Matrix4<f64>, point: Vector3<f64>) -> Vector3<f64> {
    (frame * Vector4::new(point.x, point.y, point.z, 1.0)).xyz()
}

impl Arm {
    fn drawn(rng: &mut Xorshift) -> Self {
        let mut one = |low: f64, high: f64| rng.between(low, high);
        // Two axes are parallel, as in most arms.
        let alpha = [std::f64::consts::FRAC_PI_2, 0.0, std::f64::consts::FRAC_PI_2, 0.0];
        Self {
            a: [one(0.0, 60.0), one(250.0, 500.0), one(150.0, 400.0), one(40.0, 120.0)],
            alpha,
            d: [one(200.0, 500.0), one(-80.0, 80.0), one(-80.0, 80.0), one(100.0, 300.0)],
            masses: [(); JOINTS].map(|()| {
                (one(1.0, 6.0), Vector3::new(one(-150.0, 0.0), one(-40.0, 40.0), one(-40.0, 40.0)))
            }),
            point: Vector3::new(one(-30.0, 30.0), one(-30.0, 30.0), one(20.0, 80.0)),
        }
    }

    fn frames(&self, q: [f64; JOINTS]) -> Vec<Matrix4<f64>> {
        let mut frames = vec![Matrix4::identity()];
        for joint in 0..JOINTS {
            let row = turn(Vector3::z(), q[joint])
                * shift(self.a[joint], 0.0, self.d[joint])
                * turn(Vector3::x(), self.alpha[joint]);
            let next = frames[joint] * row;
            frames.push(next);
        }
        frames
    }

    /// Moment of gravity about a joint's axis, N m; down is -z.
    fn moment(&self, frames: &[Matrix4<f64>], joint: usize) -> f64 {
        let (axis, origin) = (frames[joint].column(2).xyz(), frames[joint].column(3).xyz());
        (joint..JOINTS)
            .map(|link| {
                let (mass, centre) = self.masses[link];
                let lever = (at(&frames[link + 1], centre) - origin) / 1000.0;
                lever.cross(&Vector3::new(0.0, 0.0, -9.80665 * mass)).dot(&axis)
            })
            .sum()
    }

    /// Where the point is, mm, for coordinates in rad and sides of approach.
    fn tip(&self, hidden: Hidden, mut q: [f64; JOINTS], sides: [f64; JOINTS]) -> Vector3<f64> {
        match hidden {
            Hidden::Nothing => {}
            Hidden::Compliance(joint, size) => q[joint] += size * self.moment(&self.frames(q), joint),
            Hidden::Play(joint, size) => q[joint] += size * sides[joint],
            Hidden::Wave(joint, size, order) => q[joint] += size * (order * q[joint]).sin(),
            Hidden::Coupling(joint, other, size) => q[joint] += size * q[other],
        }
        at(&self.frames(q)[JOINTS], self.point)
    }
}

/// Rows of some convention: a, alpha, d, and whether the joint counts the other way.
type Rows = [(f64, f64, f64, bool); JOINTS];

fn written(
    convention: &str,
    rows: &Rows,
    masses: &[(f64, Vector3<f64>)],
    point: Vector3<f64>,
    rest: &str,
) -> String {
    let mut text = format!("arm: drawn\nconvention: {convention}\njoints:\n");
    for (name, (a, alpha, d, mirrored)) in NAMES.iter().zip(rows) {
        let sign = if *mirrored { -1 } else { 1 };
        writeln!(text, "  - {{name: {name}, a_mm: {a}, alpha_deg: {}, d_mm: {d}, sign: {sign}, limits_deg: [-180, 180]}}", alpha.to_degrees()).unwrap();
    }
    text.push_str("links:\n");
    for (name, (mass, centre)) in NAMES.iter().zip(masses) {
        writeln!(
            text,
            "  - {{after: {name}, mass_kg: {mass}, centre_mm: [{}, {}, {}]}}",
            centre.x, centre.y, centre.z
        )
        .unwrap();
    }
    write!(
        text,
        "targets: {{p1: {{xyz_mm: [{}, {}, {}]}}}}\nfree: [\"joint_zero(*)\"]\n{rest}",
        point.x, point.y, point.z
    )
    .unwrap();
    text
}

impl Arm {
    fn distal(&self) -> Rows {
        std::array::from_fn(|joint| (self.a[joint], self.alpha[joint], self.d[joint], false))
    }

    /// Ways of writing the arm: its name, the model, and the joints that count the other way.
    fn ways(&self) -> Vec<(&'static str, Model, [bool; JOINTS])> {
        let straight = [false; JOINTS];
        let parse =
            |text: &str| Model::parse("model.yaml", text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let mut shifted = self.distal();
        // Joints two and three turn about parallel axes.
        shifted[1].2 += 70.0;
        shifted[2].2 -= 70.0;
        let mut of_shifted = self.masses;
        of_shifted[1].1.z -= 70.0;
        let mut mirrored = self.distal();
        (mirrored[1].3, mirrored[3].3) = (true, true);
        // The frame of the base turned over about its x: the first joint counts the other way.
        let mut over = self.distal();
        over[0] = (self.a[0], self.alpha[0] + std::f64::consts::PI, -self.d[0], true);
        vec![
            ("distal", parse(&written("distal", &self.distal(), &self.masses, self.point, "")), straight),
            ("proximal", parse(&self.proximal()), straight),
            ("shifted", parse(&written("distal", &shifted, &of_shifted, self.point, "")), straight),
            (
                "mirrored",
                parse(&written("distal", &mirrored, &self.masses, self.point, "")),
                [false, true, false, true],
            ),
            (
                "turned over",
                parse(&written("distal", &over, &self.masses, self.point, "gravity: [0, 0, 1]\n")),
                straight,
            ),
            ("urdf", self.urdf(), straight),
        ]
    }

    /// Proximal rows (Craig 2005, section 3.4) have length and twist of the row before; the last row's go into what hangs on the hand.
    fn proximal(&self) -> String {
        let rows = std::array::from_fn(|joint| match joint {
            0 => (0.0, 0.0, self.d[0], false),
            _ => (self.a[joint - 1], self.alpha[joint - 1], self.d[joint], false),
        });
        let (masses, point) = self.before_lengths();
        written("proximal", &rows, &masses, point, "")
    }

    /// What hangs on each link, and the point, in the frames before the row's length and twist.
    fn before_lengths(&self) -> (Vec<(f64, Vector3<f64>)>, Vector3<f64>) {
        let back = |joint: usize, point: Vector3<f64>| {
            at(&(shift(self.a[joint], 0.0, 0.0) * turn(Vector3::x(), self.alpha[joint])), point)
        };
        let masses = (0..JOINTS).map(|joint| (self.masses[joint].0, back(joint, self.masses[joint].1)));
        (masses.collect(), back(JOINTS - 1, self.point))
    }

    /// The same in metres, as URDF has it.
    fn urdf(&self) -> Model {
        let (masses, point) = self.before_lengths();
        let mut text = String::from("<robot name=\"drawn\"><link name=\"link0\"/>\n");
        for joint in 0..JOINTS {
            let (mass, centre) = masses[joint];
            let (a, alpha) = if joint == 0 { (0.0, 0.0) } else { (self.a[joint - 1], self.alpha[joint - 1]) };
            // The link's frame is the joint's, so that the offset along the axis goes into the origin.
            let origin = at(&turn(Vector3::x(), alpha), Vector3::new(a, 0.0, self.d[joint])) / 1000.0;
            let centre = centre / 1000.0;
            writeln!(
                text,
                "<link name=\"link{}\"><inertial><origin xyz=\"{} {} {}\"/><mass value=\"{mass}\"/></inertial></link>\n\
                 <joint name=\"{}\" type=\"continuous\"><parent link=\"link{joint}\"/><child link=\"link{}\"/><origin xyz=\"{} {} {}\" rpy=\"{alpha} 0 0\"/><axis xyz=\"0 0 1\"/></joint>",
                joint + 1, centre.x, centre.y, centre.z, NAMES[joint], joint + 1, origin.x, origin.y, origin.z
            )
            .unwrap();
        }
        text.push_str("</robot>");
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("arm.urdf"), text).unwrap();
        let model = format!(
            "arm: drawn\nconvention: {{urdf: arm.urdf}}\ntargets: {{p1: {{xyz_mm: [{}, {}, {}]}}}}\nfree: [\"joint_zero(*)\"]\n",
            point.x, point.y, point.z
        );
        std::fs::write(folder.path().join("model.yaml"), model).unwrap();
        Model::read(&folder.path().join("model.yaml")).unwrap()
    }
}

/// The readings of a campaign, with some joints counted the other way.
fn table(arm: &Arm, hidden: Hidden, seed: u64, mirrored: [bool; JOINTS]) -> Table {
    let mut rng = Xorshift::seeded(seed);
    let mut text = String::from(
        "q1_deg,q2_deg,q3_deg,q4_deg,approach_q1,approach_q2,approach_q3,approach_q4,p1_x_mm,p1_y_mm,p1_z_mm\n",
    );
    let visited: Vec<[f64; JOINTS]> = (0..POSES)
        .map(|_| {
            [
                rng.between(-150.0, 150.0),
                rng.between(-20.0, 110.0),
                rng.between(-130.0, 10.0),
                rng.between(-150.0, 150.0),
            ]
        })
        .collect();
    // Six poses are returned to four times each.
    let returns = visited.iter().take(6).flat_map(|pose| [*pose; 4]).collect::<Vec<_>>();
    for pose in visited.into_iter().chain(returns) {
        let sides: [f64; JOINTS] = std::array::from_fn(|_| if rng.unit() < 0.5 { -1.0 } else { 1.0 });
        let tip = arm.tip(hidden, pose.map(f64::to_radians), sides);
        let sign: [f64; JOINTS] = mirrored.map(|mirrored| if mirrored { -1.0 } else { 1.0 });
        for joint in 0..JOINTS {
            write!(text, "{},", sign[joint] * pose[joint]).unwrap();
        }
        for joint in 0..JOINTS {
            write!(text, "{},", sign[joint] * sides[joint]).unwrap();
        }
        let read = tip.map(|part| part + rng.noise(NOISE));
        writeln!(text, "{:.6},{:.6},{:.6}", read.x, read.y, read.z).unwrap();
    }
    Table::parse("table.csv", &text).unwrap()
}

fn diagnosed(model: &Model, table: &Table) -> Diagnosis {
    let options = Options { holdout: Holdout::None, ..Options::default() };
    Laboratory::new(model.clone(), table.clone(), options).unwrap().diagnose(&Progress::unwatched()).unwrap()
}

/// What a user acts on: verdict, name with its place, the site, the ties in any order.
fn message(diagnosis: &Diagnosis) -> (Verdict, Option<String>, Option<String>, Vec<String>) {
    let label =
        |effect: &plumb_diagnosis::EffectSite| format!("{}({}) {:?}", effect.effect, effect.site, effect.n);
    let mut tied: Vec<String> = diagnosis.tied.iter().map(label).collect();
    tied.sort();
    (
        diagnosis.verdict,
        diagnosis.named.as_ref().map(|named| label(&named.effect)),
        diagnosis.located.as_ref().map(|located| located.site.clone()),
        tied,
    )
}

fn drawn(rng: &mut Xorshift, number: u64) -> Hidden {
    let joint = 1 + (rng.unit() * 3.0) as usize % 3;
    let other = if joint == 3 { 2 } else { joint + 1 };
    match number % 5 {
        0 => Hidden::Compliance(1 + joint % 2, 1.5e-5),
        1 => Hidden::Play(joint, 6e-4),
        2 => Hidden::Wave(joint, 1e-3, 3.0),
        3 => Hidden::Coupling(joint, other, 1.5e-3),
        _ => Hidden::Nothing,
    }
}

/// Arms drawn; the variable `PLUMB_SAME_ARMS` asks for more (50 take two minutes on two idle cores).
const ARMS: u64 = 10;

fn arms() -> u64 {
    std::env::var("PLUMB_SAME_ARMS").ok().and_then(|count| count.parse().ok()).unwrap_or(ARMS)
}

#[test]
fn the_same_arm_gets_the_same_verdict_however_it_is_written() {
    let arms = arms();
    let numbers: Vec<u64> = (0..arms).collect();
    let results = for_each(&numbers, |number| {
        let mut rng = Xorshift::seeded(1000 + number);
        let arm = Arm::drawn(&mut rng);
        let hidden = drawn(&mut rng, *number);
        let ways = arm.ways();
        let verdicts: Vec<_> = ways
            .iter()
            .map(|(way, model, mirrored)| {
                let diagnosis = diagnosed(model, &table(&arm, hidden, 7000 + number, *mirrored));
                let size = diagnosis.named.as_ref().map_or(0.0, |named| named.size.abs());
                (*way, message(&diagnosis), size, diagnosis_sentence(&diagnosis))
            })
            .collect();
        (hidden, verdicts)
    });
    let mut named = 0;
    for (hidden, verdicts) in results {
        let (_, first, size, sentence) = &verdicts[0];
        for (way, other, other_size, other_sentence) in &verdicts[1..] {
            assert_eq!(first, other, "{hidden:?} as {way}:\n{sentence}\n{other_sentence}");
            assert!((size - other_size).abs() <= 0.02 * size, "{hidden:?} as {way}: {size} {other_size}");
        }
        if let (Some(found), Some((effect, site))) = (&first.1, hidden.is()) {
            assert!(found.starts_with(&format!("{effect}({site})")), "{hidden:?}: {found}");
            named += 1;
        }
        assert!(hidden != Hidden::Nothing || first.1.is_none(), "{sentence}");
    }
    // Four in five hide something, of which most is named; the rest is tied.
    assert!(named * 5 >= 3 * arms, "{named} of {arms}");
}
