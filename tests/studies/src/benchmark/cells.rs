//! The benchmark's cells: what is hidden, in which poses, how often.

use plumb_simulated::physics::arms;
use plumb_simulated::physics::campaign::catalogue::{
    ASKED, Choice, LIBRARY, NOT_REPEATABLE, OUTSIDE, SPECIAL,
};
use plumb_simulated::physics::campaign::specification::{Free, Requested, Size, Specification, Spread};
use plumb_simulated::physics::campaign::{self, Case};
use plumb_simulated::physics::description::ArmDescription;
use plumb_simulated::physics::random::Random;

use super::error::BenchmarkError;
use plumb::commands::trial::arguments::CampaignArguments;

/// A kind of trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cell {
    /// Name, as `--cell` takes it.
    pub(super) name: &'static str,
    /// What it is, for people.
    pub(super) title: &'static str,
    /// Trials at full scale.
    pub(super) trials: usize,
    /// What is hidden.
    hides: Hides,
    /// How far the poses reach.
    spread: Spread,
    /// Effect over noise.
    ratio: f64,
    /// Share of gross errors.
    outliers: f64,
    /// What the model leaves free.
    free: Free,
    /// Poses visited once.
    poses: usize,
}

/// Poses of a cell where nothing else is said.
const USUAL_POSES: usize = 60;

/// Errors of shape that are hidden together.
const SHAPE: [&str; 6] = ["link_length", "link_offset", "link_twist", "axis_skew", "link_twist", "axis_skew"];

/// What a cell hides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Hides {
    /// Nothing.
    Nothing,
    /// One effect of the library.
    One,
    /// Two effects of the library.
    Two,
    /// This one.
    This(&'static str),
    /// Something the library does not know.
    Outside,
    /// One effect of the library, twice as large as each of two things it does not know.
    AmongOthers,
    /// Errors of the arm's shape that the model does not leave free.
    Shape,
    /// A machine that does not repeat.
    NotRepeatable,
}

const fn wide(name: &'static str, title: &'static str, trials: usize, hides: Hides, ratio: f64) -> Cell {
    Cell {
        name,
        title,
        trials,
        hides,
        spread: Spread::Wide,
        ratio,
        outliers: 0.0,
        free: Free::Zeros,
        poses: USUAL_POSES,
    }
}

/// All cells, in the order of the report.
pub(super) const CELLS: [Cell; 14] = [
    wide("nothing", "nothing hidden, wide", 2000, Hides::Nothing, 0.0),
    Cell {
        spread: Spread::Narrow,
        ..wide("nothing-narrow", "nothing hidden, narrow", 500, Hides::Nothing, 0.0)
    },
    Cell {
        outliers: 0.08,
        ..wide("nothing-outliers", "nothing hidden, wide, 8 % outliers", 500, Hides::Nothing, 0.0)
    },
    wide("one-3x", "one effect, 3x noise, wide", 1000, Hides::One, 3.0),
    wide("one-1x", "one effect, 1x noise, wide", 300, Hides::One, 1.0),
    Cell {
        spread: Spread::Narrow,
        ..wide("one-3x-narrow", "one effect, 3x noise, narrow", 300, Hides::One, 3.0)
    },
    Cell {
        spread: Spread::Narrow,
        ..wide("one-1x-narrow", "one effect, 1x noise, narrow", 300, Hides::One, 1.0)
    },
    Cell {
        outliers: 0.08,
        ..wide("one-3x-outliers", "one effect, 3x noise, wide, 8 % outliers", 1000, Hides::One, 3.0)
    },
    Cell {
        free: Free::Geometry,
        ..wide("one-3x-geometry", "one effect, 3x noise, wide, all geometry free", 300, Hides::One, 3.0)
    },
    wide("two-3x", "two effects, 3x noise each, wide", 300, Hides::Two, 3.0),
    wide("outside", "outside the library, 3x noise, wide", 400, Hides::Outside, 3.0),
    Cell {
        poses: 150,
        ..wide(
            "among-others",
            "one effect, 6x noise, among two outside the library, 3x each, 150 poses",
            400,
            Hides::AmongOthers,
            3.0,
        )
    },
    Cell {
        spread: Spread::Narrow,
        ..wide(
            "small-model",
            "base model too small: shape not free, 2x noise each of six, narrow",
            300,
            Hides::Shape,
            2.0,
        )
    },
    wide("not-repeatable", "does not repeat, 3x noise, wide", 200, Hides::NotRepeatable, 3.0),
];

/// The cells in which one effect is hidden.
pub(super) fn one_effect() -> impl Iterator<Item = Cell> {
    CELLS.into_iter().filter(|cell| cell.hides == Hides::One)
}

/// The cells with nothing hidden, and those with what the library does not list.
pub(super) fn unlisted_or_nothing() -> impl Iterator<Item = Cell> {
    CELLS.into_iter().filter(|cell| matches!(cell.hides, Hides::Nothing | Hides::Outside))
}

/// One cell for each effect that this world and the lab's library both have.
pub(super) fn each_effect() -> Vec<Cell> {
    let names = LIBRARY.into_iter().chain(SPECIAL).chain(ASKED);
    let names = names.filter(|name| plumb_calibration::effect::kind(name).is_some());
    let free = |name: &str| if name == "joint_zero" { Free::None } else { Free::Zeros };
    names.map(|name| Cell { free: free(name), ..wide(name, name, 50, Hides::This(name), 3.0) }).collect()
}

/// Trials to be run.
#[derive(Debug, Clone)]
pub(super) enum Work {
    /// A cell of the benchmark.
    Cell(Cell),
    /// A campaign of the user's own.
    Own(CampaignArguments, usize),
}

impl Work {
    /// A cell.
    pub(super) fn cell(cell: Cell) -> Self {
        Self::Cell(cell)
    }

    /// So many trials of one's own; its first is tried, so that bad options are reported.
    pub(super) fn own(
        campaign: &CampaignArguments,
        trials: usize,
        seed: u64,
    ) -> Result<Self, BenchmarkError> {
        campaign::generate(&campaign.specification(seed)?, seed)?;
        Ok(Self::Own(campaign.clone(), trials))
    }

    /// Its name in files.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Cell(cell) => cell.name,
            Self::Own(..) => "own",
        }
    }

    /// What it is, for people.
    pub(super) fn title(&self) -> &'static str {
        match self {
            Self::Cell(cell) => cell.title,
            Self::Own(..) => "own campaign",
        }
    }

    /// Trials at full scale.
    pub(super) fn trials(&self) -> usize {
        match self {
            Self::Cell(cell) => cell.trials,
            Self::Own(_, trials) => *trials,
        }
    }

    /// Trial `number`; `None` when chance gives none that can be made.
    pub(super) fn case(&self, seed: u64, number: usize) -> Option<Case> {
        match self {
            Self::Cell(cell) => cell.case(seed, number),
            Self::Own(campaign, _) => {
                let seed = seed.wrapping_add(number as u64);
                campaign::generate(&campaign.specification(seed).ok()?, seed).ok()
            }
        }
    }
}

impl Cell {
    /// Trial `number` of this cell under the benchmark's seed. Arms come at random; a draw that cannot be hidden in its arm is drawn again.
    fn case(&self, seed: u64, number: usize) -> Option<Case> {
        let mut rng = Random::new(seed.wrapping_add(number as u64), self.name);
        (0..100).find_map(|_| {
            let (name, _) = rng.pick(&arms::ARMS)?;
            let specification = self.specification(arms::by_name(name)?.ok()?, number, &mut rng);
            let case = campaign::generate(&specification, rng.bits()).ok()?;
            self.shows(&case).then_some(case)
        })
    }

    fn specification(&self, arm: ArmDescription, number: usize, rng: &mut Random) -> Specification {
        let names: Vec<&str> = match self.hides {
            Hides::Nothing => Vec::new(),
            Hides::One => vec![known(rng)],
            Hides::Two => vec![known(rng), known(rng)],
            Hides::This(name) => vec![name],
            Hides::Outside => OUTSIDE.get(number % OUTSIDE.len()).copied().into_iter().collect(),
            Hides::AmongOthers => {
                let others = (0..2).map(|_| rng.pick(&OUTSIDE).copied().unwrap_or("worn_gear"));
                let others: Vec<&str> = others.collect();
                [&[known(rng)], others.as_slice()].concat()
            }
            Hides::Shape => SHAPE.to_vec(),
            Hides::NotRepeatable => vec![NOT_REPEATABLE],
        };
        let larger = |name: &str| self.hides == Hides::AmongOthers && !OUTSIDE.contains(&name);
        let times = |name: &str| if larger(name) { 2.0 } else { 1.0 };
        let expected = |name: &str| Requested {
            choice: Choice::named(name),
            size: Size::OverNoise(self.ratio * times(name)),
        };
        Specification {
            hidden: names.into_iter().map(expected).collect(),
            poses: self.poses,
            spread: self.spread,
            outliers: self.outliers,
            free: self.free,
            heat: true,
            ..Specification::usual(arm)
        }
    }

    /// Outside the library the aim holds for what is left over above twice the noise.
    fn shows(&self, case: &Case) -> bool {
        self.hides != Hides::Outside || case.truth.hidden.iter().all(|hidden| hidden.visible_over_noise > 2.0)
    }
}

/// An effect at random from those that both this world and the lab's library have.
fn known(rng: &mut Random) -> &'static str {
    let both: Vec<&str> =
        LIBRARY.into_iter().filter(|name| plumb_calibration::effect::kind(name).is_some()).collect();
    rng.pick(&both).copied().unwrap_or("joint_backlash")
}
