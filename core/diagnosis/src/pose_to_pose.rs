//! Whether what goes with a condition (play, settling) is the same at every one of a few poses, and what it can be distinguished from where it is not.
//!
//! Returns to one pose in one way share whatever that pose and way are off by, so they are one observation of it, however many they are: a cell. Where the means of
//! cells lie farther from the fit than returns scatter, it is the cells that count (Scheffe 1959, The Analysis of Variance, section 4.3: interaction): effects are compared by them,
//! and standard errors follow from their scatter.

use nalgebra::Vector3;

use crate::fitted::Fitted;
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::noise_floor::Floor;
use crate::outcome::{Candidate, EffectSite, Named};
use crate::thresholds::{LACK_OF_FIT_LEVEL, TIE_BIC};
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect;
use plumb_estimation::{Progress, f_tail};

/// What a fit leaves of a row's points, mm, and which axes were measured.
pub(crate) fn point_residual(fitted: &Fitted<'_>, row: usize, measured: &mut [bool; 3]) -> Vector3<f64> {
    let mut point = Vector3::zeros();
    let observations = fitted.problem.observations;
    let own = fitted.fit.residuals.get(observations.range(row)).unwrap_or(&[]);
    for (equation, residual) in observations.of_row(row).iter().zip(own) {
        let Some(factor) = equation.factor_in(observations.unit()) else { continue };
        // A reading without a coordinate (a distance, a height) is a number of its own.
        let axis = equation.measurand.coordinate().unwrap_or(0);
        point[axis] += residual * factor;
        measured[axis] = true;
    }
    point
}

/// The means of cells, as a fit leaves them.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cells {
    /// Squares of the means, times the rows of each, mm2.
    squares: f64,
    /// Squares of all rows, mm2.
    of_rows: f64,
    /// Numbers that the cells have beyond those fitted.
    freedom: f64,
    /// Numbers that the rows have beyond those fitted.
    freedom_of_rows: f64,
    /// Rows of a cell, on the average.
    rows: f64,
}

impl Cells {
    /// Nothing where the cells are no more than what was fitted.
    fn of(fitted: &Fitted<'_>, cells: &[Vec<usize>]) -> Option<Self> {
        let mut measured = [false; 3];
        let (mut squares, mut of_rows) = (0.0, 0.0);
        for cell in cells {
            let points: Vec<Vector3<f64>> =
                cell.iter().map(|row| point_residual(fitted, *row, &mut measured)).collect();
            let mean = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
            squares += points.len() as f64 * mean.norm_squared();
            of_rows += points.iter().map(Vector3::norm_squared).sum::<f64>();
        }
        let axes = measured.iter().filter(|axis| **axis).count().max(1);
        let rows: usize = cells.iter().map(Vec::len).sum();
        let beyond = |numbers: usize| numbers.checked_sub(fitted.fit.rank()).filter(|freedom| *freedom > 0);
        let freedom = beyond(axes * cells.len())? as f64;
        let freedom_of_rows = beyond(axes * rows)? as f64;
        Some(Self { squares, of_rows, freedom, freedom_of_rows, rows: rows as f64 / cells.len() as f64 })
    }

    /// How much farther the means lie from the fit than rows do, as a ratio of variances.
    fn over_rows(&self) -> f64 {
        (self.squares / self.freedom) / (self.of_rows / self.freedom_of_rows).max(1e-300)
    }

    /// Whether they lie farther than the noise floor lets them.
    fn is_significant(&self, floor: &Floor) -> bool {
        let Some(sigma) = floor.sigma_mm else { return false };
        let ratio = self.squares / self.freedom / (sigma * sigma).max(1e-300);
        f_tail(ratio, self.freedom, floor.dof.max(1) as f64) < LACK_OF_FIT_LEVEL
    }

    /// Standard deviation of the means about the fit, mm.
    fn scatter_mm(&self) -> f64 {
        (self.squares / self.freedom / self.rows).sqrt()
    }
}

/// How a condition's effect goes from pose to pose.
pub(crate) enum FromPoseToPose {
    /// It is the same at every pose, as far as these rows show.
    Same,
    /// It differs, by this standard deviation, mm; its standard error is this many times that of rows that err by themselves.
    Differs { scatter_mm: f64, wider: f64 },
    /// It differs, and these do as well.
    Tied { scatter_mm: f64, tied: Vec<EffectSite> },
}

impl FromPoseToPose {
    /// What of a size may be named, with its standard error, and what is tied.
    pub(crate) fn of(self, sized: Named) -> (Option<Named>, Vec<EffectSite>) {
        match self {
            Self::Same => (Some(sized), Vec::new()),
            Self::Differs { wider, .. } => (Some(Named { se: wider * sized.se, ..sized }), Vec::new()),
            Self::Tied { tied, .. } => (None, tied),
        }
    }
}

impl Laboratory {
    /// Rows by pose and by the way in which every joint arrived; nothing where the ways are not logged.
    fn cells(&self, poses: &[Vec<usize>]) -> Option<Vec<Vec<usize>>> {
        let table = self.table();
        table.approach.as_ref()?;
        let ways =
            |row: usize| (0..table.joints).map(|joint| table.approach_of(row, joint)).collect::<Vec<_>>();
        let mut cells: Vec<Vec<usize>> = Vec::new();
        for pose in poses {
            let first = cells.len();
            for row in pose {
                let same =
                    |cell: &&mut Vec<usize>| cell.first().is_some_and(|other| ways(*other) == ways(*row));
                match cells.get_mut(first..).and_then(|own| own.iter_mut().find(same)) {
                    Some(cell) => cell.push(*row),
                    None => cells.push(vec![*row]),
                }
            }
        }
        Some(cells)
    }

    /// Whether an effect that was found beside an error of each pose's own (`self` has those) is the same at every pose, and what else does as well where it is not.
    pub(crate) fn judged_from_pose_to_pose(
        &self,
        poses: &[Vec<usize>],
        (effect, named): (&AddedEffect, &Named),
        (floor, candidates): (&Floor, &[Candidate]),
        progress: &Progress,
    ) -> Result<FromPoseToPose, LaboratoryError> {
        let Some(mut cells) = self.cells(poses) else { return Ok(FromPoseToPose::Same) };
        let fitted = self.fit_with(std::slice::from_ref(effect), None, progress)?;
        // A row far outside is no observation of a pose.
        let inliers = fitted.inliers();
        cells.iter_mut().for_each(|cell| cell.retain(|row| inliers.contains(row)));
        cells.retain(|cell| !cell.is_empty());
        let Some(own) = Cells::of(&fitted, &cells).filter(|own| own.is_significant(floor)) else {
            return Ok(FromPoseToPose::Same);
        };
        let mut tied = vec![named.effect.clone()];
        for candidate in candidates.iter().filter(|one| is_rival(one, &named.effect)) {
            let id = effect::parse(&candidate.label, self.model())?;
            let values = vec![0.0; effect::build(&id, self.model())?.parameters().len()];
            let fitted = self.fit_with(&[AddedEffect { id, values }], None, progress)?;
            let Some(other) = Cells::of(&fitted, &cells) else { continue };
            // Schwarz's criterion with the cells as observations; each has as many numbers as the other.
            if own.freedom * (other.squares / own.squares.max(1e-300)).ln() < TIE_BIC {
                tied.push(candidate.effect.clone());
            }
        }
        let scatter_mm = own.scatter_mm();
        Ok(match tied.len() {
            1 => FromPoseToPose::Differs { scatter_mm, wider: own.over_rows().sqrt().max(1.0) },
            _ => FromPoseToPose::Tied { scatter_mm, tied },
        })
    }
}

/// Whether a candidate is another condition of the same joint.
fn is_rival(candidate: &Candidate, named: &EffectSite) -> bool {
    let of_conditions = effect::kind(&candidate.effect.effect)
        .is_some_and(|kind| kind.depends_on_conditions && !kind.depends_on_time && !kind.is_event);
    of_conditions && candidate.plausible && candidate.effect.site == named.site && candidate.effect != *named
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise_floor::FloorSource;
    use crate::testing::{candidate, effect_at, two_links, with_table};

    /// Two cells of four rows each beyond what is fitted; squares of the means 8, of all rows 20 on ten degrees.
    const CELLS: Cells =
        Cells { squares: 8.0, of_rows: 20.0, freedom: 2.0, freedom_of_rows: 10.0, rows: 4.0 };

    #[test]
    fn means_of_cells_are_held_against_rows_and_against_the_noise() {
        assert!((CELLS.scatter_mm() - 1.0).abs() < 1e-12, "a mean of four rows: 8 / 2 / 4");
        assert!((CELLS.over_rows() - 2.0).abs() < 1e-12, "4 over 2");
        // P(F with 2 and 10 degrees > f) = (1 + f / 5)^-5.
        let edge = 5.0 * (LACK_OF_FIT_LEVEL.powf(-0.2) - 1.0);
        let at = |f: f64| {
            let sigma_mm = Some((4.0 / f).sqrt());
            let source = FloorSource::Repeats;
            CELLS.is_significant(&Floor {
                sigma_mm,
                source,
                dof: 10,
                scale: sigma_mm,
                allowed_for: Vec::new(),
            })
        };
        assert!(at(1.01 * edge) && !at(0.99 * edge));
        let unknown = Floor {
            sigma_mm: None,
            source: FloorSource::Unknown,
            dof: 0,
            scale: None,
            allowed_for: Vec::new(),
        };
        assert!(!CELLS.is_significant(&unknown));
    }

    #[test]
    fn a_cell_is_the_mean_of_its_rows_and_pays_for_what_was_fitted() {
        let lab = two_links(6, "", 0.05, 77, |_| [0.0; 2]);
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let mut measured = [false; 3];
        let points: Vec<Vector3<f64>> =
            (0..6).map(|row| point_residual(&fitted, row, &mut measured)).collect();
        assert_eq!(measured, [true; 3]);
        let cells = Cells::of(&fitted, &[vec![0, 1], vec![2, 3, 4, 5]]).unwrap();
        let mean =
            |rows: &[Vector3<f64>]| rows.iter().sum::<Vector3<f64>>().norm_squared() / rows.len() as f64;
        assert!((cells.squares - mean(&points[..2]) - mean(&points[2..])).abs() < 1e-12);
        assert!((cells.of_rows - points.iter().map(Vector3::norm_squared).sum::<f64>()).abs() < 1e-12);
        // Nothing is fitted: three numbers a cell, three a row.
        assert_eq!((cells.freedom, cells.freedom_of_rows, cells.rows), (6.0, 18.0, 3.0));
    }

    #[test]
    fn what_differs_is_named_with_the_error_of_its_poses_and_what_is_tied_is_not() {
        let effect = EffectSite {
            effect: "joint_backlash".to_owned(),
            site: "elbow".to_owned(),
            with: None,
            n: None,
            of: None,
            at: None,
        };
        let named = || Named { effect: effect.clone(), size: 0.1, unit: "deg".to_owned(), se: 0.01 };
        assert_eq!(FromPoseToPose::Same.of(named()), (Some(named()), Vec::new()));
        let (wider, tied) = FromPoseToPose::Differs { scatter_mm: 0.2, wider: 3.0 }.of(named());
        assert!((wider.unwrap().se - 0.03).abs() < 1e-12 && tied.is_empty());
        let (none, tied) = FromPoseToPose::Tied { scatter_mm: 0.2, tied: vec![effect.clone()] }.of(named());
        assert_eq!((none, tied), (None, vec![effect]));
    }

    #[test]
    fn another_condition_of_the_same_joint_is_a_rival_and_nothing_else_is() {
        let named = effect_at("joint_backlash", "elbow");
        assert!(is_rival(&candidate("joint_settling", "elbow"), &named));
        assert!(!is_rival(&candidate("joint_backlash", "elbow"), &named), "itself");
        assert!(!is_rival(&candidate("joint_settling", "shoulder"), &named), "at another joint");
        assert!(!is_rival(&candidate("joint_gain", "elbow"), &named), "it is the same at every return");
        assert!(!is_rival(&candidate("warm_up", "elbow"), &named), "it goes by time");
        assert!(!is_rival(&candidate("joint_step", "elbow"), &named), "it happened once");
        assert!(!is_rival(&candidate("nonsense", "elbow"), &named));
        let mad = Candidate { plausible: false, ..candidate("joint_settling", "elbow") };
        assert!(!is_rival(&mad, &named), "no machine has so much");
    }

    #[test]
    fn rows_of_one_pose_are_parted_by_how_every_joint_arrived() {
        let silent = two_links(6, "", 0.05, 78, |_| [0.0; 2]);
        let poses = [vec![0, 1, 2, 3], vec![4, 5]];
        assert_eq!(silent.cells(&poses), None, "not logged");
        let lab = with_table(&silent, |table| {
            table.approach = Some(vec![1, 1, -1, 1, 1, 1, 1, -1, 1, 1, 1, 1]);
        });
        // The second pose has cells of its own, though it was reached as the first was.
        assert_eq!(lab.cells(&poses), Some(vec![vec![0, 2], vec![1], vec![3], vec![4, 5]]));
    }

    #[test]
    fn what_a_fit_leaves_of_a_point_is_the_vector_of_its_coordinates() {
        let lab = two_links(6, "", 0.05, 77, |_| [0.0; 2]);
        let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let own = &fitted.fit.residuals[fitted.problem.observations.range(4)];
        let mut measured = [false; 3];
        let point = point_residual(&fitted, 4, &mut measured);
        assert!(point.norm() > 0.0 && point.as_slice() == own, "{point} {own:?}");
    }
}
