//! A scan: its numbers, and what it has made so far.

use std::time::Duration;

use nalgebra::{IsometryMatrix3, Rotation3, Vector3};
use plumb_cloud::Cloud;
use plumb_plugin::StripeFault;

/// A scan with its numbers.
#[derive(Debug, PartialEq)]
pub(crate) struct Scan {
    pub(crate) from: Vector3<f64>,
    /// From the first stripe's middle to the last's.
    pub(crate) way: Vector3<f64>,
    pub(crate) stripes: usize,
    pub(crate) attitude: Rotation3<f64>,
    pub(crate) aim: Vector3<f64>,
}

impl Scan {
    /// The fraction of the way at which a stripe is, from 0 to 1.
    pub(crate) fn fraction(&self, stripe: usize) -> f64 {
        if self.stripes > 1 { stripe as f64 / (self.stripes - 1) as f64 } else { 0.0 }
    }
}

/// What a scan has made so far. A pause keeps it, so that the scan goes on where it was.
#[derive(Debug, Default)]
pub(crate) struct ScanProgress {
    pub(crate) cloud: Cloud,
    pub(crate) empty: EmptyPictures,
    /// The next stripe to be taken, counted from 0.
    pub(crate) next: usize,
    /// The picture the sensor works on.
    pub(crate) worked_on: Option<Exposed>,
    /// How long the arm was on its way.
    pub(crate) moving: Duration,
    /// How long the camera took for its pictures while the arm waited.
    pub(crate) exposing: Duration,
    /// How long it all took, pauses left out.
    pub(crate) lasted: Duration,
}

/// A picture that was taken and whose points have not been fetched.
#[derive(Debug, Clone)]
pub(crate) struct Exposed {
    pub(crate) stripe: usize,
    /// The sensor has worked on it when it has seen everything up to this moment; none for one that was waited for.
    pub(crate) time_ns: Option<u64>,
    pub(crate) capture: Capture,
}

/// Where the arm was for a picture.
#[derive(Debug, Clone)]
pub(crate) struct Capture {
    /// Its joints as the drive's with the zeros in force, rad or mm.
    pub(crate) pose: Vec<f64>,
    /// From which side each had arrived.
    pub(crate) approach: Vec<i8>,
    /// How fast each went, rad/s or mm/s.
    pub(crate) speeds: Vec<f64>,
    pub(crate) base_from_flange: IsometryMatrix3<f64>,
}

/// Pictures without a stripe, and why.
#[derive(Debug, Default)]
pub(crate) struct EmptyPictures {
    pub(crate) stripes: usize,
    pub(crate) faults: Vec<(StripeFault, usize)>,
}

impl EmptyPictures {
    pub(crate) fn add(&mut self, fault: StripeFault) {
        self.stripes += 1;
        match self.faults.iter_mut().find(|(known, _)| *known == fault) {
            Some((_, count)) => *count += 1,
            None => self.faults.push((fault, 1)),
        }
    }

    pub(crate) fn counts_by_cause(&self) -> String {
        let each = self.faults.iter().map(|(fault, count)| format!("{count} {}", fault.name()));
        each.collect::<Vec<_>>().join(", ")
    }

    /// What the most frequent fault is usually cured by.
    pub(crate) fn cure(&self) -> &'static str {
        match self.faults.iter().max_by_key(|(_, count)| *count).map(|(fault, _)| fault) {
            Some(StripeFault::Dark) => {
                "is the laser on, and does the sheet meet anything the camera sees there?"
            }
            Some(StripeFault::Bright) => "is the filter before the lens?",
            Some(StripeFault::Flat) => "turn the rig so that the stripe runs down the picture",
            Some(StripeFault::Ambiguous) => "what else shines there?",
            Some(StripeFault::Short) | None => "is the laser on, the filter in, the aim right?",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_pictures_are_counted_by_what_they_lack() {
        let mut pictures = EmptyPictures::default();
        for fault in [StripeFault::Dark, StripeFault::Flat, StripeFault::Dark] {
            pictures.add(fault);
        }
        let [dark, flat] = [StripeFault::Dark, StripeFault::Flat].map(StripeFault::name);
        assert_eq!((pictures.stripes, pictures.counts_by_cause()), (3, format!("2 {dark}, 1 {flat}")));
        assert!(pictures.cure().contains("is the laser on"), "{}", pictures.cure());
    }

    #[test]
    fn stripes_are_spread_evenly_from_the_first_to_the_last_of_the_way() {
        let scan = |stripes: usize| Scan {
            from: Vector3::zeros(),
            way: Vector3::x(),
            stripes,
            attitude: Rotation3::identity(),
            aim: Vector3::zeros(),
        };
        assert_eq!([0, 1, 2, 4].map(|stripe| scan(5).fraction(stripe)), [0.0, 0.25, 0.5, 1.0]);
        assert_eq!([0, 1].map(|stripe| scan(2).fraction(stripe)), [0.0, 1.0]);
        assert_eq!(scan(1).fraction(0), 0.0, "a single stripe is where the scan begins");
    }
}
