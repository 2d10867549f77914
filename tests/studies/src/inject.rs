//! `plumb-studies inject`: effects hidden in measurements of real machines, as `plumb trial inject` hides them: how often the lab names them, has them
//! in its set, or names something else. Hidden is what can act: what a fit of the geometry does not absorb, at a size that a machine may have, and of which the table logs what it
//! goes by (no warming where no time is logged).

mod halves;
mod lower_bounds;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;

use crate::benchmark::probabilities::{candidates, probabilities};
use crate::reliability::{Forecast, Reliability};
use plumb::commands::trial::injection::{Found, InjectionError, Measurements};
use plumb_calibration::arm_model::Model;
use plumb_calibration::table::{Table, table_text};
use plumb_diagnosis::Diagnosis;
use plumb_diagnosis::laboratory::{LaboratoryError, Options};
use plumb_estimation::{Progress, Random};
use plumb_report::{diagnosis_sentence, rejection_in_words};
use plumb_simulated::physics::campaign::catalogue::Choice;
use plumb_simulated::physics::imperfection::Imperfection;

use halves::Replication;
use lower_bounds::Likeliest;

/// Model files and tables that are looked for in the folder; those that are not there are left out, and said.
const SETS: [(&str, &str); 6] = [
    ("ur5.yaml", "ur5-grid.csv"),
    ("ur10.yaml", "ur10-a.csv"),
    ("ur10.yaml", "ur10-b.csv"),
    ("mount.yaml", "mount-gem-28.csv"),
    ("mount.yaml", "mount-warp-astron.csv"),
    ("panda_1-sockets.yaml", "panda_1-sockets.csv"),
];

/// Effects that are hidden: of the library, what a fit of the geometry does not absorb.
const EFFECTS: [&str; 12] = [
    "joint_gain",
    "joint_compliance",
    "joint_stiffening",
    "joint_harmonic",
    "joint_backlash",
    "joint_settling",
    "joint_lag",
    "joint_coupling",
    "joint_step",
    "link_sag",
    "thermal_growth",
    "warm_up",
];

/// Draws for one injection before the effect is said not to show in a set.
const DRAWS: u64 = 4;

/// Probability from which on something is of the machine itself: the end of the lowest bin of the table, beyond which an effect is no longer ruled out.
const LIKELY_WITHOUT: f64 = 0.05;

/// Options of `plumb-studies inject`.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The folder with the measurements.
    data: PathBuf,
    /// A set of your own, as MODEL:TABLE within the folder, instead of those that are known; may be repeated.
    #[arg(long = "set", value_name = "MODEL:TABLE")]
    sets: Vec<String>,
    /// Only these effects; all when not given. Also what no effect of the library describes: stick_slip, worn_gear, cable_wind_up, rocking_base.
    #[arg(long = "effect", value_name = "EFFECT")]
    effects: Vec<String>,
    /// Injections of each effect in each set.
    #[arg(short = 'n', long, default_value_t = 3)]
    count: u64,
    /// How many times what the model leaves is to be seen of what is hidden.
    #[arg(long, default_value_t = 2.0)]
    times: f64,
    /// Rows used of each table, drawn at random for each injection; of a smaller table four fifths.
    #[arg(long, default_value_t = 300)]
    rows: usize,
    /// What is fitted, instead of the model file's `free:`.
    #[arg(long, value_delimiter = ';', default_value = "joint_zero(*);geometry(*)")]
    free: Vec<String>,
    /// The first seed.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Ask the rows of every injection as they are, too: what is likely there before anything is hidden is the machine's own, nobody knows whether it is true, and the table of
    /// probabilities leaves it out. Takes twice as long.
    #[arg(long)]
    apart: bool,
    /// In place of the rows of an injection ask each half of them, cut at random, by order and by the first joint: is what one half names confirmed by the other, with the same size?
    #[arg(long, conflicts_with_all = ["apart", "each"])]
    halves: bool,
    /// Report of every injection what was hidden, and what the lab said.
    #[arg(long)]
    each: bool,
}

impl Arguments {
    /// How the lab works.
    fn options(&self) -> Options {
        Options { free: Some(self.free.clone()), ..Options::default() }
    }
}

/// Why a study ends.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StudyError {
    #[error(transparent)]
    Injection(#[from] InjectionError),
    #[error("none of the sets is in {}", .0.display())]
    NoSets(PathBuf),
    #[error("--set {0}: write MODEL:TABLE")]
    Set(String),
    #[error("nobody reads what it prints: {0}")]
    Output(#[from] io::Error),
}

/// What probabilities were given over all injections.
#[derive(Debug, Default)]
struct Said {
    /// Of every candidate.
    forecasts: Vec<Forecast>,
    /// Of each injection; nothing where no candidate was given one.
    likeliest: Vec<Option<Likeliest>>,
}

/// How often each came out, of one effect in one set.
#[derive(Debug, Default)]
struct Counts {
    found: BTreeMap<Found, usize>,
    /// Draws that do not show, or only beyond belief.
    without: usize,
}

impl Counts {
    fn at_least(&self, least: Found) -> usize {
        self.found.iter().filter(|(found, _)| **found >= least).map(|(_, count)| count).sum()
    }

    fn exactly(&self, found: Found) -> usize {
        self.found.get(&found).copied().unwrap_or(0)
    }

    fn all(&self) -> usize {
        self.found.values().sum()
    }

    fn take(&mut self, other: &Self) {
        for (found, count) in &other.found {
            *self.found.entry(*found).or_default() += count;
        }
        self.without += other.without;
    }

    fn line(&self, name: &str, effect: &str) -> String {
        format!(
            "| {name} | {effect} | {} | {} | {} | {} | {} | {} | {} |\n",
            self.all(),
            self.exactly(Found::Named),
            self.at_least(Found::Same),
            self.at_least(Found::InSet),
            self.at_least(Found::Listed),
            self.exactly(Found::NamedWrong),
            self.without
        )
    }
}

/// Runs the study; each effect of each set is reported as soon as it is done.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, StudyError> {
    if arguments.halves {
        return replicate(arguments);
    }
    print_line(
        "| set | effect | injected | named right | or as the same in these rows | in set | listed | named wrong | cannot show |\n|---|---|---|---|---|---|---|---|---|\n",
    )?;
    let mut total = Counts::default();
    let mut said = Said::default();
    for (model, table) in sets(arguments)? {
        let name = table.trim_end_matches(".csv").to_owned();
        let set = Set { model: arguments.data.join(&model), table: arguments.data.join(&table) };
        let own = match set.open(arguments, arguments.seed) {
            Ok(own) => own,
            Err(error) => {
                print_line(&format!("| {name} | left out: {error} | | | | | | | |\n"))?;
                continue;
            }
        };
        let progress = Progress::unwatched();
        let plain = own.diagnose(None, &progress)?;
        print_line(&format!(
            "| {name} | nothing hidden; geometry leaves {:.3} mm | | | | | | | |\n",
            own.left_mm()
        ))?;
        let before = name_of(&plain);
        for effect in hidden_effects(arguments) {
            let counts = injections(arguments, &set, effect, before.as_ref(), &mut said)?;
            print_line(&counts.line(&name, effect))?;
            total.take(&counts);
        }
    }
    print_line(&total.line("all", "all"))?;
    if let Some(reliability) = Reliability::of(&said.forecasts) {
        print_line(&reliability.table("\nprobabilities of the candidates"))?;
        print_line(&lower_bounds::table(&said.likeliest))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Asks the halves of every injection.
fn replicate(arguments: &Arguments) -> Result<ExitCode, StudyError> {
    print_line(halves::HEAD)?;
    let mut total = Replication::default();
    for (model, table) in sets(arguments)? {
        let name = table.trim_end_matches(".csv").to_owned();
        let set = Set { model: arguments.data.join(&model), table: arguments.data.join(&table) };
        if let Err(error) = set.open(arguments, arguments.seed) {
            print_line(&format!("| {name} | left out: {error} | | | | | | | |\n"))?;
            continue;
        }
        let model = Model::read(&set.model).map_err(LaboratoryError::from).map_err(InjectionError::from)?;
        let mut own = Replication::default();
        for effect in hidden_effects(arguments) {
            let mut draw_seed = first_draw(arguments.seed, effect);
            for _ in 0..arguments.count {
                let measured = set.open(arguments, draw_seed)?;
                let Some(hidden) = drawn(&measured, effect, &mut draw_seed, arguments.times)? else {
                    continue;
                };
                let site = hidden.mechanism.site(measured.arm());
                let name = (hidden.mechanism.name(), site.as_str());
                let text = table_text(&measured.with(&hidden)?);
                own.ask((&model, &arguments.options()), &text, name, draw_seed)
                    .map_err(InjectionError::from)?;
            }
        }
        print_line(&own.lines(&name))?;
        total.take(&own);
    }
    print_line(&total.lines("all"))?;
    Ok(ExitCode::SUCCESS)
}

/// What is hidden: the effects that were asked for, be they in the library or not, else all of [`EFFECTS`].
fn hidden_effects(arguments: &Arguments) -> Vec<&str> {
    match arguments.effects.is_empty() {
        true => EFFECTS.to_vec(),
        false => arguments.effects.iter().map(String::as_str).collect(),
    }
}

/// The sets that are there.
fn sets(arguments: &Arguments) -> Result<Vec<(String, String)>, StudyError> {
    let named: Vec<(String, String)> = match arguments.sets.is_empty() {
        true => SETS.iter().map(|(model, table)| ((*model).to_owned(), (*table).to_owned())).collect(),
        false => {
            let pair = |set: &String| {
                let (model, table) = set.split_once(':').ok_or_else(|| StudyError::Set(set.clone()))?;
                Ok((model.to_owned(), table.to_owned()))
            };
            arguments.sets.iter().map(pair).collect::<Result<_, StudyError>>()?
        }
    };
    let there = |file: &String| arguments.data.join(file).exists();
    let found: Vec<_> = named.into_iter().filter(|(model, table)| there(model) && there(table)).collect();
    if found.is_empty() { Err(StudyError::NoSets(arguments.data.clone())) } else { Ok(found) }
}

/// A set of measurements: its model file and its table.
struct Set {
    model: PathBuf,
    table: PathBuf,
}

impl Set {
    /// The set with so many of its rows as this seed draws, fitted.
    fn open(&self, arguments: &Arguments, draw_seed: u64) -> Result<Measurements, InjectionError> {
        let model = Model::read(&self.model).map_err(LaboratoryError::from)?;
        let table = Table::read(&self.table).map_err(LaboratoryError::from)?;
        let table = thinned(&table, rows_drawn(table.len(), arguments.rows), draw_seed)?;
        Measurements::new(model, table, arguments.options(), &Progress::unwatched())
    }
}

/// Rows drawn of a table of so many: four fifths at most, so that no two seeds draw the same.
fn rows_drawn(rows: usize, expected: usize) -> usize {
    expected.min(rows * 4 / 5)
}

/// Effect and site of what was named.
type Name = (String, String);

fn name_of(diagnosis: &Diagnosis) -> Option<Name> {
    let named = diagnosis.named.as_ref();
    named.map(|one| (one.effect.effect.clone(), one.effect.site.clone()))
}

/// Effects and sites that are likely in rows in which nothing is hidden.
fn likely_without(probabilities: &[(&str, &str, f64)]) -> Vec<Name> {
    let likely = probabilities.iter().filter(|(_, _, probability)| *probability >= LIKELY_WITHOUT);
    likely.map(|(effect, site, _)| ((*effect).to_owned(), (*site).to_owned())).collect()
}

fn borrowed(name: Option<&Name>) -> Option<(&str, &str)> {
    name.map(|(effect, site)| (effect.as_str(), site.as_str()))
}

/// So many rows of a table, drawn at random, in their order.
fn thinned(table: &Table, most: usize, seed: u64) -> Result<Table, LaboratoryError> {
    let mut rows: Vec<usize> = (0..table.len()).collect();
    Random::seeded(seed).shuffle(&mut rows);
    rows.truncate(most);
    rows.sort_unstable();
    let text = table_text(table);
    let lines: Vec<&str> = text.lines().collect();
    let mut kept = lines.first().map_or_else(String::new, |header| format!("{header}\n"));
    for line in rows.iter().filter_map(|row| lines.get(row + 1)) {
        // Writing to a text cannot fail.
        let _ = writeln!(kept, "{line}");
    }
    Ok(Table::parse(&table.source, &kept)?)
}

/// Hides an effect so many times, each time in other rows, at sites drawn at random. `before` was named in some rows without anything hidden.
fn injections(
    arguments: &Arguments,
    set: &Set,
    effect: &str,
    before: Option<&Name>,
    said: &mut Said,
) -> Result<Counts, StudyError> {
    let progress = Progress::unwatched();
    let mut counts = Counts::default();
    let mut draw_seed = first_draw(arguments.seed, effect);
    for _ in 0..arguments.count {
        let own = set.open(arguments, draw_seed)?;
        let Some(hidden) = drawn(&own, effect, &mut draw_seed, arguments.times)? else {
            counts.without += 1;
            continue;
        };
        let diagnosis = own.diagnose(Some(&hidden), &progress)?;
        let site = hidden.mechanism.site(own.arm());
        let name = (hidden.mechanism.name(), site.as_str());
        let mut before = before.cloned();
        let is_doubtful = Found::of(&diagnosis, name, borrowed(before.as_ref())) == Found::NamedWrong;
        let mut of_the_machine = Vec::new();
        if is_doubtful || arguments.apart {
            // These rows may have named it before anything was hidden.
            let plain = own.diagnose(None, &progress)?;
            if arguments.apart {
                of_the_machine = likely_without(&probabilities(&plain));
            }
            before = name_of(&plain);
        }
        // What was named before anything was hidden is there besides: nobody knows whether it is true.
        of_the_machine.extend(before.clone());
        let found = Found::of(&diagnosis, name, borrowed(before.as_ref()));
        let is_hidden = |effect: &str, at: &str| (effect, at) == name;
        let asked = |one: (&str, &str)| {
            is_hidden(one.0, one.1) || of_the_machine.iter().all(|known| borrowed(Some(known)) != Some(one))
        };
        said.forecasts.extend(candidates(&diagnosis, &asked, &is_hidden));
        let mut all = probabilities(&diagnosis);
        all.retain(|(effect, site, _)| asked((*effect, *site)));
        said.likeliest.push(Likeliest::of(&all, is_hidden));
        if arguments.each {
            print_line(&describe(hidden.mechanism.name(), &site, found, &diagnosis))?;
        }
        *counts.found.entry(found).or_default() += 1;
    }
    Ok(counts)
}

/// An effect at a site drawn at random, of the size that is to be seen; nothing where none of [`DRAWS`] draws shows. `draw_seed` moves on past the draws.
fn drawn(
    own: &Measurements,
    effect: &str,
    draw_seed: &mut u64,
    times: f64,
) -> Result<Option<Imperfection>, StudyError> {
    let mut hidden = None;
    for _ in 0..DRAWS {
        *draw_seed = draw_seed.wrapping_add(1);
        let Ok(mechanism) = own.draw(&Choice::named(effect), *draw_seed) else { break };
        if !own.logs_what_drives(&mechanism) {
            continue;
        }
        match own.sized(&mechanism, times, &Progress::unwatched()) {
            Ok(found) => hidden = Some(found),
            Err(InjectionError::DoesNotShow { .. } | InjectionError::Unbelievable { .. }) => {}
            Err(error) => return Err(error.into()),
        }
        if hidden.is_some() {
            break;
        }
    }
    Ok(hidden)
}

/// The seeds of one effect begin elsewhere than those of another: else all would be hidden at the same joints.
fn first_draw(seed: u64, effect: &str) -> u64 {
    let letters =
        effect.bytes().fold(0_u64, |sum, letter| sum.wrapping_mul(31).wrapping_add(u64::from(letter)));
    seed.wrapping_mul(1_000_000).wrapping_add(letters % 10_000 * 100)
}

/// One injection in lines: what was hidden, the sentence, and the first candidates with their probabilities and why each is not the name.
fn describe(effect: &str, site: &str, found: Found, diagnosis: &Diagnosis) -> String {
    let mut text = format!("  {effect}({site}): {found:?}. {}\n", diagnosis_sentence(diagnosis));
    if !diagnosis.besides.is_empty() {
        // Writing to a text cannot fail.
        let _ = writeln!(text, "    also at work: {}", diagnosis.besides.join(", "));
    }
    for candidate in diagnosis.candidates.iter().take(4) {
        // Writing to a text cannot fail.
        let _ = writeln!(
            text,
            "    {}{}: {}",
            candidate.label,
            candidate.probability.map_or_else(String::new, |one| format!(" ({:.1} %)", 100.0 * one)),
            candidate.rejected.as_ref().map_or_else(|| "the name".to_owned(), rejection_in_words)
        );
    }
    text
}

fn print_line(text: &str) -> Result<(), StudyError> {
    let mut out = io::stdout();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_add_up_and_a_better_find_counts_among_the_lesser() {
        let mut counts = Counts::default();
        for found in
            [Found::Named, Found::Same, Found::InSet, Found::Listed, Found::Missed, Found::NamedWrong]
        {
            *counts.found.entry(found).or_default() += 1;
        }
        counts.without = 2;
        assert_eq!(counts.line("a", "b"), "| a | b | 6 | 1 | 2 | 3 | 4 | 1 | 2 |\n");
        let mut all = Counts::default();
        all.take(&counts);
        all.take(&counts);
        assert_eq!(all.line("a", "b"), "| a | b | 12 | 2 | 4 | 6 | 8 | 2 | 4 |\n");
    }

    #[test]
    fn what_is_likely_before_anything_is_hidden_is_of_the_machine() {
        let diagnosed =
            [("joint_gain", "pan", 0.9), ("joint_gain", "lift", 0.049), ("link_sag", "pan", 0.05)];
        let name = |effect: &str, site: &str| (effect.to_owned(), site.to_owned());
        assert_eq!(likely_without(&diagnosed), [name("joint_gain", "pan"), name("link_sag", "pan")]);
        assert_eq!(borrowed(likely_without(&diagnosed).first()), Some(("joint_gain", "pan")));
    }

    #[test]
    fn draws_from_a_small_table_draw_four_fifths_of_it_and_differ() {
        assert_eq!([rows_drawn(1000, 200), rows_drawn(250, 200), rows_drawn(99, 200)], [200, 200, 79]);
        let rows: Vec<String> = (0..50).map(|row| format!("{row},{}", 10 * row)).collect();
        let table = Table::parse("t.csv", &format!("q1_deg,p1_x_mm\n{}\n", rows.join("\n"))).unwrap();
        let [one, other] =
            [3, 4].map(|draw_seed| table_text(&thinned(&table, rows_drawn(50, 200), draw_seed).unwrap()));
        assert!(one != other && one.lines().count() == 41);
    }

    #[test]
    fn a_thinned_table_keeps_whole_rows_in_their_order() {
        let rows: Vec<String> = (0..50).map(|row| format!("{row},{},a", 10 * row)).collect();
        let text = format!("q1_deg,p1_x_mm,session\n{}\n", rows.join("\n"));
        let table = Table::parse("table.csv", &text).unwrap();
        let thin = thinned(&table, 20, 3).unwrap();
        assert_eq!(thin.len(), 20);
        let rows: Vec<f64> = (0..20).map(|row| thin.positions[0].xyz[row][0]).collect();
        assert!(rows.windows(2).all(|two| two[0] < two[1]));
        assert!((0..20).all(|row| (thin.q_of(row)[0].to_degrees() * 10.0 - rows[row]).abs() < 1e-9));
    }
}
