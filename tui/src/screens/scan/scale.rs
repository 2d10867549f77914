//! A scale to hold against what is seen: a length that is good to read, and how long it is in the view.

use super::eye::{Eye, Viewpoint};

/// A length in the view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// mm.
    pub length_mm: f64,
    /// In units of the view: half of its shorter side is 1.
    pub in_view: f64,
}

impl Scale {
    /// Across the view, at most so long (units of the view). With a lens it holds in the middle, where the target is.
    pub(super) fn across(eye: &Eye, longest: f64) -> Self {
        Self::of(eye.span / 2.0, longest)
    }

    /// Along the thickness of a plane that is looked along, which is drawn larger than the rest; none from elsewhere.
    pub(super) fn of_thickness(eye: &Eye, longest: f64) -> Option<Self> {
        match eye.viewpoint {
            Viewpoint::EdgeOn { stretch, .. } => Some(Self::of(eye.span / 2.0 / stretch, longest)),
            Viewpoint::Around { .. } => None,
        }
    }

    fn of(mm_per_unit: f64, longest: f64) -> Self {
        let length_mm = good_length(longest * mm_per_unit);
        Self { length_mm, in_view: length_mm / mm_per_unit }
    }

    /// As it is written beside the bar.
    pub(super) fn label(&self, eye: &Eye) -> String {
        let is_lens = eye.opening > 0.0 && matches!(eye.viewpoint, Viewpoint::Around { .. });
        // Lengths are 1, 2 or 5 times a power of ten: they show no more digits than that.
        let digits = (-self.length_mm.log10().floor()).max(0.0) as usize;
        format!("{:.digits$} mm{}", self.length_mm, if is_lens { " in the middle" } else { "" })
    }
}

/// The greatest of 1, 2 and 5 times a power of ten that is not above this.
fn good_length(most: f64) -> f64 {
    let power = 10.0_f64.powf(most.max(f64::MIN_POSITIVE).log10().floor());
    // What is a power of ten but for its last bit is one.
    let within = most * (1.0 + 1e-9);
    [5.0, 2.0].into_iter().map(|times| times * power).find(|length| *length <= within).unwrap_or(power)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;

    #[test]
    fn a_scale_is_a_good_length_no_longer_than_there_is_room_and_as_long_as_it_says() {
        assert_eq!([0.07, 1.0, 4.99, 5.0, 999.0].map(good_length), [0.05, 1.0, 2.0, 5.0, 500.0]);
        let viewpoint = Viewpoint::EdgeOn { normal: Vector3::z(), along: Vector3::x(), stretch: 100.0 };
        let eye = Eye { target: Point3::origin(), viewpoint, opening: 0.0, span: 80.0 };
        let across = Scale::across(&eye, 0.6);
        assert_eq!((across.length_mm, across.label(&eye).as_str()), (20.0, "20 mm"));
        // As long in the view as two points so far apart.
        let end = eye.see(&Point3::new(across.length_mm, 0.0, 0.0)).unwrap();
        assert!((end.x - across.in_view).abs() < 1e-12);
        let up = Scale::of_thickness(&eye, 0.6).unwrap();
        assert_eq!(up.label(&eye), "0.2 mm");
        let end = eye.see(&Point3::new(0.0, 0.0, up.length_mm)).unwrap();
        assert!((end.y - up.in_view).abs() < 1e-12);
    }
}
