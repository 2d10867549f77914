//! What drives an effect: the quantity its own plot is drawn against.

use serde::Serialize;

use plumb_calibration::effect::{DrivenBy, EffectId, Site, kind, speed_fractions};
use plumb_calibration::fit::{ResidualModel, State};

/// What one axis of a plot shows.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PlotAxis {
    /// The quantity.
    pub shows: String,
    /// Its unit; empty for a pure number.
    pub unit: String,
}

impl PlotAxis {
    pub(crate) fn new(shows: impl Into<String>, unit: &str) -> Self {
        Self { shows: shows.into(), unit: unit.to_owned() }
    }

    /// `moment about shoulder, N m`.
    pub fn title(&self) -> String {
        match self.unit.as_str() {
            "" => self.shows.clone(),
            unit => format!("{}, {unit}", self.shows),
        }
    }
}

/// What an effect is driven by: the axis, and its value in every row.
pub(super) struct Regressor {
    pub(super) axis: PlotAxis,
    pub(super) values: Vec<f64>,
}

impl Regressor {
    /// What drives an effect in the rows of a table; nothing where it is more than one number.
    pub(super) fn of(problem: &ResidualModel<'_>, state: &State, id: &EffectId) -> Option<Self> {
        let joint = id.joint();
        match kind(&id.name)?.driven_by {
            DrivenBy::Moment => Some(moment(problem, state, joint?)),
            DrivenBy::Coordinate | DrivenBy::Waves => Some(coordinate(problem, joint?)),
            DrivenBy::OtherJoint => Some(coordinate(problem, id.with?)),
            DrivenBy::WayOfArrival => Some(side(problem, joint?)),
            DrivenBy::LastMove => Some(last_move(problem, joint?)),
            DrivenBy::Speed => Some(speed(problem, joint?)),
            DrivenBy::ScrewTurn => turn_of_screw(problem, joint?),
            DrivenBy::Temperature => temperature(problem),
            DrivenBy::Time => Some(time(problem)),
            DrivenBy::RowOrder => Some(order(problem)),
            DrivenBy::InstrumentAxis => axis_of_instrument(problem, state, id),
            DrivenBy::Weights | DrivenBy::Several => None,
        }
    }

    fn over_rows(problem: &ResidualModel<'_>, axis: PlotAxis, value: impl Fn(usize) -> f64) -> Self {
        Self { axis, values: (0..problem.table.len()).map(value).collect() }
    }
}

fn name_of(problem: &ResidualModel<'_>, joint: usize) -> String {
    problem.model.site_name(Site::Joint(joint))
}

/// A joint's coordinate as it is shown, and its unit.
fn shown(problem: &ResidualModel<'_>, joint: usize) -> (f64, &'static str) {
    if problem.model.slides(joint) { (1.0, "mm") } else { (1.0_f64.to_degrees(), "deg") }
}

fn commanded(problem: &ResidualModel<'_>, row: usize, joint: usize) -> f64 {
    problem.table.q_of(row).get(joint).copied().unwrap_or(0.0)
}

fn coordinate(problem: &ResidualModel<'_>, joint: usize) -> Regressor {
    let (factor, unit) = shown(problem, joint);
    let axis = PlotAxis::new(name_of(problem, joint), unit);
    Regressor::over_rows(problem, axis, |row| commanded(problem, row, joint) * factor)
}

/// Where within a turn of its screw a slide is.
fn turn_of_screw(problem: &ResidualModel<'_>, joint: usize) -> Option<Regressor> {
    let pitch = problem.model.chain.joints.get(joint)?.screw_pitch?;
    let axis = PlotAxis::new(format!("{} within a turn of its screw", name_of(problem, joint)), "mm");
    Some(Regressor::over_rows(problem, axis, |row| commanded(problem, row, joint).rem_euclid(pitch)))
}

/// The moment of gravity about a joint.
fn moment(problem: &ResidualModel<'_>, state: &State, joint: usize) -> Regressor {
    let axis = PlotAxis::new(format!("moment about {}", name_of(problem, joint)), "N m");
    Regressor::over_rows(problem, axis, |row| {
        problem.row_details(state, row).moments.get(joint).copied().unwrap_or(0.0)
    })
}

/// The way in which a joint arrived: as it was logged, else its way from the row before.
fn side(problem: &ResidualModel<'_>, joint: usize) -> Regressor {
    let axis = PlotAxis::new(
        format!("way in which {} arrived (1: its coordinate grew)", name_of(problem, joint)),
        "",
    );
    if problem.table.approach.is_some() {
        return Regressor::over_rows(problem, axis, |row| f64::from(problem.table.approach_of(row, joint)));
    }
    let mut values = last_move(problem, joint).values;
    // The sign of zero is one in floating point; a joint at rest came from neither side.
    values.iter_mut().for_each(|moved| *moved = if *moved == 0.0 { 0.0 } else { moved.signum() });
    Regressor { axis, values }
}

/// How far a joint moved from the row before, in the order of time.
fn last_move(problem: &ResidualModel<'_>, joint: usize) -> Regressor {
    let (factor, unit) = shown(problem, joint);
    let axis = PlotAxis::new(format!("last move of {}", name_of(problem, joint)), unit);
    let before = problem.table.rows_before();
    Regressor::over_rows(problem, axis, |row| {
        let before = before.get(row).copied().flatten();
        before.map_or(0.0, |before| {
            factor * (commanded(problem, row, joint) - commanded(problem, before, joint))
        })
    })
}

/// How fast a joint went in the move from the row before, of the fastest joint of its kind.
fn speed(problem: &ResidualModel<'_>, joint: usize) -> Regressor {
    let axis = PlotAxis::new(format!("speed of {} in the last move (1: full)", name_of(problem, joint)), "");
    Regressor { axis, values: speed_fractions(&problem.model.chain, problem.table, joint) }
}

/// The temperature; nothing where it is not logged.
fn temperature(problem: &ResidualModel<'_>) -> Option<Regressor> {
    let column = problem.table.temperature.as_ref()?;
    Some(Regressor { axis: PlotAxis::new("temperature", "deg C"), values: column.clone() })
}

/// The rank of each row in the order of time.
fn order(problem: &ResidualModel<'_>) -> Regressor {
    let mut ranks = vec![0.0; problem.table.len()];
    for (index, row) in problem.table.order().into_iter().enumerate() {
        if let Some(slot) = ranks.get_mut(row) {
            *slot = index as f64 + 1.0;
        }
    }
    Regressor { axis: PlotAxis::new("order of the rows", ""), values: ranks }
}

/// The time where it is logged, else the order of the rows.
fn time(problem: &ResidualModel<'_>) -> Regressor {
    match &problem.table.time {
        Some(column) => Regressor { axis: PlotAxis::new("time", "s"), values: column.clone() },
        None => order(problem),
    }
}

/// The coordinate of the point along the axis of the instrument that an effect acts on.
fn axis_of_instrument(problem: &ResidualModel<'_>, state: &State, id: &EffectId) -> Option<Regressor> {
    let Site::Axis(axis) = id.site else { return None };
    let title = PlotAxis::new(format!("{} of the point", problem.model.site_name(id.site)), "mm");
    Some(Regressor::over_rows(problem, title, |row| {
        problem.believed_point(state, row).get(axis).copied().unwrap_or(0.0)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links;
    use plumb_estimation::Progress;

    /// What drives an effect of the elbow, and the elbow's angles, deg.
    fn driven(name: &str) -> (Regressor, Vec<f64>) {
        let lab = two_links(12, "", 0.05, 74, |_| [0.0; 2]);
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let found =
            Regressor::of(&fitted.problem, &fitted.fit.state, &EffectId::at(name, Site::Joint(1))).unwrap();
        (found, (0..12).map(|row| lab.table().q_of(row)[1].to_degrees()).collect())
    }

    #[test]
    fn an_effect_is_drawn_against_what_drives_it() {
        let (gain, elbow) = driven("joint_gain");
        assert_eq!((gain.axis.title().as_str(), &gain.values), ("elbow, deg", &elbow));
        let (settling, elbow) = driven("joint_settling");
        assert_eq!((settling.axis.title().as_str(), settling.values[0]), ("last move of elbow, deg", 0.0));
        for row in 1..12 {
            assert!((settling.values[row] - (elbow[row] - elbow[row - 1])).abs() < 1e-9);
        }
        let (backlash, elbow) = driven("joint_backlash");
        assert_eq!(backlash.axis.title(), "way in which elbow arrived (1: its coordinate grew)");
        assert_eq!(backlash.values[0], 0.0, "the first row arrived from nowhere that is known");
        assert!((1..12).all(|row| backlash.values[row] == (elbow[row] - elbow[row - 1]).signum()));
    }

    #[test]
    fn a_condition_is_drawn_as_it_was_logged_and_the_order_of_the_rows_by_their_times() {
        let plain = two_links(4, "", 0.05, 74, |_| [0.0; 2]);
        let lab = crate::testing::with_table(&plain, |table| {
            table.temperature = Some(vec![20.0, 21.5, 22.0, 20.5]);
            table.time = Some(vec![30.0, 10.0, 40.0, 20.0]);
        });
        let drawn = |lab: &crate::laboratory::Laboratory, id: EffectId| {
            let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
            let found = Regressor::of(&fitted.problem, &fitted.fit.state, &id);
            found.map(|found| (found.axis.title(), found.values))
        };
        let heat = EffectId::at("thermal_growth", Site::Joint(1));
        assert_eq!(drawn(&plain, heat.clone()), None, "not logged");
        let expected = ("temperature, deg C".to_owned(), vec![20.0, 21.5, 22.0, 20.5]);
        assert_eq!(drawn(&lab, heat), Some(expected));
        let warm = EffectId::at("warm_up", Site::Joint(1));
        assert_eq!(drawn(&lab, warm.clone()), Some(("time, s".to_owned(), vec![30.0, 10.0, 40.0, 20.0])));
        let in_turn = Some(("order of the rows".to_owned(), vec![1.0, 2.0, 3.0, 4.0]));
        assert_eq!(drawn(&plain, warm), in_turn);
        let reset = EffectId::at("base_reset", Site::Base);
        assert_eq!(drawn(&lab, reset), Some(("order of the rows".to_owned(), vec![3.0, 1.0, 4.0, 2.0])));
        assert_eq!(drawn(&lab, EffectId::at("base_position", Site::Base)), None, "more than one number");
        // The tip of the arm along x.
        let (title, values) = drawn(&lab, EffectId::at("scale", Site::Axis(0))).unwrap();
        assert!(title.ends_with("of the point, mm"), "{title}");
        for (row, value) in values.iter().enumerate() {
            let [first, second] = [0, 1].map(|joint| lab.table().q_of(row)[joint]);
            let x = 200.0 * first.cos() + 150.0 * (first + second).cos();
            assert!((value - x).abs() < 1e-9, "{value} {x}");
        }
        assert_eq!(drawn(&lab, EffectId::at("scale", Site::Base)), None);
    }

    #[test]
    fn a_slide_is_drawn_in_mm_and_its_screw_within_a_turn() {
        let model = "arm: axes\nconvention: distal\njoints:\n  - {name: turn, a_mm: 100}\n  - {name: slide, slides: true, screw_pitch_mm: 5}\ntargets: {p1: {}}\nmeasured_from: world\n";
        let model = plumb_calibration::arm_model::Model::parse("m.yaml", model).unwrap();
        let rows: String = [3.0, -1.0, 12.0].map(|slide| format!("10,{slide},1,2,3\n")).concat();
        let text = format!("q1_deg,q2_mm,p1_x_mm,p1_y_mm,p1_z_mm\n{rows}");
        let table = plumb_calibration::table::Table::parse("t.csv", &text).unwrap();
        let lab =
            crate::laboratory::Laboratory::new(model, table, crate::laboratory::Options::default()).unwrap();
        let problem = lab.problem(&[]).unwrap();
        let screw = turn_of_screw(&problem, 1).unwrap();
        assert_eq!((screw.axis.unit.as_str(), screw.values), ("mm", vec![3.0, 4.0, 2.0]));
        assert!(turn_of_screw(&problem, 0).is_none() && turn_of_screw(&problem, 7).is_none());
        assert_eq!(coordinate(&problem, 1).values, [3.0, -1.0, 12.0]);
        assert_eq!(last_move(&problem, 1).values, [0.0, -4.0, 13.0]);
        assert!(coordinate(&problem, 0).values.iter().all(|angle| (angle - 10.0).abs() < 1e-12));
        assert_eq!(side(&problem, 1).values, [0.0, -1.0, 1.0]);
    }
}
