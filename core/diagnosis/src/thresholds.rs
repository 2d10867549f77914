//! Every constant that decides something in a diagnosis, in one place. The README holds the same table with the source of each
//! and what moves when it moves; a test below holds the two together.
//!
//! Constants of a numerical method (steps, iteration counts, chunk sizes) stay where the method is.

// Dataset and noise floor

/// Fewest degrees of freedom of replicates that make a noise floor; below, the declared sigmas count (degrees
/// of freedom). Why: sigma is then known to 30 % (chi squared).
pub(crate) const FLOOR_FREEDOM: usize = 6;

/// An effect of conditions (approach, time, temperature, load) is taken out of the replicates below it
/// (probability (Holm)). Why: Holm 1979; usual 1 %.
pub(crate) const CONDITION_LEVEL: f64 = 0.01;

/// Effects of conditions taken out of the replicates at most (effects). Why: as many as an arm has joints, and
/// two.
pub(crate) const MOST_CONDITIONS: usize = 8;

/// A row farther out than this quantile of chi is an outlier of the final, plain fit (probability). Why: one
/// sound row in 2000.
pub(crate) const INLIER_QUANTILE: f64 = 0.9995;

/// A replicate farther from its group's mean is left out of the mixture test (times the upper quartile). Why:
/// of two clusters more than a quarter lies far out, so the quartile stays.
pub(crate) const REPLICATE_OUTLIER: f64 = 4.0;

/// Rows of less Huber weight are listed as outliers (weight). Why: twice the Huber tuning constant.
pub(crate) const OUTLIER_WEIGHT: f64 = 0.5;

// Candidates and score test

/// Rows a search uses; more are thinned at random by pose (rows). Why: time; sigma of an effect falls by the
/// root only.
pub(crate) const SEARCH_ROWS: usize = 1500;

/// Harmonics above it are charged as one large family (periods a turn). Why: orders to 4 are mechanical
/// (eccentric, bent, keyed); above: teeth and encoders.
pub(crate) const HIGH_ORDER: f64 = 4.0;

/// Weight of a high order in Holm's correction (weight). Why: Genovese, Roeder & Wasserman 2006: prior weights.
pub(crate) const HIGH_ORDER_WEIGHT: f64 = 0.1;

/// A high order pays 2 ln of it in the information criterion (orders). Why: extended BIC, Chen & Chen 2008.
pub(crate) const ORDERS_SEARCHED: f64 = 64.0;

/// A candidate whose greatest plausible size shows less is not scored (variances). Why: two standard errors.
pub(crate) const VISIBLE_VARIANCES: f64 = 4.0;

/// Directions of a candidate of which less is left beyond the fitted parameters count as absorbed (fraction).
/// Why: rounding of the normal equations, squared.
pub(crate) const ABSORBED_REST: f64 = 1e-6;

/// Candidates below it are refitted (probability (Holm)). Why: none above could reach NAMING_LEVEL.
pub(crate) const REFIT_BELOW: f64 = 0.5;

/// Refitted in one round at most (candidates). Why: time.
pub(crate) const REFITTED_CANDIDATES: usize = 8;

/// Of each kind, fitted robustly to ask which rows are outliers with them in (candidates). Why: time.
pub(crate) const OUTLIER_JUDGES: usize = 3;

/// Only candidates below it are asked about outliers (probability). Why: below UNLISTED_LEVEL nothing would be
/// lost.
pub(crate) const OUTLIER_JUDGE_LEVEL: f64 = 1e-3;

// Naming and verdict

/// A candidate must be below it to be named (probability (Holm)). Why: the contract asks for 0.01; at 0.003
/// chance names something in 3 sound tables of 1,000.
pub(crate) const NAMING_LEVEL: f64 = 0.003;

/// A candidate below it shows that something is there although the sum of squares does not (probability
/// (Holm)). Why: a thirtieth of NAMING_LEVEL.
pub(crate) const PRESENT_LEVEL: f64 = 1e-4;

/// Candidates closer than this to the best are ties (BIC units). Why: Kass & Raftery 1995: 6 is strong evidence
/// (Bayes factor 20).
pub(crate) const TIE_BIC: f64 = 6.0;

/// More than noise is left below it (probability). Why: F or chi-squared test, Draper & Smith 1998, section 2;
/// the level keeps `at_floor` in 499 of 500 sound tables.
pub(crate) const LACK_OF_FIT_LEVEL: f64 = 0.002;

/// A mechanism without a name is at work below it (probability (Holm)). Why: below NAMING_LEVEL: a sound name
/// must not fall to it.
pub(crate) const UNLISTED_LEVEL: f64 = 1e-3;

/// More is left along a joint's motion than across it below it (probability). Why: as NAMING_LEVEL.
pub(crate) const DIRECTION_LEVEL: f64 = 0.003;

/// A cross-validated gain beyond it is believed whatever else is left (standard errors). Why: seen only in
/// tables of many hundred poses.
pub(crate) const OVERWHELMING_GAIN: f64 = 20.0;

/// Taken in by one diagnosis at most (effects). Why: time; a model that lacks more is grown (`grow`).
pub(crate) const MOST_EFFECTS: usize = 5;

/// Times that a set of effects is exchanged for a better one at most (exchanges). Why: time; one or two are the rule.
pub(crate) const MOST_EXCHANGES: usize = 4;

/// Candidates beside which each other is tried as a pair, those that alone explain most (candidates). Why: time; of two that explain much together one explains something alone.
pub(crate) const EXCHANGE_PARTNERS: usize = 30;

/// Sets that are fitted in place of one (sets). Why: time; the linear model ranks them well where errors are small.
pub(crate) const EXCHANGES_FITTED: usize = 6;

/// A compliance so far below zero means that gravity points the other way in the model (standard errors). Why:
/// five sigma.
pub(crate) const SIGN_ERRORS: f64 = 5.0;

/// Compared with the best for collinearity (candidates). Why: what a screen shows.
pub(crate) const COMPARED_CANDIDATES: usize = 6;

/// Effects above it are reported as alike; smooth functions above it hold an effect (canonical correlation). Why: Hotelling 1936; variance inflation 10
/// (Belsley, Kuh & Welsch 1980).
pub(crate) const ALIKE_CORRELATION: f64 = 0.95;

/// Effects above it are the same in these data (canonical correlation). Why: what is missing to 1 is rounding.
pub(crate) const SAME_CORRELATION: f64 = 0.999_999;

/// An effect of this size is found four times in five (standard errors). Why: NAMING_LEVEL among a hundred
/// candidates, of either sign: 4.17 for the level, 0.84 for the power of 80 %.
pub(crate) const DETECTABLE_ERRORS: f64 = 5.0;

/// Below this fraction of the detectable information the plausible range, not the rows, bounds an effect
/// (fraction). Why: half the size is then the range's.
pub(crate) const BOUNDED_BY_ROWS: f64 = 0.25;

/// Corrections that `grow` adds at most (effects). Why: time; each is a diagnosis.
pub(crate) const MOST_CORRECTIONS: usize = 12;

/// Candidates that are tried as the next correction at most (candidates). Why: time; those behind explain less.
pub(crate) const CORRECTIONS_TRIED: usize = 3;

/// Rows in which a formula is searched for; more are thinned at random by pose (rows). Why: time; thousands of forms are asked.
pub(crate) const HYPOTHESIS_ROWS: usize = 600;

/// Formulas that are fitted for real (formulas). Why: time; those behind are alike or explain less.
pub(crate) const HYPOTHESES_REFITTED: usize = 6;

/// A formula must take away this share of the squares beyond the noise (fraction). Why: at 60 poses the best of thousands of wrong forms reaches a half.
pub(crate) const HYPOTHESIS_SHARE: f64 = 0.6;

/// Sets of residuals with signs drawn at random, in each of which no formula of the place may explain as much (sets). Why: chance does it once in a hundred times.
pub(crate) const HYPOTHESIS_TWINS: usize = 99;

// Cross-validation

/// Regions of pose space, or ranges of a joint, left out in turn (blocks). Why: Hastie, Tibshirani & Friedman
/// 2009, section 7.10: five or ten; by regions because neighbours share errors (Roberts et al. 2017).
pub(crate) const VALIDATION_BLOCKS: usize = 5;

/// Regions of pose space, and stretches of the order of rows, left out in turn for the standard errors that are
/// reported (blocks). Why: nine degrees of freedom, a standard error known to a quarter; Efron & Tibshirani 1993,
/// section 11.5.
pub(crate) const ERROR_BLOCKS: usize = 10;

/// A gain must exceed so many of its own standard errors (standard errors). Why: one-standard-error rule,
/// Breiman et al. 1984.
pub(crate) const GAIN_ERRORS: f64 = 1.0;

/// A left-out reading whose surface is less well known than this is not predicted (variances). Why: the surface
/// then adds as much as the reading's own noise.
pub(crate) const SURFACE_UNKNOWN: f64 = 1.0;

/// Lonely poses are looked for in tables up to this size (poses). Why: in larger tables a few poses say little.
pub(crate) const LONELY_POSES: usize = 400;

/// A pose so far from the others is in no block (times the median reach). Why: nothing fitted could predict it.
pub(crate) const LONELY_FACTOR: f64 = 3.0;

// Direction test

/// Used at most (rows). Why: time.
pub(crate) const DIRECTION_ROWS: usize = 1500;

/// Fewer say nothing of a site (degrees of freedom). Why: an F test on fewer has hardly any power.
pub(crate) const DIRECTION_FREEDOM: f64 = 8.0;

/// A site so much less likely than the best is ruled out (2 ln likelihood). Why: Kass & Raftery 1995: very
/// strong.
pub(crate) const SITE_LIKELIHOOD: f64 = 10.0;

/// What an outlier costs a site, however far out (squared sigmas). Why: chi squared quantile of INLIER_QUANTILE
/// for one degree of freedom (12.1).
pub(crate) const OUTLIER_COST: f64 = 12.0;

// Mixture test of replicates

/// Two positions must be so much likelier than one (ln likelihood). Why: about 1 in 160,000; every joint, base
/// and target are tried.
pub(crate) const TWO_OVER_ONE: f64 = 12.0;

/// And than one with a larger scatter (ln likelihood). Why: Bayes factor 20.
pub(crate) const TWO_OVER_WIDE: f64 = 3.0;

/// A base or target must be so much likelier than a joint (ln likelihood). Why: joints slip, feet and flanges
/// seldom.
pub(crate) const BASE_OVER_JOINT: f64 = 6.0;

/// Of one pose used at most: 2^n patterns are counted (replicates). Why: time.
pub(crate) const LONGEST_GROUP: usize = 10;

/// Groups whose two positions lie nearer are not counted (sigmas). Why: Ashman, Bird & Zepf 1994: separation 2
/// at least.
pub(crate) const SPLIT_VISIBLE: f64 = 3.0;

/// Expected to hold both positions before anything is said (groups). Why: one group.
pub(crate) const SPLIT_GROUPS: f64 = 0.9;

/// Of the groups expected to hold both positions must hold both (fraction). Why: a fair coin gives 1, a few
/// slips less than a half.
pub(crate) const SPLIT_FRACTION: f64 = 0.55;

/// The smaller cluster has at least one member in so many (members a member). Why: a few slips are no cluster.
pub(crate) const SMALLER_CLUSTER: f64 = 6.0;

// Residual structure

/// Looked at (rows or poses). Why: time.
pub(crate) const STRUCTURE_ROWS: usize = 600;

/// A covariate counts when none of them does as much (permutations). Why: permutation test at 1/200 (Edgington
/// 1995), maximum over covariates (Westfall & Young 1993).
pub(crate) const SHUFFLES: u32 = 199;

/// A covariate is cut into (levels). Why: one-way analysis of variance.
pub(crate) const LEVELS: usize = 8;

/// Of what the levels explain, for a line or a step to be called one (fraction). Why: judgement.
pub(crate) const SHAPE_FRACTION: f64 = 0.8;

/// Of the variance a wave explains at least (fraction). Why: judgement.
pub(crate) const WAVE_FRACTION: f64 = 0.2;

// How much could be explained

/// Rows looked at; of more a random part by pose (rows). Why: time; the fraction that is predictable is known to a few per cent from so many.
pub(crate) const EXPLAINABLE_ROWS: usize = 1000;

/// A group of columns counts when the squared error of unseen rows falls by more (standard errors). Why: one group of noise in forty counts by chance.
pub(crate) const EXPLAINABLE_ERRORS: f64 = 2.0;

/// A component of columns with fewer effective degrees of freedom is given up (degrees of freedom). Why: it then explains less than a tenth of one parameter of noise.
pub(crate) const EXPLAINABLE_FREEDOM: f64 = 0.1;

// Mechanisms among structure that nothing explains

/// Rows on which candidates are weighed beside a flexible part; of more a random part by pose (rows). Why: time; an effect as large as what is left shows in far fewer.
pub(crate) const EVIDENCE_ROWS: usize = 500;

/// Weighed so, of the library (effects). Why: time; those behind explain much less.
pub(crate) const EVIDENCE_CANDIDATES: usize = 12;

/// Weighed beside them, without a name (mechanisms). Why: time; those that explain most.
pub(crate) const EVIDENCE_UNLISTED: usize = 6;

/// Of them that may act at once, at most (candidates). Why: time; what is left then is small beside the foremost.
pub(crate) const EVIDENCE_SET: usize = 4;

/// Of what the foremost takes from what is left, something takes at least this share by itself to take its place (fraction). Why: what takes less leaves the rest
/// to the flexible part, and is no rival of its own.
pub(crate) const RIVAL_SHARE: f64 = 0.5;

/// By which an effect predicts rows left out better than a smooth function that explains the rows seen as well, in every way of leaving blocks out (standard errors). Why:
/// three sigma; inside the rows a smooth function follows anything, beyond them it knows nothing.
pub(crate) const SMOOTH_ERRORS: f64 = 3.0;

/// Of what an effect explains may at most be left at its joint, where the effect can imitate nothing else (fraction). Why: it is then the greater part of what is there.
pub(crate) const JOINT_LEFT: f64 = 1.0;

/// Of what an effect that can imitate others explains may at most be left at its joint (fraction). Why: it then accounts for four fifths of what is there; the first harmonic of a sawtooth accounts for six tenths.
pub(crate) const SITE_LEFT: f64 = 0.25;

/// By which a size with the flexible part and without it may differ at most (standard errors, by blocks of rows). Why: three sigma.
pub(crate) const SIZE_ERRORS: f64 = 3.0;

/// By which part of itself it may differ whatever its errors (fraction). Why: what is left bends a size that is fitted without it; a larger change would be that of another effect.
pub(crate) const SIZE_SHARE: f64 = 0.3;

/// Rows a residual map is fitted to; of more a random part by pose (rows). Why: time; it has a few hundred weights.
pub(crate) const MAP_ROWS: usize = 2500;

/// Fewer poses than this are few: none can be left out (poses). Why: a fifth of so many is too little to judge by.
pub(crate) const FEW_POSES: usize = 20;

/// Rows that each of a few poses must have for what goes with the pose to be distinguished from their scatter (rows). Why: two would leave one degree of freedom a pose.
pub(crate) const FEW_POSES_RETURNS: usize = 3;

// Light stripes

/// What points of one stripe err alike by, however many they are (times the scatter of neighbours). Why: in simulated worlds with everything right a stripe is off
/// by 0.4 to 0.5 of that scatter as a whole, for pixels and the search for its middle err alike from row to row; a real surface and sheet add to it.
pub(crate) const STRETCH_SCATTER: f64 = 0.66;

// Next poses

/// Drawn for each pose that is chosen (candidate poses). Why: random search, then refinement.
pub(crate) const POSES_TRIED: usize = 240;

/// Of small changes to the best pose (rounds). Why: step halves each time.
pub(crate) const DESIGN_ROUNDS: usize = 3;

/// Compared at most (effects). Why: time.
pub(crate) const RIVALS: usize = 6;

/// Separation that counts half: more of it is worth less than some for another pair (standard errors). Why:
/// saturating T criterion (Atkinson & Fedorov 1975).
pub(crate) const PLENTY: f64 = 5.0;

/// Separation below which poses settle nothing (standard errors). Why: three sigma.
pub(crate) const SETTLES: f64 = 3.0;

/// Separation below which effects are the same for this arm (standard errors). Why: less than half a standard
/// error.
pub(crate) const INSEPARABLE: f64 = 0.5;

/// Chosen poses keep from either limit (fraction of the range). Why: zeros are what is being looked for.
pub(crate) const CLEAR_OF_LIMITS: f64 = 0.02;

/// Limits as far apart say nothing of where a turning joint works (turns). Why: makers give plus and minus a
/// whole turn where nothing but the software stops a joint.
pub(crate) const TURNS_LIMITED: f64 = 1.9;

/// Limits as far apart say nothing of where a sliding joint works (mm). Why: 100 m is longer than any
/// travelling axis; anyone who does not know a slide's limits writes far more.
pub(crate) const LONGEST_SLIDE: f64 = 100_000.0;

/// Beyond what was measured, for joints without limits (fraction of the range). Why: judgement.
pub(crate) const RANGE_MARGIN: f64 = 0.15;

/// Size at which effects not shown are asked about (times the noise). Why: larger ones would show anyhow.
pub(crate) const ASKED_SIZE: f64 = 3.0;

/// Asked about at most, one effect each (kinds). Why: time.
pub(crate) const ASKED_KINDS: usize = 9;

// Batches (large tables)

/// From which effects are decided in batches (rows). Why: below, one by one is fast enough.
pub(crate) const BATCH_ROWS: usize = 400;

/// Of high order that make a batch (harmonics). Why: fewer are judged one by one.
pub(crate) const BATCH_FAMILY: usize = 3;

/// On which names in a batch are doubted (rows). Why: time.
pub(crate) const BATCH_JUDGED_ROWS: usize = 3000;

/// In one batch at most (effects). Why: time.
pub(crate) const BATCH_EFFECTS: usize = 120;

/// On the least cross-validated error that a smaller model may have (factor). Why: one-standard-error rule in
/// spirit (Breiman et al. 1984).
pub(crate) const BATCH_PARSIMONY: f64 = 1.01;

/// Of a candidate that must be left beyond what is fitted (fraction). Why: the pool is not refitted in between:
/// coarser than ABSORBED_REST.
pub(crate) const BATCH_LEFT: f64 = 1e-3;

// Epochs

/// Of rows between two jumps, and before the first and after the last, at least; events nearer to each other explain one jump (rows). Why: fewer are outliers.
pub(crate) const JUMP_ROWS: usize = 8;

/// A jump must be less likely by chance, after Bonferroni for all rows and numbers tried (probability). Why: the contract allows
/// two false finds in a hundred tables without a jump; Bonferroni keeps well below.
pub(crate) const JUMP_LEVEL: f64 = 1e-3;

/// Jumps looked for at most (jumps). Why: time; more are a drift.
pub(crate) const MOST_JUMPS: usize = 8;

/// A jump must be less likely by chance beside a smooth curve of the rows around it (probability). Why: a slow drift is no jump.
pub(crate) const CURVE_LEVEL: f64 = 1e-4;

/// On either side of a jump that are looked at for that (rows). Why: over so few a drift is smooth.
pub(crate) const CURVE_ROWS: usize = 60;

/// Two explanations by epoch are distinguished when their squared errors differ by more of their standard errors under the better one (standard
/// errors). Why: three sigma; Vuong 1989, Cox 1962.
pub(crate) const RIVAL_ERRORS: f64 = 3.0;

/// And when they differ by more of what the better one leaves (fraction of its squares). Why: of what both lack, one may take a part that only looks like what it
/// does; 0.15 is 7 % of an RMS.
pub(crate) const RIVAL_LEAVES: f64 = 0.15;

// Plausibility of the files

/// Distances this close agree with the arm (ln of a ratio). Why: 10 %: nominal arms are far better.
pub(crate) const UNITS_AGREE: f64 = 0.1;

/// Median beyond which a table does not belong to the arm (ln of a ratio). Why: a factor of 1.6.
pub(crate) const UNITS_FOREIGN: f64 = 0.5;

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    /// Name and value of every constant, as written in this file.
    fn in_source() -> BTreeMap<String, String> {
        let constants = include_str!("thresholds.rs").lines().filter_map(|line| {
            let (name, rest) = line.strip_prefix("pub(crate) const ")?.split_once(": ")?;
            let (_, value) = rest.trim_end_matches(';').split_once(" = ")?;
            Some((name.to_owned(), value.to_owned()))
        });
        constants.collect()
    }

    /// Name and value of every row of the README's table; every cell of it must be filled.
    fn in_readme() -> BTreeMap<String, String> {
        let rows = include_str!("../README.md").lines().filter(|line| line.starts_with("| `"));
        let cells = rows.map(|line| line.trim_matches('|').split('|').map(str::trim).collect::<Vec<&str>>());
        let constants = cells.filter(|cells| cells.len() == 6).map(|cells| {
            assert!(
                cells.iter().all(|cell| !cell.is_empty()),
                "{cells:?} lacks a unit, a source or a sensitivity"
            );
            (cells[0].trim_matches('`').to_owned(), cells[1].to_owned())
        });
        constants.collect()
    }

    /// The size in standard errors whose square is exceeded with this probability where nothing is there.
    fn two_sided_normal(probability: f64) -> f64 {
        plumb_estimation::chi_squared_quantile(1.0 - probability, 1.0).sqrt()
    }

    #[test]
    fn the_detectable_size_belongs_to_the_level_at_which_effects_are_named() {
        const CANDIDATES: f64 = 100.0;
        let level = two_sided_normal(super::NAMING_LEVEL / CANDIDATES);
        // Of a normal 80 % lie below this; two-sided, 40 % lie beyond it.
        let power = two_sided_normal(0.4);
        assert!((level - 4.17).abs() < 0.005 && (power - 0.84).abs() < 0.005, "{level} {power}");
        assert!((super::DETECTABLE_ERRORS - (level + power)).abs() < 0.05, "{}", level + power);
    }

    #[test]
    fn the_readmes_table_and_the_constants_are_the_same() {
        assert!(in_source().len() > 50);
        assert_eq!(in_source(), in_readme());
    }
}
