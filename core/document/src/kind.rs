//! The kinds of files that are read, and how large each may be.

/// One mebibyte.
const MIB: u64 = 1 << 20;

/// A kind of file: its name in messages, and the size beyond which it is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FileKind {
    /// With its article, as in "a cell file".
    pub name: &'static str,
    /// Bytes.
    pub most_bytes: u64,
}

/// What a person writes by hand. The largest that is shipped has 20 kB, and a YAML value of one byte takes some 100 bytes of memory.
const BY_HAND: u64 = MIB;

impl FileKind {
    /// `cell:`
    pub const CELL: Self = Self { name: "a file written by hand", most_bytes: BY_HAND };
    /// A model of an arm.
    pub const MODEL: Self = Self { name: "a model file", most_bytes: BY_HAND };
    /// A simulated world or arm. Under a seal every byte is two digits.
    pub const WORLD: Self = Self { name: "a world file", most_bytes: 3 * BY_HAND };
    /// The plane, camera and hand of a light stripe.
    pub const RIG: Self = Self { name: "a rig file", most_bytes: BY_HAND };
    /// Surfaces that a scan is compared with.
    pub const SCENE: Self = Self { name: "a scene file", most_bytes: BY_HAND };
    /// A plugin's `plugin.yaml`.
    pub const MANIFEST: Self = Self { name: "a plugin's manifest", most_bytes: BY_HAND };
    /// A study of a cell.
    pub const STUDY: Self = Self { name: "a study file", most_bytes: BY_HAND };
    /// What a trial hid, and what a program said of it; it lists every row of the trial's table.
    pub const TRIAL: Self = Self { name: "a trial's file", most_bytes: 64 * MIB };
    /// An arm as other programs describe it. The largest published have about 1 MB (meshes lie in files of their own), and an XML element
    /// takes some 20 times its bytes in memory.
    pub const URDF: Self = Self { name: "a URDF file", most_bytes: 4 * MIB };
    /// The poses a repetition goes through. A run has at most 20,000 steps; so many rows of 20 numbers have 4 MB.
    pub const POSES: Self = Self { name: "a table of poses", most_bytes: 4 * MIB };
    /// Measurements: a million rows of 20 numbers.
    pub const TABLE: Self = Self { name: "a table", most_bytes: 256 * MIB };
    /// A picture. 8192 x 8192 grey pixels of two bytes have 128 MiB; as plain text (P2) a smaller one fits.
    pub const PICTURE: Self = Self { name: "a picture", most_bytes: 192 * MIB };
    /// A photograph that an operator took; a camera's largest JPEG has some 40 MB.
    pub const PHOTO: Self = Self { name: "a photograph", most_bytes: 64 * MIB };
    /// A point cloud, read whole: five million points of eight 32-bit numbers have 160 MB.
    pub const CLOUD: Self = Self { name: "a cloud", most_bytes: 192 * MIB };
    /// A program taught to a TeachMover; its memory holds 53 lines of eight numbers.
    pub const TAUGHT_PROGRAM: Self = Self { name: "a taught program", most_bytes: 64 << 10 };
    /// What a simulated controller keeps of its own.
    pub const CALIBRATION: Self = Self { name: "a controller's calibration", most_bytes: 64 << 10 };
    /// A plugin's library with its debugging information.
    pub const LIBRARY: Self = Self { name: "a library", most_bytes: 1 << 30 };
    /// A run's events, read line by line; a long run writes some 100 MB a day.
    pub const EVENTS: Self = Self { name: "a file of events", most_bytes: 16 << 30 };
}
