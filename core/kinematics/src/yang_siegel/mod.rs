//! The closed-form recursion of Yang & Siegel's shoulder and elbow initialization (1987, section 4).
//!
//! A hand with a proximity sensor is lowered by the shoulder until it is at a known height over the table, then
//! drawn inward by the elbow until the sensor crosses the line B at a known distance from the waist. The elbow is then
//! turned back by a fixed angle and the cycle repeated. Angles are absolute, from the horizontal: moving the shoulder
//! leaves the forearm's attitude as it was.
//!
//! Equation 3-4 is misprinted (a bracket and `L1` are missing); the recursion here follows from 3-1 to 3-3.

mod sensitivity;

use thiserror::Error;

pub use sensitivity::{hand_height_loss, start_tolerance, waist_spread};

/// The arm and the target of the procedure, mm and rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Initialization {
    /// Length of the upper arm `L1`, mm.
    pub upper_arm: f64,
    /// Length of the forearm `L2`, mm.
    pub forearm: f64,
    /// Height of the shoulder's axis over the table `H`, mm.
    pub shoulder_height: f64,
    /// Distance of line B from the waist's axis `K`, mm.
    pub edge_distance: f64,
    /// Height of the wrist at which the sensor fires `D`, mm.
    pub trigger_height: f64,
    /// Back rotation of the elbow between cycles `Br`, rad.
    pub back_rotation: f64,
}

/// Where the arm is at the end of one cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    /// Upper arm's angle `A`, rad.
    pub shoulder: f64,
    /// Forearm's angle `Bg`, rad.
    pub elbow: f64,
    /// Height of the wrist `Ywg`, mm.
    pub wrist_height: f64,
}

/// Why a cycle cannot be done.
#[derive(Debug, Error, PartialEq)]
pub enum InitializationError {
    /// The shoulder cannot bring the wrist to the trigger height.
    #[error("cycle {cycle}: no shoulder angle brings the wrist to {height} mm (sine {sine})")]
    HeightOutOfReach {
        /// Cycle, from 0.
        cycle: usize,
        /// The trigger height asked for, mm.
        height: f64,
        /// The sine it would take.
        sine: f64,
    },
    /// The elbow cannot bring the wrist to line B.
    #[error("cycle {cycle}: no elbow angle brings the wrist to line B at {distance} mm (cosine {cosine})")]
    EdgeOutOfReach {
        /// Cycle, from 0.
        cycle: usize,
        /// The distance asked for, mm.
        distance: f64,
        /// The cosine it would take.
        cosine: f64,
    },
}

impl Initialization {
    /// The machine and settings of Table 2-1. The paper does not print the geometry; these values reproduce its figures.
    pub fn table_2_1() -> Self {
        Self {
            upper_arm: 177.8,
            forearm: 177.8,
            shoulder_height: 195.0,
            edge_distance: 140.0,
            trigger_height: 117.0,
            back_rotation: 5.0_f64.to_radians(),
        }
    }

    /// Runs `count` cycles from the forearm's starting angle (rad).
    ///
    /// # Errors
    /// The height or the edge is out of the arm's reach in some cycle.
    pub fn cycles(&self, start: f64, count: usize) -> Result<Vec<Cycle>, InitializationError> {
        let mut forearm = start;
        let mut cycles = Vec::with_capacity(count);
        for cycle in 0..count {
            let sine =
                (self.trigger_height - self.shoulder_height - self.forearm * forearm.sin()) / self.upper_arm;
            if !(-1.0..=1.0).contains(&sine) {
                return Err(InitializationError::HeightOutOfReach {
                    cycle,
                    height: self.trigger_height,
                    sine,
                });
            }
            let shoulder = sine.asin();
            let cosine = (self.edge_distance - self.upper_arm * shoulder.cos()) / self.forearm;
            if !(-1.0..=1.0).contains(&cosine) {
                return Err(InitializationError::EdgeOutOfReach {
                    cycle,
                    distance: self.edge_distance,
                    cosine,
                });
            }
            let elbow = -cosine.acos();
            let wrist_height = self.shoulder_height + self.upper_arm * sine + self.forearm * elbow.sin();
            cycles.push(Cycle { shoulder, elbow, wrist_height });
            forearm = elbow + self.back_rotation;
        }
        Ok(cycles)
    }

    /// The wrist's height at the end of cycle `cycle` (the first is 0), mm.
    ///
    /// # Errors
    /// As [`Initialization::cycles`].
    pub fn wrist_height(&self, start: f64, cycle: usize) -> Result<f64, InitializationError> {
        let cycles = self.cycles(start, cycle + 1)?;
        Ok(cycles.last().map_or(f64::NAN, |last| last.wrist_height))
    }

    /// The wrist's height after each of `count` cycles less the height the cycles converge to, mm.
    ///
    /// # Errors
    /// As [`Initialization::cycles`].
    pub fn errors(&self, start: f64, count: usize) -> Result<Vec<f64>, InitializationError> {
        let settled = 60;
        let cycles = self.cycles(start, count.max(settled))?;
        let limit = cycles.last().map_or(0.0, |cycle| cycle.wrist_height);
        Ok(cycles.iter().take(count).map(|cycle| cycle.wrist_height - limit).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_2_1_comes_out_to_the_papers_digits() {
        let errors = Initialization::table_2_1().errors(290.0_f64.to_radians(), 7).unwrap();
        let micron: Vec<f64> = errors.iter().map(|error| error * 1e3).collect();
        // The paper cuts the first value after the decimal point and rounds the others; the OCR lost the last exponents.
        assert_eq!(micron[0].trunc(), -10138.0);
        assert_eq!(format!("{:.1}", micron[1]), "178.2");
        assert_eq!(format!("{:.3}", micron[2]), "-5.635");
        assert_eq!(format!("{:.4}", micron[3]), "0.1766");
        assert_eq!(format!("{:.1e}", micron[4]), "-5.5e-3");
        assert_eq!(format!("{:.1e}", micron[5]), "1.7e-4");
        assert!((micron[6] / -5.6e-6 - 1.0).abs() < 0.05, "{}", micron[6]);
    }

    #[test]
    fn cycles_converge_to_the_same_height_from_any_start_the_figure_allows() {
        let arm = Initialization::table_2_1();
        let limit = |start: f64| arm.cycles(start.to_radians(), 40).unwrap().pop().unwrap().wrist_height;
        for start in [253.0, 262.0, 270.0, 281.0, 287.0] {
            assert!((limit(start) - 116.958_309_995).abs() < 1e-8, "start {start}: {}", limit(start));
        }
    }

    #[test]
    fn a_height_out_of_reach_is_refused_with_its_sine() {
        let arm = Initialization { trigger_height: 700.0, ..Initialization::table_2_1() };
        let error = arm.cycles(-1.5, 1).unwrap_err();
        assert!(matches!(error, InitializationError::HeightOutOfReach { cycle: 0, .. }), "{error}");
    }
}
