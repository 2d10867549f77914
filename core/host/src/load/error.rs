//! Why a library cannot be used as a plugin.

use std::path::PathBuf;

use plumb_plugin::ContractVersion;

/// Why a library cannot be used as a plugin.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LoadError {
    /// The system cannot load it.
    #[error("{}: is not a library that can be loaded: {cause}", library.display())]
    NotALibrary {
        /// The file.
        library: PathBuf,
        /// What the system's loader said.
        cause: String,
    },
    /// Its name is too long for an entry symbol.
    #[error("{}: its name is too long; 100 characters are enough", library.display())]
    Name {
        /// The file.
        library: PathBuf,
    },
    /// It has no entry.
    #[error("{}: is not a plugin: it has no symbol {symbol} (a library that is renamed loses it)", library.display())]
    NoEntry {
        /// The file.
        library: PathBuf,
        /// The symbol that belongs to its name.
        symbol: String,
    },
    /// Its entry is damaged.
    #[error("{}: is not a usable plugin: {what}", library.display())]
    BadEntry {
        /// The file.
        library: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// It was built for another contract.
    #[error(
        "{}: was built for plugin contract {built_for}; this program speaks {speaks}: rebuild the plugin against contract {}.x",
        library.display(),
        speaks.0
    )]
    Contract {
        /// The file.
        library: PathBuf,
        /// The version it was built for.
        built_for: ContractVersion,
        /// The version of this program.
        speaks: ContractVersion,
    },
    /// The manifest built into it cannot be read.
    #[error("{}: the manifest built into it cannot be read: {cause}", library.display())]
    BuiltInManifest {
        /// The file.
        library: PathBuf,
        /// What is wrong.
        cause: String,
    },
    /// It does not belong to the manifest beside it.
    #[error("{}: does not belong to its plugin.yaml: {what}; build the plugin again", library.display())]
    Stale {
        /// The file.
        library: PathBuf,
        /// What differs.
        what: String,
    },
    /// The functions of its kind are not there, or not whole.
    #[error("{}: {what}", library.display())]
    Functions {
        /// The file.
        library: PathBuf,
        /// What is wrong with them.
        what: String,
    },
}
