//! Poses that could be measured, drawn at random from where the arm works, and the table of readings they would give.

use plumb_kinematics::HalfSpace;

use super::pictures;
use crate::joint_range::{JointRange, joint_range};
use crate::laboratory::Laboratory;
use crate::thresholds::CLEAR_OF_LIMITS;
use plumb_calibration::table::scalar::{DISTANCE, HEIGHT, ScalarColumn};
use plumb_calibration::table::{Names, OrientationColumns, PositionColumns, ProfileColumns, Table};
use plumb_estimation::Random;

/// What poses are asked for.
#[derive(Clone, Copy)]
pub(super) struct PoseRequest<'w> {
    /// How many.
    pub(super) count: usize,
    /// Where the arm must not go.
    pub(super) keep_out: &'w [HalfSpace],
    /// Loads that can be carried, kg; none given means those of the table.
    pub(super) payloads: &'w [f64],
}

/// A pose with its circumstances.
#[derive(Clone)]
pub(super) struct Design {
    pub(super) q: Vec<f64>,
    pub(super) approach: Vec<i8>,
    pub(super) payload: f64,
    pub(super) wait: f64,
}

/// What is read at a pose besides what the table reads.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Sensing {
    /// Nothing.
    AsBefore,
    /// Whole positions.
    WholePoints,
    /// Whole positions of a second point off the flange's axis.
    SecondPoint,
}

/// Waits before a pose that effects of time are asked with, s: none, ten minutes, an hour.
const WAITS: [f64; 3] = [0.0, 600.0, 3600.0];

/// What replaces the range of a joint where the hand carries a light stripe, rad: the hand stays over the same surfaces.
const WIDEST_OF_PICTURES: f64 = 0.3;

/// Where poses are drawn from.
pub(super) struct Designer<'a> {
    pub(super) lab: &'a Laboratory,
    /// The surface the arm's own sensor is to trigger over, if that is what is measured.
    pub(super) surface: Option<String>,
    /// Whether an effect in question depends on time.
    pub(super) waits: bool,
    /// Whether both approach directions are asked of every joint, and not only of those the table knows both of.
    pub(super) both_directions: bool,
}

/// Least and greatest coordinate of chosen poses. An arm that is commanded onto its limit may refuse: its zeros are what is
/// being looked for.
fn allowed_range(range: JointRange) -> (f64, f64) {
    let (low, high) = range.ends;
    let clear = if range.limited { CLEAR_OF_LIMITS * (high - low) } else { 0.0 };
    (low + clear, high - clear)
}

impl Designer<'_> {
    /// Least and greatest coordinates poses are chosen from: the limits, and where none are known, what was measured and
    /// a little around.
    pub(super) fn range(&self, joint: usize) -> (f64, f64) {
        allowed_range(joint_range(self.lab, joint))
    }

    /// A pose anywhere in the joints' ranges.
    pub(super) fn anywhere(&self, request: PoseRequest<'_>, rng: &mut Random) -> Design {
        let joints = 0..self.lab.model().chain.len();
        let q = joints.clone().map(|joint| {
            let (low, high) = self.range(joint);
            low + (high - low) * rng.uniform()
        });
        let anywhere = q.collect();
        let beside = if self.takes_pictures() { pictures::beside_a_picture(self.lab, rng) } else { None };
        let q = beside.unwrap_or(anywhere);
        let approach = joints.map(|joint| match self.has_two_directions(joint) {
            true => [-1, 1][rng.below(2)],
            false => 0,
        });
        let approach = approach.collect();
        let payload = match request.payloads {
            [] => self.logged_payload(rng),
            given => given[rng.below(given.len())],
        };
        // An effect of time shows by waiting, whatever the pose.
        let wait = if self.waits { WAITS[rng.below(WAITS.len())] } else { 0.0 };
        Design { q, approach, payload, wait }
    }

    /// The same pose with its coordinates changed a little, `width` of each range.
    pub(super) fn near(&self, centre: &Design, width: f64, rng: &mut Random) -> Design {
        let mut design = centre.clone();
        for (joint, q) in design.q.iter_mut().enumerate() {
            let (low, high) = self.range(joint);
            // Of a stripe the surfaces are soon left.
            let widest = if self.takes_pictures() { WIDEST_OF_PICTURES } else { high - low };
            // Clamped and not drawn again: the best poses are often at the ends of the range.
            *q = (*q + widest * width * rng.normal()).clamp(low, high);
        }
        design
    }

    /// Whether a light stripe, or a camera on the hand, is what measures: it sees something from near the poses it was seen from.
    fn takes_pictures(&self) -> bool {
        let table = self.lab.table();
        table.is_of_stripes() || table.sees_a_board() || !table.profiles.is_empty()
    }

    /// Whether a joint may be asked to arrive from either side.
    fn has_two_directions(&self, joint: usize) -> bool {
        let asked = self.both_directions && self.lab.table().approach.is_some();
        asked || self.lab.summary().has_both_sides(joint)
    }

    fn logged_payload(&self, rng: &mut Random) -> f64 {
        let loads: Vec<f64> =
            self.lab.table().payload.iter().flatten().copied().filter(|load| load.is_finite()).collect();
        if loads.is_empty() { 0.0 } else { loads[rng.below(loads.len())] }
    }

    /// A table of poses to come, with the same kinds of readings.
    pub(super) fn table(&self, designs: &[Design], sensing: Sensing) -> Table {
        let known = self.lab.table();
        let trigger = self.surface.clone().filter(|_| sensing == Sensing::AsBefore);
        let surface = trigger.or_else(|| known.on.names.first().cloned());
        let point = known.distance_to.names.first().cloned();
        let mut table = self.columns(sensing, surface.is_some(), point.is_some());
        let last = known.time.iter().flatten().copied().filter(|time| time.is_finite()).fold(0.0, f64::max);
        let temperature = known.temperature.iter().flatten().copied().rfind(|value| value.is_finite());
        for (index, design) in designs.iter().enumerate() {
            table.q.extend(&design.q);
            table.lines.push(index as u32 + 1);
            table.positions.iter_mut().for_each(|columns| columns.xyz.push([0.0; 3]));
            table.board.iter_mut().for_each(|column| column.push([0.0; 3]));
            table.scalars.iter_mut().for_each(|column| column.values.push(0.0));
            table.tilt.iter_mut().for_each(|column| column.push([0.0; 2]));
            // What will be measured comes after what was.
            table.time.iter_mut().for_each(|column| column.push(last + design.wait));
            table.temperature.iter_mut().for_each(|column| column.push(temperature.unwrap_or(f64::NAN)));
            table.payload.iter_mut().for_each(|column| column.push(design.payload));
            table.approach.iter_mut().for_each(|column| column.extend(&design.approach));
            let of_profile = pictures::profile(self.lab, &design.q, &mut table);
            table.note(of_profile.or(surface.as_deref()), point.as_deref());
            let board = pictures::board(self.lab, &design.q);
            table.board_seen.of_row.push(board);
        }
        if known.is_of_stripes() && sensing == Sensing::AsBefore {
            table.stretches = pictures::stretches(self.lab, &table);
        }
        if let (Some(level), true) = (known.level.names.first(), table.tilt.is_some()) {
            table.level = Names { names: vec![level.clone()], of_row: vec![Some(0); designs.len()] };
        }
        table
    }

    /// The empty columns of that table.
    fn columns(&self, sensing: Sensing, on_a_surface: bool, to_a_point: bool) -> Table {
        let known = self.lab.table();
        let mut table = Table { source: known.source.clone(), joints: known.joints, ..Table::default() };
        table.touch.names.clone_from(&known.touch.names);
        table.positions = known.positions.iter().map(|columns| columns.empty()).collect();
        table.orientations = known.orientations.iter().map(OrientationColumns::empty).collect();
        table.orientations.iter_mut().for_each(|columns| columns.to_come = true);
        table.board = known.board.as_ref().map(|_| Vec::new());
        table.board_seen.names.clone_from(&known.board_seen.names);
        table.profiles = known.profiles.iter().map(ProfileColumns::empty).collect();
        let first = self.lab.model().targets.first().map(|target| target.name.clone());
        let other_sensing = sensing != Sensing::AsBefore || !known.touch.names.is_empty();
        if table.positions.is_empty()
            && other_sensing
            && let Some(target) = first
        {
            table.positions.push(PositionColumns { number: 0, target, xyz: Vec::new() });
        }
        let triggers = self.surface.is_some() && sensing == Sensing::AsBefore;
        if on_a_surface && !triggers && known.profiles.is_empty() {
            table.scalars.push(ScalarColumn::empty(&HEIGHT));
        }
        if to_a_point {
            table.scalars.push(ScalarColumn::empty(&DISTANCE));
        }
        // What else was read of one number a row is read again.
        let others = known.scalars.iter().filter(|column| ![&HEIGHT, &DISTANCE].contains(&column.scalar));
        table.scalars.extend(others.map(ScalarColumn::without_rows));
        // A level with a name is a spirit level: its bubble is at its end in most poses, so tilts are counted on only where
        // nothing else is read.
        let reads_else = !table.positions.is_empty() || !table.scalars.is_empty();
        let bubble = !known.level.names.is_empty() && reads_else;
        table.tilt = known.tilt.as_ref().filter(|_| !bubble).map(|_| Vec::new());
        table.time = known.time.as_ref().map(|_| Vec::new());
        table.temperature = known.temperature.as_ref().map(|_| Vec::new());
        table.payload = Some(Vec::new());
        table.approach = known.approach.as_ref().map(|_| Vec::new());
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laboratory::Options;
    use plumb_calibration::arm_model::Model;

    #[test]
    fn a_pose_near_another_differs_by_a_share_of_each_joints_range() {
        let lab = crate::testing::two_links(12, "", 0.05, 75, |_| [0.0; 2]);
        let designer = Designer { lab: &lab, surface: None, waits: false, both_directions: false };
        let centre = Design { q: vec![0.1, -0.2], approach: vec![0, 0], payload: 0.0, wait: 0.0 };
        let mut rng = Random::seeded(9);
        for (joint, centre_q) in [0.1, -0.2].into_iter().enumerate() {
            let (low, high) = designer.range(joint);
            let squares =
                (0..400).map(|_| (designer.near(&centre, 0.01, &mut rng).q[joint] - centre_q).powi(2));
            let spread = (squares.sum::<f64>() / 400.0).sqrt();
            assert!((spread / (0.01 * (high - low)) - 1.0).abs() < 0.12, "{spread}");
        }
        assert!(!designer.has_two_directions(0), "no side of approach is logged");
        // A fiftieth of the range is kept from either limit: 6.8 of 340 deg, 6 of 300.
        for (joint, clear) in [163.2_f64, 144.0].into_iter().enumerate() {
            let (low, high) = designer.range(joint);
            assert!((high - clear.to_radians()).abs() < 1e-12 && low == -high, "{low} {high}");
        }
    }

    /// The arm, of which only heights over a plane were measured.
    fn of_heights() -> Laboratory {
        let lines = "surfaces: {wall: {plane: {normal: [0, 1, 0], offset_mm: 0}}}";
        let model = Model::parse("model.yaml", &format!("{}{lines}\n", crate::testing::TWO_LINKS)).unwrap();
        let text = "time_s,temperature_c,payload_kg,q1_deg,q2_deg,height_mm,on\n5,20,1,10,20,109.7,wall\n7,21,1,30,40,240.9,wall\n";
        Laboratory::new(model, Table::parse("t.csv", text).unwrap(), Options::default()).unwrap()
    }

    #[test]
    fn poses_to_come_are_read_as_those_that_were_and_in_other_ways_by_whole_points() {
        let lab = of_heights();
        let designer = Designer { lab: &lab, surface: None, waits: false, both_directions: false };
        let design = Design { q: vec![0.1, -0.2], approach: vec![0, 0], payload: 3.0, wait: 600.0 };
        let before = designer.table(std::slice::from_ref(&design), Sensing::AsBefore);
        assert!(before.positions.is_empty() && before.scalar(&DISTANCE).is_none() && before.tilt.is_none());
        assert_eq!(before.scalar(&HEIGHT), Some(&[0.0][..]));
        assert_eq!(before.on.name(0), Some("wall"));
        // After what was measured, at the last temperature.
        assert_eq!(before.time.as_deref(), Some(&[607.0][..]));
        assert_eq!(before.temperature.as_deref(), Some(&[21.0][..]));
        assert_eq!(before.payload.as_deref(), Some(&[3.0][..]));
        assert!(before.approach.is_none() && before.q_of(0) == [0.1, -0.2]);
        let whole = designer.table(&[design], Sensing::WholePoints);
        let targets: Vec<&str> = whole.positions.iter().map(|columns| columns.target.as_str()).collect();
        assert_eq!(targets, ["p1"]);
        assert_eq!(whole.positions[0].xyz.len(), 1);
    }

    #[test]
    fn where_the_sensor_triggers_no_height_is_read_but_in_other_ways() {
        let lab = of_heights();
        let surface = Some("wall".to_owned());
        let designer = Designer { lab: &lab, surface, waits: false, both_directions: false };
        assert!(designer.columns(Sensing::AsBefore, true, false).scalar(&HEIGHT).is_none());
        assert!(designer.columns(Sensing::WholePoints, true, false).scalar(&HEIGHT).is_some());
        assert!(designer.columns(Sensing::AsBefore, false, true).scalar(&DISTANCE).is_some());
    }

    #[test]
    fn loads_are_those_given_else_those_of_the_table() {
        let lab = of_heights();
        let designer = Designer { lab: &lab, surface: None, waits: true, both_directions: true };
        let mut rng = Random::seeded(4);
        let request = |payloads: &'static [f64]| PoseRequest { count: 1, keep_out: &[], payloads };
        let drawn: Vec<Design> = (0..40).map(|_| designer.anywhere(request(&[2.0, 5.0]), &mut rng)).collect();
        assert!(drawn.iter().all(|one| [2.0, 5.0].contains(&one.payload) && WAITS.contains(&one.wait)));
        assert!(drawn.iter().any(|one| one.payload == 2.0) && drawn.iter().any(|one| one.payload == 5.0));
        assert!(WAITS.iter().all(|wait| drawn.iter().any(|one| one.wait == *wait)));
        assert!((0..5).all(|_| designer.anywhere(request(&[]), &mut rng).payload == 1.0));
        assert!(drawn.iter().all(|one| one.approach == [0, 0]), "no side is logged: none is asked for");
        let from_sides = crate::testing::with_table(&lab, |table| table.approach = Some(vec![1, 1, 1, 1]));
        let designer = Designer { lab: &from_sides, surface: None, waits: true, both_directions: true };
        let drawn: Vec<Design> = (0..40).map(|_| designer.anywhere(request(&[]), &mut rng)).collect();
        for side in [-1, 1] {
            let from = |joint: usize| drawn.iter().filter(|one| one.approach[joint] == side).count();
            assert!(from(0) > 10 && from(1) > 10, "either side of both joints is asked for");
        }
        assert!(drawn.iter().flat_map(|one| &one.approach).all(|side| side.abs() == 1));
        let (low, high) = designer.range(1);
        let reached =
            |fraction: f64| drawn.iter().filter(|one| (one.q[1] - low) / (high - low) > fraction).count();
        assert_eq!((reached(0.0), reached(1.0)), (40, 0), "within the range of the joint");
        assert!((8..32).contains(&reached(0.5)), "all over the range: {}", reached(0.5));
    }

    #[test]
    fn chosen_poses_keep_clear_of_the_limits() {
        let limited = JointRange { ends: (-1.0, 1.0), limited: true };
        assert_eq!(allowed_range(limited), (-1.0 + 2.0 * CLEAR_OF_LIMITS, 1.0 - 2.0 * CLEAR_OF_LIMITS));
    }

    #[test]
    fn without_limits_chosen_poses_go_as_far_as_the_joint_works() {
        let measured = JointRange { ends: (-1.0, 1.0), limited: false };
        assert_eq!(allowed_range(measured), (-1.0, 1.0));
    }
}
