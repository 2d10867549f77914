//! What the keys of the Scan screen ask for.

/// What a key of the Scan screen asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ScanCommand {
    /// Go to the left around the cloud.
    TurnLeft,
    /// Go to the right.
    TurnRight,
    /// Go up.
    TurnUp,
    /// Go down.
    TurnDown,
    /// Roll to the left.
    RollLeft,
    /// Roll to the right.
    RollRight,
    /// Move to the left.
    MoveLeft,
    /// Move to the right.
    MoveRight,
    /// Move up.
    MoveUp,
    /// Move down.
    MoveDown,
    /// Show less, larger.
    Nearer,
    /// Show more, smaller.
    Farther,
    /// Open the virtual camera wider.
    Wider,
    /// Open it less wide, down to parallel rays.
    Narrower,
    /// From the next of the usual sides.
    NextSide,
    /// The whole cloud.
    Whole,
    /// Points or stripes.
    Strokes,
    /// Colour by the next thing.
    Colour,
    /// Along the plane most points lie in, and back.
    EdgeOn,
    /// The cross to the left.
    AimLeft,
    /// The cross to the right.
    AimRight,
    /// The cross up.
    AimUp,
    /// The cross down.
    AimDown,
    /// Measure distances from the point under the cursor.
    Mark,
    /// Save a picture of the view.
    Picture,
    /// Save a picture for each eye.
    Stereo,
}
