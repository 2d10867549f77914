//! How an arm that bends under its own weight responds to small changes: what turns a link turns its weight as well, and with that all that the weight bends.
//!
//! With `b = f(x)` what gravity bends in a configuration `x`, and the bends among what makes the configuration, a small change `s` gives `db = (I - F_b)^-1 F_s ds` (implicit function theorem:
//! Nocedal and Wright 2006, Numerical Optimization, theorem A.2). Without it derivatives are good to first order in the bends only, and a fit of large ones creeps or ends early.

use nalgebra::{DMatrix, Vector3};
use plumb_kinematics::DhParameter;

/// The numbers of a joint's row, in the order in which they are kept here.
pub(super) const DH_PARAMETERS: [DhParameter; 5] =
    [DhParameter::Theta, DhParameter::Alpha, DhParameter::Beta, DhParameter::D, DhParameter::A];

/// Of these, those that turn what follows. The others move only where it hangs: that matters to moments, and to where bent links turn.
pub(super) const TURNS: usize = 3;

/// Numbers of a bend besides those of the joints' rows: shift and turn of what bent links carry.
pub(super) const CARRIED: usize = 6;

/// How what gravity bends changes with each source while all else stays.
#[derive(Debug, Clone)]
pub(super) struct Alone {
    /// Which numbers of joints' rows change, in rising order.
    pub(super) driven: Vec<usize>,
    /// By how much, per unit of each source: driven numbers by sources.
    pub(super) joints: DMatrix<f64>,
    /// Shift (mm) and turn (rad) of what bent links carry, base frame, per unit of each source.
    pub(super) carried: DMatrix<f64>,
}

/// How what gravity bends responds to each number of a joint's row and to turns of the base; empty for an arm that does not bend.
#[derive(Debug, Clone, Default)]
pub(crate) struct Response {
    /// Which numbers of joints' rows respond.
    driven: Vec<usize>,
    /// By how much, per unit of each source: driven numbers by sources.
    joints: DMatrix<f64>,
    /// Shift (mm) and turn (rad) of what bent links carry, base frame, per unit of each source.
    carried: DMatrix<f64>,
}

/// The response to one source: numbers of joints' rows with their changes, and the shift and turn of what bent links carry.
pub(super) struct ResponseTo<'y> {
    response: &'y Response,
    source: usize,
}

impl ResponseTo<'_> {
    /// Joints, their numbers, and by how much these change.
    pub(super) fn joints(&self) -> impl Iterator<Item = (usize, DhParameter, f64)> + '_ {
        let amounts = self.response.joints.column(self.source);
        let known = self.response.driven.iter().zip(amounts.into_iter().copied());
        known.filter_map(|(number, amount)| {
            Some((number / DH_PARAMETERS.len(), *DH_PARAMETERS.get(number % DH_PARAMETERS.len())?, amount))
        })
    }

    /// Shift about the base's origin, mm, and turn, rad.
    pub(super) fn carried(&self) -> (Vector3<f64>, Vector3<f64>) {
        let column = self.response.carried.column(self.source);
        (column.fixed_rows::<3>(0).into_owned(), column.fixed_rows::<3>(3).into_owned())
    }
}

impl Response {
    /// The response to a number of a joint's row.
    pub(super) fn to_joint(&self, joint: usize, dh_parameter: DhParameter) -> Option<ResponseTo<'_>> {
        let index = DH_PARAMETERS.iter().position(|known| *known == dh_parameter)?;
        self.to_source(joint * DH_PARAMETERS.len() + index)
    }

    /// The response to a turn of the base about an axis of the frame of the measurements.
    pub(super) fn to_base_rotation(&self, axis: usize) -> Option<ResponseTo<'_>> {
        self.to_source(self.joints.ncols().checked_sub(3)? + axis)
    }

    fn to_source(&self, source: usize) -> Option<ResponseTo<'_>> {
        (source < self.joints.ncols()).then_some(ResponseTo { response: self, source })
    }

    /// From how what is bent changes with each source alone; the first sources are the numbers of the joints' rows.
    pub(super) fn of(alone: Alone) -> Self {
        let Alone { driven, joints: by_sources, carried } = alone;
        // What responds makes the rest respond in turn.
        let back = DMatrix::identity(driven.len(), driven.len()) - by_sources.select_columns(&driven);
        // An arm that falls over at the least change has no balance to respond from: the derivatives are then good to first order.
        let solved = if driven.is_empty() { None } else { back.lu().solve(&by_sources) };
        let joints = solved.unwrap_or(by_sources);
        let carried = carried.select_columns(&driven) * &joints + carried;
        Self { driven, joints, carried }
    }
}
