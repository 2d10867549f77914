//! How fast effects of gravity bend the arm of a row, and how these rates change with its configuration: kept from step to step of a fit.
//!
//! What an effect of gravity bends is linear in its parameters. So what is kept holds at any values of them; only where the arm hangs otherwise than it did then is it worked out
//! again.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::{DMatrix, Vector3};
use plumb_kinematics::Deviation;

use super::response::{Alone, CARRIED, DH_PARAMETERS};
use crate::effect::{Contribution, Dof};

/// Changes of a configuration within which slopes are kept, rad and mm. A slope is off by about a hundredth of itself a hundredth of a radian away (or a millimetre, of a link of
/// 100 mm), and what it is a part of, the response to a bend, is itself a thousandth of a derivative.
const KEPT_ROTATION: f64 = 1e-2;
const KEPT_SHIFT: f64 = 1.0;

/// Numbers kept for one problem at most, 32 MB: of a larger table slopes are worked out anew each time.
const MOST_KEPT: usize = 4_000_000;

/// One number of the arm that one parameter of an effect of gravity bends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bend {
    /// Which effect, by its index among those that take part, and which of its parameters.
    part: usize,
    parameter: usize,
    /// Numbers of joints' rows, then shift and turn of what bent links carry.
    pub(super) target: usize,
}

/// How fast each bend grows with its parameter, in one sample.
#[derive(Debug, Clone, Default)]
pub(super) struct Rates {
    pub(super) bends: Vec<Bend>,
    pub(super) rates: Vec<f64>,
    /// Where the next is looked for first: effects name what they bend in the same order each time.
    next: usize,
}

impl Rates {
    fn add(&mut self, bend: Bend, rate: f64) {
        let known = match self.bends.get(self.next) == Some(&bend) {
            true => Some(self.next),
            false => self.bends.iter().position(|known| *known == bend),
        };
        let index = known.unwrap_or(self.bends.len());
        if known.is_none() {
            self.bends.push(bend);
            self.rates.push(0.0);
        }
        if let Some(entry) = self.rates.get_mut(index) {
            *entry += rate;
        }
        self.next = index + 1;
    }

    /// Adds what an effect contributes.
    pub(super) fn add_contributions(&mut self, part: usize, contributions: &[Contribution], numbers: usize) {
        for Contribution { parameter, dof, rate } in contributions.iter().copied() {
            match dof {
                Dof::Joint(joint, dh_parameter) => {
                    if let Some(index) = DH_PARAMETERS.iter().position(|known| *known == dh_parameter) {
                        let target = joint * DH_PARAMETERS.len() + index;
                        self.add(Bend { part, parameter, target }, rate);
                    }
                }
                Dof::Twist { shift, rotation, about, .. } => {
                    // A turn about a point is a turn about the base's origin and a shift.
                    let shift = shift - rotation.cross(&about);
                    for (axis, amount) in shift.iter().chain(rotation.iter()).enumerate() {
                        self.add(Bend { part, parameter, target: numbers + axis }, amount * rate);
                    }
                }
                // Gravity bends nothing else.
                _ => {}
            }
        }
    }

    /// The same bends, none of which grows yet.
    pub(super) fn begin(&mut self) {
        self.rates.fill(0.0);
        self.next = 0;
    }
}

/// How the rates of one row change with each source, and the configuration in which they do.
#[derive(Debug, Clone)]
pub(super) struct Slopes {
    pub(super) down: Vector3<f64>,
    pub(super) deviations: Vec<Deviation>,
    pub(super) bends: Vec<Bend>,
    /// Sources (numbers of joints' rows, then turns of the base) by bends.
    pub(super) by_source: DMatrix<f64>,
}

/// Whether two rows differ so little that slopes at one hold at the other.
fn is_near(own: &Deviation, other: &Deviation) -> bool {
    let turns = [own.theta - other.theta, own.alpha - other.alpha, own.beta - other.beta];
    let shifts = [own.d - other.d, own.a - other.a];
    turns.iter().all(|rotation| rotation.abs() <= KEPT_ROTATION)
        && shifts.iter().all(|shift| shift.abs() <= KEPT_SHIFT)
}

impl Slopes {
    /// Whether they hold in this configuration too.
    pub(super) fn hold_at(&self, down: &Vector3<f64>, deviations: &[Deviation]) -> bool {
        (self.down - down).norm() <= KEPT_ROTATION
            && self.deviations.len() == deviations.len()
            && self.deviations.iter().zip(deviations).all(|(own, other)| is_near(own, other))
    }

    /// How what is bent changes with each source alone, at these values of the effects.
    pub(super) fn alone(&self, values: &[Vec<f64>], numbers: usize) -> Alone {
        let valued = |bend: &Bend| {
            let value = values.get(bend.part).and_then(|values| values.get(bend.parameter)).copied();
            value.filter(|value| *value != 0.0)
        };
        let mut driven: Vec<usize> =
            self.bends.iter().filter(|bend| valued(bend).is_some()).map(|bend| bend.target).collect();
        driven.retain(|target| *target < numbers);
        driven.sort_unstable();
        driven.dedup();
        let sources = self.by_source.nrows();
        let mut joints = DMatrix::zeros(driven.len(), sources);
        let mut carried = DMatrix::zeros(CARRIED, sources);
        for (bend, slopes) in self.bends.iter().zip(self.by_source.column_iter()) {
            let Some(value) = valued(bend) else { continue };
            let mut sums = match (driven.binary_search(&bend.target), bend.target.checked_sub(numbers)) {
                (Ok(index), _) => joints.row_mut(index),
                (Err(_), Some(axis)) if axis < CARRIED => carried.row_mut(axis),
                _ => continue,
            };
            sums.iter_mut().zip(slopes.iter()).for_each(|(sum, slope)| *sum += value * slope);
        }
        Alone { driven, joints, carried }
    }
}

/// Slopes that are kept from step to step, one entry a row.
#[derive(Debug, Default)]
pub(super) struct KeptSlopes {
    rows: Vec<Mutex<Option<Box<Slopes>>>>,
    /// Those of an earlier fit in which the same bends.
    earlier: Option<Arc<Self>>,
}

impl KeptSlopes {
    /// Room for so many rows, none known yet.
    pub(super) fn for_rows(rows: usize) -> Self {
        Self { rows: (0..rows).map(|_| Mutex::new(None)).collect(), earlier: None }
    }

    /// The same where an earlier fit of the same rows, in which the same bends, has left some.
    pub(super) fn after(earlier: &Arc<Self>) -> Self {
        Self { earlier: Some(Arc::clone(earlier)), ..Self::for_rows(earlier.rows.len()) }
    }

    /// What some slopes of earlier fits that hold in this configuration say; nothing where there are none.
    pub(super) fn earlier<T>(
        &self,
        row: usize,
        (down, deviations): (&Vector3<f64>, &[Deviation]),
        read: impl Fn(&Slopes) -> T,
    ) -> Option<T> {
        let mut earlier = self.earlier.as_ref();
        while let Some(kept) = earlier {
            let slopes = kept.of_row(row)?;
            if let Some(slopes) = slopes.as_ref().filter(|slopes| slopes.hold_at(down, deviations)) {
                return Some(read(slopes));
            }
            earlier = kept.earlier.as_ref();
        }
        None
    }

    /// Those of a row, for as long as they are looked at.
    pub(super) fn of_row(&self, row: usize) -> Option<MutexGuard<'_, Option<Box<Slopes>>>> {
        // Nobody panics while holding it, and what is in it is whole at all times.
        Some(self.rows.get(row)?.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Whether slopes of this size may be kept for every row.
    pub(super) fn have_room_for(&self, slopes: &Slopes) -> bool {
        self.rows.len().saturating_mul(slopes.by_source.len()) <= MOST_KEPT
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_kinematics::DhParameter;

    const NUMBERS: usize = 10;

    fn rotation_of(joint: usize, parameter: usize, rate: f64) -> Contribution {
        Contribution { parameter, dof: Dof::Joint(joint, DhParameter::Theta), rate }
    }

    #[test]
    fn rates_of_one_number_add_up_in_whatever_order_they_come() {
        let mut rates = Rates::default();
        rates.add_contributions(
            0,
            &[rotation_of(0, 0, 1.0), rotation_of(1, 0, 2.0), rotation_of(0, 0, 4.0)],
            NUMBERS,
        );
        rates.add_contributions(1, &[rotation_of(1, 0, 8.0)], NUMBERS);
        assert_eq!(rates.rates, [5.0, 2.0, 8.0]);
        rates.begin();
        rates.add_contributions(1, &[rotation_of(1, 0, 3.0)], NUMBERS);
        rates.add_contributions(0, &[rotation_of(1, 0, 1.0)], NUMBERS);
        assert_eq!(rates.rates, [0.0, 1.0, 3.0]);
        assert_eq!(rates.bends.iter().map(|bend| bend.target).collect::<Vec<_>>(), [0, 5, 5]);
    }

    #[test]
    fn a_turn_about_a_point_is_a_turn_about_the_origin_and_a_shift() {
        let (shift, rotation, about) = (Vector3::x(), Vector3::z(), Vector3::new(0.0, 2.0, 0.0));
        let mut rates = Rates::default();
        let dof = Dof::Twist { after: 0, shift, rotation, about };
        rates.add_contributions(0, &[Contribution { parameter: 0, dof, rate: 0.5 }], NUMBERS);
        // z x 2y = -2x, so that the origin moves by x + 2x.
        assert_eq!(rates.rates, [1.5, 0.0, 0.0, 0.0, 0.0, 0.5]);
        assert_eq!(rates.bends[0].target, NUMBERS);
    }

    #[test]
    fn slopes_hold_within_a_small_change_of_any_number_and_of_gravity() {
        let slopes = Slopes {
            down: -Vector3::z(),
            deviations: vec![Deviation::default(); 2],
            bends: Vec::new(),
            by_source: DMatrix::zeros(0, 0),
        };
        let with = |dh_parameter: DhParameter, amount: f64| {
            let mut deviations = slopes.deviations.clone();
            deviations[1].add(dh_parameter, amount);
            slopes.hold_at(&slopes.down, &deviations)
        };
        for rotation in [DhParameter::Theta, DhParameter::Alpha, DhParameter::Beta] {
            assert!(with(rotation, -0.99 * KEPT_ROTATION) && !with(rotation, -1.01 * KEPT_ROTATION));
        }
        for shift in [DhParameter::D, DhParameter::A] {
            assert!(with(shift, 0.99 * KEPT_SHIFT) && !with(shift, 1.01 * KEPT_SHIFT));
        }
        let tilted = |by: f64| slopes.hold_at(&Vector3::new(by, 0.0, -1.0), &slopes.deviations);
        assert!(tilted(0.99 * KEPT_ROTATION) && !tilted(1.01 * KEPT_ROTATION));
        assert!(!slopes.hold_at(&slopes.down, &[]), "another arm");
    }

    #[test]
    fn what_bends_changes_by_the_slopes_times_the_values() {
        let bend = |parameter, target| Bend { part: 1, parameter, target };
        let slopes = Slopes {
            down: -Vector3::z(),
            deviations: Vec::new(),
            bends: vec![bend(0, 3), bend(1, 3), bend(1, NUMBERS)],
            by_source: DMatrix::from_row_slice(2, 3, &[1.0, 10.0, 100.0, 2.0, 20.0, 200.0]),
        };
        let alone = slopes.alone(&[vec![7.0], vec![3.0, 0.5]], NUMBERS);
        assert_eq!(alone.driven, [3]);
        assert_eq!(alone.joints, DMatrix::from_row_slice(1, 2, &[8.0, 16.0]));
        assert_eq!(alone.carried.row(0).iter().copied().collect::<Vec<_>>(), [50.0, 100.0]);
        assert_eq!(alone.carried.sum(), 150.0);
        let without = slopes.alone(&[vec![7.0], vec![0.0, 0.0]], NUMBERS);
        assert_eq!((without.driven.len(), without.joints.nrows(), without.carried.sum()), (0, 0, 0.0));
    }

    #[test]
    fn slopes_of_earlier_fits_are_used_where_they_hold_the_nearest_first() {
        let at = |theta: f64| Slopes {
            down: -Vector3::z(),
            deviations: vec![Deviation { theta, ..Deviation::default() }],
            bends: Vec::new(),
            by_source: DMatrix::zeros(0, 0),
        };
        let first = Arc::new(KeptSlopes::for_rows(2));
        *first.of_row(0).unwrap() = Some(Box::new(at(0.0)));
        let second = Arc::new(KeptSlopes::after(&first));
        *second.of_row(0).unwrap() = Some(Box::new(at(0.1)));
        let third = KeptSlopes::after(&second);
        let found = |row: usize, theta: f64| {
            let requested = at(theta);
            third.earlier(row, (&requested.down, &requested.deviations), |slopes| slopes.deviations[0].theta)
        };
        assert_eq!([found(0, 0.1), found(0, 0.0), found(0, 0.2)], [Some(0.1), Some(0.0), None]);
        assert_eq!([found(1, 0.0), found(7, 0.0)], [None, None], "of these rows none are known");
        assert!(first.earlier(0, (&-Vector3::z(), &[]), |_| ()).is_none(), "it has no earlier ones");
    }

    #[test]
    fn of_a_table_that_is_too_large_nothing_is_kept() {
        let with = |sources: usize| Slopes {
            down: -Vector3::z(),
            deviations: Vec::new(),
            bends: Vec::new(),
            by_source: DMatrix::zeros(sources, 1),
        };
        let kept = KeptSlopes::for_rows(1000);
        assert!(
            kept.have_room_for(&with(MOST_KEPT / 1000)) && !kept.have_room_for(&with(MOST_KEPT / 1000 + 1))
        );
        assert!(kept.of_row(999).is_some_and(|row| row.is_none()) && kept.of_row(1000).is_none());
    }
}
