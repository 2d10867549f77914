//! Worlds that hide an effect behind their wrong zeros: what the classical procedure leaves, what the model lab makes of it, and how far the tip is off.

use std::fmt;

use plumb_calibration::revision::Family;
use plumb_calibration::table::Table;
use plumb_diagnosis::laboratory::{Laboratory, Options, RowResidual};
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;
use serde_json::Value;

use super::cells::Cells;
use super::poses;

/// What is left of a tip that is known as well as the tracker shows it (0.05 mm a coordinate), mm.
pub(crate) const FLOOR_MM: f64 = 0.0866;

/// Rounds of next poses at most, before the tour.
const ROUNDS: usize = 2;

/// What is hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Hidden {
    /// The shoulder gives way under the weight it carries.
    Compliance,
    /// A wheel of a joint of the arm runs out of true.
    Wheel,
    /// Bending the wrist turns the flange.
    Coupling,
    /// A joint has play.
    Backlash,
}

/// How far the tip is off over the fresh poses.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Tip {
    /// Root mean square of measured less believed, mm.
    pub(crate) tip_mm: f64,
    /// Root mean square distance of one point reached lefty from the same reached righty, mm, beyond what was believed.
    pub(crate) apart_mm: f64,
    /// The greatest of these distances, mm.
    pub(crate) most_apart_mm: f64,
}

/// What the lab found with one kind of instrument.
#[derive(Debug, Clone, Default)]
pub(crate) struct Findings {
    /// The verdict after the calibration alone and after each round of next poses, in words.
    pub(crate) verdicts: Vec<String>,
    /// Poses measured beyond the calibration.
    pub(crate) poses: usize,
    /// What was named and added: effect, site, size.
    pub(crate) added: Vec<(String, String, f64)>,
    /// What was added of several that these poses cannot distinguish.
    pub(crate) either: Option<String>,
    /// What is then left over the fresh poses, which no fit has seen.
    pub(crate) left: Tip,
}

/// One world, from the first day to the last.
#[derive(Debug, Clone)]
pub(crate) struct Story {
    pub(crate) seed: u64,
    pub(crate) drawn: Drawn,
    pub(crate) before: Tip,
    pub(crate) after: Tip,
    pub(crate) with_tracker: Findings,
    /// With the ruler in the tracker's place, where that was asked for.
    pub(crate) by_hand: Option<Findings>,
}

/// What a world hides.
#[derive(Debug, Clone)]
pub(crate) struct Drawn {
    /// The effect as the lab calls it.
    pub(crate) effect: &'static str,
    /// The joint it sits at.
    pub(crate) site: String,
    /// How much of it there is, with its unit.
    pub(crate) size: String,
    /// As people call it.
    pub(crate) words: &'static str,
    /// The entry of `imperfections` in the world's file.
    pub(crate) imperfection: String,
}

impl Hidden {
    pub(crate) const ALL: [Self; 4] = [Self::Compliance, Self::Wheel, Self::Coupling, Self::Backlash];

    /// What the world of this seed hides.
    pub(crate) fn of_seed(self, seed: u64) -> Drawn {
        let (site, size, imperfection) = self.drawn(seed);
        Drawn { effect: self.effect(), site, size, words: self.in_words(), imperfection }
    }

    /// The effect as the lab calls it.
    fn effect(self) -> &'static str {
        match self {
            Self::Compliance => "joint_compliance",
            Self::Wheel => "joint_harmonic",
            Self::Coupling => "joint_coupling",
            Self::Backlash => "joint_backlash",
        }
    }

    /// As people call it.
    fn in_words(self) -> &'static str {
        match self {
            Self::Compliance => "shoulder gives way",
            Self::Wheel => "wheel out of true",
            Self::Coupling => "wrist coupling",
            Self::Backlash => "play",
        }
    }

    /// Where it sits, how much, and the lines of the world's file.
    fn drawn(self, seed: u64) -> (String, String, String) {
        let fraction =
            ((seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ self as u64) >> 11) as f64 / (1_u64 << 53) as f64;
        match self {
            Self::Compliance => {
                let softness = 3e-5 + 6e-5 * fraction;
                let text = format!("{{joint_compliance: {{joint: shoulder, rad_per_nm: {softness:.3e}}}}}");
                ("shoulder".to_owned(), format!("{softness:.2e} rad/(N m)"), text)
            }
            Self::Wheel => {
                let joint = ["waist", "shoulder", "elbow"][(seed % 3) as usize];
                let (amplitude, phase) = (0.12 + 0.16 * fraction, (seed * 77) % 360);
                let text = format!(
                    "{{joint_harmonic: {{joint: {joint}, per_turn: 1, amplitude_deg: {amplitude:.3}, phase_deg: {phase}}}}}"
                );
                (joint.to_owned(), format!("{amplitude:.3} deg"), text)
            }
            Self::Coupling => {
                let drag = 0.01 + 0.02 * fraction;
                let text = format!(
                    "{{joint_coupling: {{joint: flange, driver: wrist_bend, deg_per_deg: {drag:.4}}}}}"
                );
                ("flange".to_owned(), format!("{drag:.4} deg/deg"), text)
            }
            Self::Backlash => {
                let joint = ["shoulder", "elbow"][(seed % 2) as usize];
                let width = 0.12 + 0.16 * fraction;
                let text = format!("{{joint_backlash: {{joint: {joint}, width_deg: {width:.3}}}}}");
                (joint.to_owned(), format!("{width:.3} deg"), text)
            }
        }
    }
}

impl Findings {
    /// Whether the truth, and nothing else, was named.
    pub(crate) fn names(&self, hidden: &Drawn) -> bool {
        matches!(self.added.as_slice(), [(effect, joint, _)] if effect == hidden.effect && *joint == hidden.site)
    }
}

/// Lives through a world: fresh poses, the calibration, fresh poses again; then the lab with a tracker, and if wanted once more with the ruler alone.
pub(crate) fn run_story(drawn: Drawn, seed: u64, by_hand: bool) -> Story {
    let cells = world_of(&drawn, seed);
    let tour = std::fs::read_to_string(cells.puma().join("poses.csv")).unwrap();
    let lab = Lab { cells: &cells, tour, fresh: poses::fresh(&cells.puma().join("lab.yaml"), seed) };
    let before = lab.measure_fresh();
    let calibration = lab.run("calibrate");
    let after = lab.measure_fresh();
    let (before, after) = (lab.tip_of(before), lab.tip_of(after));
    let (with_tracker, _) = lab.learn("measure-tip", calibration, ROUNDS);
    let by_hand = by_hand.then(|| lab.learn("measure-heights", calibration, ROUNDS).0);
    let story = Story { seed, drawn: drawn.clone(), before, after, with_tracker, by_hand };
    let keep = cells.puma().join("potcal.txt");
    assert!(keep.exists(), "the controller kept what POTCAL wrote");
    story
}

/// A user's folder around the sealed world.
fn world_of(drawn: &Drawn, seed: u64) -> Cells {
    let cells = Cells::new();
    let imperfection = &drawn.imperfection;
    cells.change_world(|text| {
        let text = text.replace("seed: 1\n", &format!("seed: {seed}\ncalibration: potcal.txt\n"));
        text.replace("    base:", &format!("    imperfections: [{imperfection}]\n    base:"))
    });
    std::fs::rename(cells.puma().join("world.yaml"), cells.puma().join("open.yaml")).unwrap();
    assert_eq!(cells.plumb(&["world", "--file", "open.yaml", "--seal", "world.yaml"]).0, Some(0));
    cells
}

/// The same in the least steps: the calibration, ten poses, the tour and fresh poses, all with the tracker. The tip before the calibration is not looked at.
pub(crate) fn run_short_story(drawn: Drawn, seed: u64) -> Story {
    let cells = world_of(&drawn, seed);
    let tour = std::fs::read_to_string(cells.puma().join("poses.csv")).unwrap();
    let lab = Lab { cells: &cells, tour, fresh: poses::fresh(&cells.puma().join("lab.yaml"), seed) };
    let calibration = lab.run("calibrate");
    let (with_tracker, fresh) = lab.learn("measure-tip", calibration, 1);
    let after = lab.tip_of(fresh);
    Story { seed, drawn, before: Tip::default(), after, with_tracker, by_hand: None }
}

struct Lab<'a> {
    cells: &'a Cells,
    /// The poses that come with the cell.
    tour: String,
    /// Poses that no fit sees.
    fresh: String,
}

impl Lab<'_> {
    /// Runs a procedure; the run's number. A calibration whose second pass finds something has calibrated all the same.
    fn run(&self, procedure: &str) -> i64 {
        let (code, output, message) =
            self.cells.plumb(&["run", "cell.yaml", procedure, "--headless", "--record", "record"]);
        assert!(matches!(code, Some(0 | 1)), "{procedure}: {output}\n{message}");
        let (_, json, _) = self.cells.plumb(&["show", "--record", "record", "--json"]);
        let shown: Value = serde_json::from_str(&json).unwrap();
        shown["run"]["run"].as_i64().unwrap()
    }

    /// Measures the poses of a table.
    fn measure(&self, procedure: &str, poses: &str, findings: &mut Findings) -> i64 {
        findings.poses += poses.lines().count() - 1;
        self.cells.write("poses.csv", poses);
        self.run(procedure)
    }

    fn measure_fresh(&self) -> i64 {
        self.cells.write("poses.csv", &self.fresh);
        self.run("measure-tip")
    }

    /// Writes the rows of some runs as one table.
    fn table(&self, runs: &[i64]) {
        let runs: Vec<String> = runs.iter().map(i64::to_string).collect();
        let mut arguments = vec!["show", "--record", "record", "--table", "--as-left"];
        arguments.extend(runs.iter().map(String::as_str));
        let (code, table, output) = self.cells.plumb(&arguments);
        assert_eq!(code, Some(0), "{output}");
        self.cells.write("table.csv", &table);
    }

    fn model(&self, arguments: &[&str]) -> String {
        self.model_with(arguments, &[])
    }

    /// A command of the lab, with what follows the model's file.
    fn model_with(&self, arguments: &[&str], behind: &[&str]) -> String {
        let mut all = vec!["model"];
        all.extend(arguments);
        all.push("lab.yaml");
        all.extend(behind);
        all.extend(["--data", "table.csv"]);
        let (code, output, message) = self.cells.plumb(&all);
        assert_eq!(code, Some(0), "{arguments:?}: {message}");
        output
    }

    /// What is left of the tip where nothing but the position of the arm's foot is fitted: the arm as its controller believes it.
    fn tip_of(&self, run: i64) -> Tip {
        self.table(&[run]);
        tip(&self.residuals(Some(Vec::new()), Holdout::None))
    }

    /// What the lab finds after the calibration and at most so many rounds of next poses, and the fresh poses as the grown model foretells them; and the run that
    /// has measured those.
    fn learn(&self, procedure: &str, calibration: i64, rounds: usize) -> (Findings, i64) {
        let mut runs = vec![calibration];
        let mut findings = Findings::default();
        loop {
            self.table(&runs);
            // Ruler and level alone are asked only where there is time for it.
            if runs.len() > 1 || rounds > 1 {
                let diagnosis: Value = serde_json::from_str(&self.model(&["diagnose", "--json"])).unwrap();
                findings.verdicts.push(in_words(&diagnosis));
                if runs.len() > 1 && diagnosis["verdict"] == "named" || runs.len() > rounds {
                    break;
                }
            }
            let keep_out = ["--keep-out", "0,0,1,-430", "--payload", "0,1.5"];
            let next = self.model(&[["next", "-n", "10", "--csv"].as_slice(), keep_out.as_slice()].concat());
            runs.push(self.measure(procedure, &next, &mut findings));
        }
        // Where it sits is known; how much of it there is, the tour of the workspace that comes with the cell shows best.
        runs.push(self.measure(procedure, &self.tour, &mut findings));
        let fresh = self.measure_fresh();
        runs.push(fresh);
        self.table(&runs);
        let grown: Value =
            serde_json::from_str(&self.model(&["grow", "--holdout", "session", "--json"])).unwrap();
        let added = grown["steps"].as_array().unwrap().iter().map(|step| &step["added"]);
        findings.added = added
            .filter(|added| added.is_object())
            .map(|added| {
                let text = |key: &str| added[key].as_str().unwrap_or_default().to_owned();
                (text("effect"), text("where"), added["size"].as_f64().unwrap_or(f64::NAN))
            })
            .collect();
        findings.verdicts.push(in_words(&grown));
        if let Some(either) = first_tied(&grown).filter(|_| findings.added.is_empty()) {
            // What these poses cannot distinguish does the same in them: a user adds either.
            self.model_with(&["add"], &[&either, "--holdout", "session"]);
            findings.either = Some(either);
        }
        let residuals = self.residuals(None, Holdout::Session);
        let held_out: Vec<RowResidual> = residuals.into_iter().filter(|row| row.held_out).collect();
        findings.left = match procedure {
            "measure-tip" => tip(&held_out),
            // No height says where the arm is in the tracker's frame: its foot is placed by the fresh points.
            _ => tip(&placed(held_out, &self.measured_last())),
        };
        for entry in std::fs::read_dir(self.cells.puma()).unwrap().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if name.starts_with("lab.") && name != "lab.yaml" {
                std::fs::remove_file(entry.path()).unwrap();
            }
        }
        (findings, fresh)
    }

    /// What the tracker has shown of the fresh poses, the last rows of the table.
    fn measured_last(&self) -> Vec<[f64; 3]> {
        let table = Table::read(&self.cells.puma().join("table.csv")).unwrap();
        let tip = table.positions.iter().find(|columns| columns.target == "p2").unwrap();
        tip.xyz[table.len() - poses::FRESH..].to_vec()
    }

    /// Measured less believed, by the newest revision of the model.
    fn residuals(&self, free: Option<Vec<String>>, holdout: Holdout) -> Vec<RowResidual> {
        let entry = Family::resolve(&self.cells.puma().join("lab.yaml")).unwrap();
        let table = Table::read(&self.cells.puma().join("table.csv")).unwrap();
        let laboratory =
            Laboratory::new(entry.model, table, Options { free, holdout, ..Options::default() }).unwrap();
        laboratory.compare(&Progress::unwatched()).unwrap().rows
    }
}

/// What a diagnosis says, short.
fn in_words(diagnosis: &Value) -> String {
    let effect = |of: &Value| {
        let text = |key: &str| of[key].as_str().map(str::to_owned);
        let sites: Vec<String> = [text("where"), text("with")].into_iter().flatten().collect();
        format!("{}({})", text("effect").unwrap_or_default(), sites.join(", "))
    };
    let named = Some(&diagnosis["named"]).filter(|named| named.is_object());
    let tied = diagnosis["tied"].as_array().map(Vec::as_slice).unwrap_or_default();
    let output: Vec<String> = named.into_iter().chain(tied).map(effect).collect();
    let verdict = diagnosis["verdict"].as_str().unwrap_or_default().replace('_', " ");
    if output.is_empty() { verdict } else { format!("{verdict}: {}", output.join(" or ")) }
}

/// The likeliest of several effects that cannot be distinguished, as `add` takes it.
fn first_tied(diagnosis: &Value) -> Option<String> {
    let first = diagnosis["tied"].as_array()?.first()?;
    let same = |candidate: &&Value| {
        ["effect", "where", "with", "n"].iter().all(|key| candidate[*key] == first[*key])
    };
    let candidate = diagnosis["candidates"].as_array()?.iter().find(same)?;
    candidate["label"].as_str().map(str::to_owned)
}

fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|part| part * part).sum::<f64>().sqrt()
}

/// Root mean square of the residuals, and how far lefty and righty lie apart beyond what was believed.
fn tip(rows: &[RowResidual]) -> Tip {
    assert_eq!(rows.len(), poses::FRESH, "every fresh pose was measured");
    let root = |squares: f64, count: usize| (squares / count as f64).sqrt();
    let squares: f64 = rows.iter().map(|row| length(row.vector_mm).powi(2)).sum();
    let apart = rows.chunks(2).filter_map(|pair| {
        let [lefty, righty] = pair else { return None };
        Some(length([0, 1, 2].map(|axis| lefty.vector_mm[axis] - righty.vector_mm[axis])))
    });
    let apart: Vec<f64> = apart.collect();
    Tip {
        tip_mm: root(squares, rows.len()),
        apart_mm: root(apart.iter().map(|distance| distance * distance).sum(), apart.len()),
        most_apart_mm: apart.iter().copied().fold(0.0, f64::max),
    }
}

/// The residuals when the whole arm is shifted and turned so that its believed points lie best on the measured ones (Kabsch).
fn placed(mut rows: Vec<RowResidual>, measured: &[[f64; 3]]) -> Vec<RowResidual> {
    let vector = |parts: [f64; 3]| nalgebra::Vector3::from(parts);
    let pairs: Vec<_> = rows
        .iter()
        .zip(measured)
        .map(|(row, measured)| (vector(*measured) - vector(row.vector_mm), vector(*measured)))
        .collect();
    let count = pairs.len() as f64;
    let believed = pairs.iter().map(|pair| pair.0).sum::<nalgebra::Vector3<f64>>() / count;
    let measured = pairs.iter().map(|pair| pair.1).sum::<nalgebra::Vector3<f64>>() / count;
    let product = pairs.iter().map(|pair| (pair.1 - measured) * (pair.0 - believed).transpose());
    let svd = product.sum::<nalgebra::Matrix3<f64>>().svd(true, true);
    let (left, right) = (svd.u.unwrap(), svd.v_t.unwrap());
    let upright = nalgebra::Vector3::new(1.0, 1.0, (left * right).determinant().signum());
    let turn = left * nalgebra::Matrix3::from_diagonal(&upright) * right;
    for (row, pair) in rows.iter_mut().zip(&pairs) {
        row.vector_mm = (pair.1 - measured - turn * (pair.0 - believed)).into();
    }
    rows
}

impl fmt::Display for Tip {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:.2}; {:.2}, {:.2}", self.tip_mm, self.apart_mm, self.most_apart_mm)
    }
}

/// The heading of a table of worlds.
pub(crate) const HEADING: &str = "\
| world | before | after the procedure | what the lab added, with the tracker | poses | left | with the ruler | poses | left |
|---|---|---|---|---|---|---|---|---|";

impl fmt::Display for Story {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let found = |findings: &Findings| {
            let added =
                findings.added.iter().map(|(effect, joint, size)| format!("{effect}({joint}) {size:.3e}"));
            let added: Vec<String> = added.collect();
            let last = findings.verdicts.last().cloned().unwrap_or_default();
            let output = if added.is_empty() { format!("nothing ({last})") } else { added.join(", ") };
            format!("{output} | {} | {}", findings.poses, findings.left)
        };
        let Self { seed, before, after, .. } = self;
        let Drawn { site, size, words, .. } = &self.drawn;
        let with_tracker = found(&self.with_tracker);
        write!(formatter, "| {seed}: {words}, {site}, {size} | {before} | {after} | {with_tracker} |")?;
        match &self.by_hand {
            Some(by_hand) => write!(formatter, " {} |", found(by_hand)),
            None => Ok(()),
        }
    }
}
