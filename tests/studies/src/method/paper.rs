//! Yang & Siegel's table and figures, computed anew.

use std::io::Write as _;
use std::path::Path;

use plumb_report::figure;

use super::{StudyError, paper_curves};

/// Prints the table and the numbers and, where asked, writes the figures.
pub(crate) fn run(folder: Option<&Path>) -> Result<(), StudyError> {
    let mut output = std::io::stdout().lock();
    output.write_all(report().as_bytes())?;
    if let Some(folder) = folder {
        for drawn in paper_curves::figures() {
            figure::write(folder, &drawn)?;
        }
        writeln!(
            output,
            "\nfigures written to {} as SVG and CSV; for PNG: rsvg-convert -o figure.png figure.svg",
            folder.display()
        )?;
    }
    Ok(())
}

fn report() -> String {
    let mut text = String::from(
        "Yang & Siegel 1987, computed from plumb's kinematics (L1 = L2 = 177.8, H = 195.0, L3 = 109 mm)\n\n\
         Table 2-1: vertical error of the initialization, micron (Bi = 290, Br = 5 deg, K = 140, D = 117 mm)\n\
         further cycles            error\n",
    );
    for (cycle, error) in paper_curves::table_2_1().iter().enumerate() {
        text.push_str(&format!("{cycle:>14} {:>16}\n", six_digits(*error)));
    }
    text.push('\n');
    for statement in paper_curves::statements() {
        text.push_str(&format!(
            "{}\n    paper {:<14} here {}\n",
            statement.what, statement.paper, statement.ours
        ));
    }
    text
}

/// Six digits that count, in plain notation while that stays readable.
fn six_digits(value: f64) -> String {
    let magnitude = value.abs().log10().floor();
    if magnitude < -3.0 {
        format!("{value:.5e}")
    } else {
        format!("{value:.*}", (5.0 - magnitude).max(0.0) as usize)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn the_report_holds_the_papers_digits() {
        let report = report();
        for expected in [
            "-10138.6",
            "178.245",
            "-5.63521",
            "0.176579",
            "17 deg 15.2 min",
            "0.0909 deg",
            "not reproduced",
            "0.67",
            "13.8",
        ] {
            assert!(report.contains(expected), "{expected} is missing in:\n{report}");
        }
    }

    #[test]
    fn every_figure_is_drawn_and_tabled() {
        let folder = tempfile::tempdir().unwrap();
        run(Some(folder.path())).unwrap();
        for number in ["05", "06", "07", "08", "09", "10", "12"] {
            let names: Vec<_> = fs::read_dir(folder.path())
                .unwrap()
                .map(|entry| entry.unwrap().file_name().into_string().unwrap())
                .filter(|name| name.starts_with(&format!("figure-{number}")))
                .collect();
            assert_eq!(names.len(), 2, "figure {number}: {names:?}");
        }
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_named() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let error = run(Some(&file.path().join("below"))).unwrap_err();
        assert!(error.to_string().contains("--output"), "{error}");
    }
}
