//! Whether probabilities mean what they say: of effects given 80 per cent, 80 in a hundred should be true (reliability diagram: Murphy & Winkler 1977, Applied
//! Statistics 26, 41), and how far they are off on the whole (Brier 1950, Monthly Weather Review 78, 1) beside the best constant guess.

use std::fmt::Write as _;

use plotters::prelude::*;
use serde::Serialize;

use crate::interval::{Proportion, Z95};

/// What was said, and whether it was so.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Forecast {
    /// Probability, 0 to 1.
    pub(crate) probability: f64,
    /// Whether it is true.
    pub(crate) came_true: bool,
}

impl Forecast {
    fn squared_error(&self) -> f64 {
        (self.probability - f64::from(u8::from(self.came_true))).powi(2)
    }
}

/// Ends of the bins: narrow where most forecasts lie, at both ends.
const EDGES: [f64; 8] = [0.0, 0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0];

/// Forecasts of about the same probability.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Bin {
    from: f64,
    to: f64,
    /// Their mean.
    diagnosed: f64,
    came_true: Proportion,
}

/// What some forecasts are worth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Reliability {
    bins: Vec<Bin>,
    forecasts: usize,
    /// Mean squared error, and its standard error.
    brier: [f64; 2],
    /// That of a guess that always says how often these forecasts came true.
    constant_guess: f64,
}

impl Reliability {
    /// Nothing of no forecasts.
    pub(crate) fn of(forecasts: &[Forecast]) -> Option<Self> {
        let count = forecasts.len() as f64;
        let errors: Vec<f64> = forecasts.iter().map(Forecast::squared_error).collect();
        let brier = (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / count)?;
        let variance =
            errors.iter().map(|error| (error - brier).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        let fraction = forecasts.iter().filter(|one| one.came_true).count() as f64 / count;
        let bin = |edges: &[f64]| {
            let [from, to] = *edges else { return None };
            let inside = |one: &&Forecast| one.probability >= from && (one.probability < to || to >= 1.0);
            let own: Vec<&Forecast> = forecasts.iter().filter(inside).collect();
            let diagnosed = own.iter().map(|one| one.probability).sum::<f64>() / own.len() as f64;
            (!own.is_empty()).then(|| Bin {
                from,
                to,
                diagnosed,
                came_true: Proportion::of(own.iter().map(|one| one.came_true)),
            })
        };
        Some(Self {
            bins: EDGES.windows(2).filter_map(bin).collect(),
            forecasts: forecasts.len(),
            brier: [brier, (variance / count).sqrt()],
            constant_guess: fraction * (1.0 - fraction),
        })
    }

    /// The diagram as a table.
    pub(crate) fn table(&self, title: &str) -> String {
        let mut text =
            format!("{title}\n{:<18}{:>14}{:>24}{:>8}\n", "probability, %", "said, mean", "true, %", "of");
        for bin in &self.bins {
            let range = format!("{:.0} to {:.0}", 100.0 * bin.from, 100.0 * bin.to);
            let came_true = &bin.came_true;
            let percent = format!(
                "{:.1} [{:.1}, {:.1}]",
                100.0 * came_true.value(),
                100.0 * came_true.low,
                100.0 * came_true.high
            );
            // Writing to a text cannot fail.
            let _ = writeln!(
                text,
                "{range:<18}{:>14.1}{percent:>24}{:>8}",
                100.0 * bin.diagnosed,
                came_true.trials
            );
        }
        let [brier, error] = self.brier;
        let _ = writeln!(
            text,
            "Brier score {brier:.4} [{:.4}, {:.4}]; of the best constant guess {:.4}; {} forecasts",
            (brier - Z95 * error).max(0.0),
            brier + Z95 * error,
            self.constant_guess,
            self.forecasts
        );
        text
    }

    /// The diagram as one SVG document: what was said against how often it was true, with 95 % intervals.
    ///
    /// # Errors
    /// What the drawing library reports, in its words.
    pub(crate) fn svg(&self, title: &str) -> Result<String, String> {
        let mut document = String::new();
        self.draw(title, &mut document).map_err(|error| error.to_string())?;
        Ok(document)
    }

    fn draw(&self, title: &str, document: &mut String) -> Result<(), Box<dyn std::error::Error>> {
        let area = SVGBackend::with_string(document, (640, 560)).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .caption(title, ("sans-serif", 16))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(56)
            .build_cartesian_2d(0.0..100.0, 0.0..100.0)?;
        let axes = ("probability given, %", "true, % (with 95 % interval)");
        chart.configure_mesh().light_line_style(WHITE).x_desc(axes.0).y_desc(axes.1).draw()?;
        let grey = RGBColor(150, 150, 150);
        chart.draw_series(LineSeries::new([(0.0, 0.0), (100.0, 100.0)], grey.stroke_width(1)))?;
        let blue = RGBColor(0, 90, 160);
        for bin in &self.bins {
            let (diagnosed, fraction) = (100.0 * bin.diagnosed, &bin.came_true);
            let interval = [(diagnosed, 100.0 * fraction.low), (diagnosed, 100.0 * fraction.high)];
            chart.draw_series(LineSeries::new(interval, blue.stroke_width(2)))?;
            chart.draw_series([Circle::new((diagnosed, 100.0 * fraction.value()), 5, blue.filled())])?;
        }
        area.present()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn forecasts(probability: f64, came_true: usize, of: usize) -> Vec<Forecast> {
        (0..of).map(|number| Forecast { probability, came_true: number < came_true }).collect()
    }

    #[test]
    fn the_score_is_brier_s_and_that_of_a_constant_guess_its_variance() {
        let diagnosed = [forecasts(0.9, 9, 10), forecasts(0.1, 2, 10)].concat();
        let reliability = Reliability::of(&diagnosed).unwrap();
        // 9 x .01 + .81 + 2 x .81 + 8 x .01, over 20; 11 of 20 are true.
        assert!((reliability.brier[0] - 2.6 / 20.0).abs() < 1e-12, "{reliability:?}");
        assert!((reliability.constant_guess - 0.55 * 0.45).abs() < 1e-12);
        assert_eq!(reliability.bins.len(), 2);
        assert_eq!((reliability.bins[0].came_true.count, reliability.bins[0].came_true.trials), (2, 10));
        assert!(Reliability::of(&[]).is_none());
    }

    #[test]
    fn certainty_is_in_the_last_bin_and_the_table_says_so() {
        let reliability = Reliability::of(&forecasts(1.0, 3, 3)).unwrap();
        let text = reliability.table("candidates");
        // Wilson's lower limit of 3 of 3: 3 / (3 + 1.96 squared).
        assert!(text.contains("95 to 100") && text.contains("100.0 [43.9, 100.0]"), "{text}");
        assert!(reliability.svg("candidates").unwrap().contains("probability given"));
    }
}
