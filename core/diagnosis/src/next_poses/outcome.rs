//! What poses are chosen for, and what does what they do not.

/// What poses are chosen for.
#[derive(Debug, Clone, PartialEq)]
pub enum Asked {
    /// To distinguish effects in question.
    Rivals {
        /// One of them is the name.
        named: bool,
        /// Pairs that the poses do not distinguish.
        alike: Vec<(String, String)>,
    },
    /// To show what the rows do not.
    NotShown {
        /// What they would show.
        shown: Vec<String>,
        /// At so many times the noise.
        size: f64,
    },
}

/// What does what poses within reach do not.
#[derive(Debug, Clone, PartialEq)]
pub enum Instead {
    /// Another way of measuring distinguishes them.
    Way {
        /// Which.
        way: OtherWay,
        /// By how many standard errors.
        separation: f64,
        /// In how many poses.
        poses: usize,
    },
    /// Nothing: for this arm they are the same thing.
    Same,
    /// Nothing: they differ by less than these readings show.
    BelowNoise,
    /// Of what the rows do not show: what the poses would not show either, and how it is seen.
    NotShownEither {
        /// The effects, as `add` takes them.
        hidden: Vec<String>,
        /// How the first of them is seen.
        how_to_see: &'static str,
    },
}

/// Another way of measuring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OtherWay {
    /// With a load, kg.
    Load(f64),
    /// With an instrument that measures whole positions.
    WholePositions,
    /// With a second point on the hand.
    SecondPoint,
}
