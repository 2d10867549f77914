//! The plugins that can be found, read from their manifests without loading anything.

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use plumb_plugin::{Manifest, ManifestError};

/// The plugins that can be found.
#[derive(Debug, Default)]
pub struct Catalogue {
    rows: Vec<CatalogueRow>,
    directories: Vec<PathBuf>,
}

/// A manifest that was found, with the plugin it describes or what is wrong with it.
#[derive(Debug)]
pub struct CatalogueRow {
    /// The manifest file.
    pub manifest_path: PathBuf,
    /// The plugin, or why it cannot be used.
    pub plugin: Result<Plugin, CatalogueError>,
}

/// A plugin whose manifest is good and whose library lies where it should.
#[derive(Clone, Debug, PartialEq)]
pub struct Plugin {
    /// What its manifest says.
    pub manifest: Manifest,
    /// The manifest file.
    pub manifest_path: PathBuf,
    /// The library.
    pub library_path: PathBuf,
}

/// Why a plugin cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CatalogueError {
    /// The manifest cannot be used.
    #[error(transparent)]
    Manifest(#[from] ManifestError),
    /// The library is not there.
    #[error(
        "{}: {} is not there; looked in {}; build the plugins with `cargo build --release`, or install plumb with them: `cargo xtask package`",
        manifest.display(),
        missing(library, id),
        list(looked_in)
    )]
    NoLibrary {
        /// The manifest file.
        manifest: PathBuf,
        /// The plugin.
        id: String,
        /// The library's file name.
        library: String,
        /// Where it was looked for.
        looked_in: Vec<PathBuf>,
    },
    /// Somebody else may change what would be loaded.
    #[error(
        "{}: not loaded, because {why}; mend its rights, or name its folder with --plugins or under `plugins:` in the cell file if you trust it",
        manifest.display()
    )]
    NotTrusted {
        /// The manifest file.
        manifest: PathBuf,
        /// The plugin.
        id: String,
        /// Which file, and who may change it.
        why: String,
    },
    /// A plugin of that name is there, but cannot be used.
    #[error("{reason}")]
    Unusable {
        /// Why, and what would be right.
        reason: String,
    },
    /// No plugin of that name.
    #[error(
        "there is no plugin '{id}'{}{}; looked in {}",
        suggestion(known),
        unusable(broken),
        list(looked_in)
    )]
    Unknown {
        /// The name asked for.
        id: String,
        /// The plugins there are.
        known: Vec<String>,
        /// What is wrong with those that were found and cannot be used.
        broken: Vec<String>,
        /// The directories searched.
        looked_in: Vec<PathBuf>,
    },
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}

/// What is missing: the plugin's own library, or the one of plumb that runs drivers in other languages.
fn missing(library: &str, id: &str) -> String {
    match library {
        Manifest::BRIDGE_LIBRARY => format!("plumb's own {library}, which runs the driver of plugin '{id}',"),
        own => format!("library {own} of plugin '{id}'"),
    }
}

fn suggestion(known: &[String]) -> String {
    if known.is_empty() { String::new() } else { format!("; there are {}", known.join(", ")) }
}

fn unusable(broken: &[String]) -> String {
    broken.iter().map(|reason| format!("; one cannot be used: {reason}")).collect()
}

/// How many directories above the program a `plugins` directory is looked for: a program built from source lies in `target/debug/deps`.
const LEVELS_ABOVE: usize = 4;

/// The plugins of the source this was built from.
const SOURCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../plugins");

/// Where cargo puts what it builds with this: `target/release` or `target/debug`, three levels above the folder of a build script.
const BUILT: &str = concat!(env!("OUT_DIR"), "/../../..");

/// Where an installed program has its plugins, from the folder it lies in.
const INSTALLED: &str = "../lib/plumb/plugins";

impl Catalogue {
    /// The plugins in the directories that somebody `named`, beside the program, in `lib/plumb/plugins` of the prefix it is installed in, and in a
    /// directory `plugins` beside or above it. A program that is not installed with its plugins takes those of the source it was built from,
    /// where that is still there: `cargo install` and a target directory elsewhere leave them there. The first of a name counts.
    ///
    /// What lies in a directory that nobody named is loaded only when nobody but the user and root may change it.
    pub fn search(named: &[PathBuf]) -> Self {
        Self::search_for_cell(named, None)
    }

    /// The same, with what lies in the folder of a cell's file and in `plugins` there. These come last: no plugin of the program's own is replaced
    /// unless somebody names the other.
    pub fn search_for_cell(named: &[PathBuf], cell: Option<&Path>) -> Self {
        let mut directories = named.to_vec();
        let program_directory = program_directory();
        if let Some(directory) = &program_directory {
            directories.push(directory.clone());
            directories.extend(fs::canonicalize(directory.join(INSTALLED)));
            directories.extend(directory.ancestors().take(LEVELS_ABOVE).map(|above| above.join("plugins")));
        }
        let is_installed =
            program_directory.as_ref().is_some_and(|directory| directory.join(INSTALLED).is_dir());
        let of_the_source = fs::canonicalize(SOURCE).ok().filter(|_| !is_installed);
        directories.extend(of_the_source);
        if let Some(folder) = cell.and_then(Path::parent).map(|folder| Path::new(".").join(folder)) {
            directories.extend([folder.join("plugins"), folder]);
        }
        directories.retain(|directory| directory.is_dir());
        let mut seen = BTreeSet::new();
        directories.retain(|directory| seen.insert(fs::canonicalize(directory).ok()));
        let mut catalogue = Self::of(directories, program_directory.as_deref());
        for row in &mut catalogue.rows {
            let is_named = named.iter().any(|directory| row.manifest_path.starts_with(directory));
            let why = match &row.plugin {
                Ok(plugin) if !is_named => foreign_hands(plugin),
                _ => None,
            };
            if let (Some(why), Ok(plugin)) = (why, &row.plugin) {
                let (manifest, id) = (row.manifest_path.clone(), plugin.manifest.id.clone());
                row.plugin = Err(CatalogueError::NotTrusted { manifest, id, why });
            }
        }
        catalogue
    }

    /// The plugins in some directories alone, whose libraries lie beside their manifests or beside the program.
    fn of(directories: Vec<PathBuf>, program_directory: Option<&Path>) -> Self {
        let mut catalogue = Self { rows: Vec::new(), directories };
        for directory in catalogue.directories.clone() {
            for manifest_path in manifests_in(&directory) {
                let plugin = read(&manifest_path, program_directory);
                let id = |plugin: &Result<Plugin, CatalogueError>| {
                    plugin.as_ref().ok().map(|p| p.manifest.id.clone())
                };
                let seen = |row: &CatalogueRow| {
                    row.manifest_path == manifest_path
                        || id(&row.plugin).is_some() && id(&row.plugin) == id(&plugin)
                };
                if !catalogue.rows.iter().any(seen) {
                    catalogue.rows.push(CatalogueRow { manifest_path, plugin });
                }
            }
        }
        catalogue
    }

    /// Everything that was found, good or bad.
    pub fn rows(&self) -> &[CatalogueRow] {
        &self.rows
    }

    /// The plugins that can be used.
    pub fn plugins(&self) -> impl Iterator<Item = &Plugin> {
        self.rows.iter().filter_map(|row| row.plugin.as_ref().ok())
    }

    /// The directories that were searched.
    pub fn directories(&self) -> &[PathBuf] {
        &self.directories
    }

    /// The plugin of a name.
    ///
    /// # Errors
    /// [`CatalogueError::Unusable`] when it is found and cannot be used, [`CatalogueError::Unknown`] with the names there are.
    pub fn find(&self, id: &str) -> Result<&Plugin, CatalogueError> {
        if let Some(plugin) = self.plugins().find(|plugin| plugin.manifest.id == id) {
            return Ok(plugin);
        }
        if let Some(reason) = self.rows.iter().find_map(|row| row.why_unusable(id)) {
            return Err(CatalogueError::Unusable { reason });
        }
        Err(CatalogueError::Unknown {
            id: id.to_owned(),
            known: self.plugins().map(|plugin| plugin.manifest.id.clone()).collect(),
            broken: self
                .rows
                .iter()
                .filter_map(|row| row.plugin.as_ref().err().map(ToString::to_string))
                .collect(),
            looked_in: self.directories.clone(),
        })
    }
}

impl CatalogueRow {
    /// Why the plugin of this name cannot be used, if it is the one here: by the name in its manifest, or where that cannot be read, its folder's.
    fn why_unusable(&self, requested: &str) -> Option<String> {
        let error = self.plugin.as_ref().err()?;
        let is_it = match error {
            CatalogueError::NoLibrary { id, .. }
            | CatalogueError::NotTrusted { id, .. }
            | CatalogueError::Manifest(ManifestError::Contract { id, .. }) => id == requested,
            _ => {
                let folder = self.manifest_path.parent().and_then(Path::file_name);
                folder.is_some_and(|folder| folder == requested)
            }
        };
        is_it.then(|| error.to_string())
    }
}

impl Plugin {
    /// The plugin of a manifest file, whose library lies beside it or beside the program.
    ///
    /// # Errors
    /// [`CatalogueError`].
    pub fn at(manifest_path: &Path) -> Result<Self, CatalogueError> {
        read(manifest_path, program_directory().as_deref())
    }
}

impl Plugin {
    /// The plugin of a manifest file and a library, wherever they lie.
    ///
    /// # Errors
    /// [`ManifestError`].
    pub fn at_library(manifest_path: &Path, library_path: &Path) -> Result<Self, ManifestError> {
        let manifest = Manifest::read(manifest_path)?;
        Ok(Self { manifest, manifest_path: manifest_path.to_owned(), library_path: library_path.to_owned() })
    }
}

impl Plugin {
    /// The files of its own folder that the command of its driver names.
    pub fn driver_files(&self) -> Vec<PathBuf> {
        let folder = self.manifest_path.parent().unwrap_or(Path::new(""));
        let files = self.manifest.driver.iter().map(|word| folder.join(word));
        files.filter(|path| path.is_file()).collect()
    }
}

/// A file of a plugin, or the directory it lies in, that somebody else than the user and root may change, and who.
fn foreign_hands(plugin: &Plugin) -> Option<String> {
    let files = [plugin.manifest_path.clone(), plugin.library_path.clone()];
    files
        .iter()
        .chain(&plugin.driver_files())
        .flat_map(|file| [Some(file.as_path()), file.parent()])
        .flatten()
        .find_map(may_be_changed)
}

/// Who else may change a file or what lies in a directory.
fn may_be_changed(path: &Path) -> Option<String> {
    /// The right of everybody to write.
    const EVERYBODY_WRITES: u32 = 0o002;
    let found = fs::metadata(path).ok()?;
    let own = fs::metadata("/proc/self").map_or(0, |process| process.uid());
    let shown = path.display();
    if found.uid() != 0 && found.uid() != own {
        return Some(format!("{shown} belongs to another user, number {}", found.uid()));
    }
    (found.permissions().mode() & EVERYBODY_WRITES != 0).then(|| format!("everybody may write to {shown}"))
}

/// The folder this program lies in.
fn program_directory() -> Option<PathBuf> {
    env::current_exe().ok().and_then(|program| Some(program.parent()?.to_owned()))
}

/// The manifests in a directory and in those directly below it, in order of name.
fn manifests_in(directory: &Path) -> Vec<PathBuf> {
    let mut directories = vec![directory.to_owned()];
    if let Ok(entries) = fs::read_dir(directory) {
        let mut below: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
        below.sort();
        directories.extend(below);
    }
    directories
        .into_iter()
        .map(|folder| folder.join(Manifest::FILE_NAME))
        .filter(|path| path.is_file())
        .collect()
}

fn read(manifest_path: &Path, program_directory: Option<&Path>) -> Result<Plugin, CatalogueError> {
    let manifest = Manifest::read(manifest_path)?;
    let own = manifest_path.parent().unwrap_or(Path::new(""));
    let mut folders = vec![own.to_owned()];
    folders.extend(built_beside(own, &manifest.library));
    if let Some(program) = program_directory {
        // Cargo's tests bring only the libraries in `deps` up to date, so these come before those beside the program.
        folders.extend([program.join("deps"), program.to_owned(), program.join(INSTALLED)]);
    }
    // What runs a driver is plumb's own, wherever the driver lies.
    let of_the_source = fs::canonicalize(SOURCE)
        .is_ok_and(|source| manifest_path.starts_with(source) || !manifest.driver.is_empty());
    if let (true, Ok(built)) = (of_the_source, fs::canonicalize(BUILT)) {
        let more = [built.join("deps"), built];
        folders.extend(
            more.into_iter()
                .filter(|folder| program_directory.is_none_or(|known| !folder.starts_with(known))),
        );
    }
    let library = folders.iter().map(|folder| folder.join(&manifest.library)).find(|path| path.is_file());
    match library {
        Some(library_path) => Ok(Plugin { manifest, manifest_path: manifest_path.to_owned(), library_path }),
        None => Err(CatalogueError::NoLibrary {
            manifest: manifest_path.to_owned(),
            id: manifest.id,
            library: manifest.library,
            looked_in: folders,
        }),
    }
}

/// Where cargo puts a library that it builds in a plugin's own project: the newer of `target/debug` and `target/release` first.
fn built_beside(folder: &Path, library: &str) -> Vec<PathBuf> {
    if !folder.join("Cargo.toml").is_file() {
        return Vec::new();
    }
    let mut folders = ["debug", "release"].map(|profile| folder.join("target").join(profile));
    folders.sort_by_key(|folder| fs::metadata(folder.join(library)).and_then(|file| file.modified()).ok());
    folders.reverse();
    folders.to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_everybody_may_change_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("libarm.so");
        fs::write(&file, "").unwrap();
        assert_eq!(may_be_changed(&file), None);
        assert_eq!(may_be_changed(folder.path()), None);
        fs::set_permissions(&file, fs::Permissions::from_mode(0o666)).unwrap();
        assert_eq!(may_be_changed(&file), Some(format!("everybody may write to {}", file.display())));
        assert_eq!(may_be_changed(Path::new("/usr")), None, "root's own are trusted");
    }

    const MANIFEST: &str = "id: arm\ntitle: An arm\nversion: 0.1.0\ncontract: [1, 0]\nkind: robot\nlibrary: libarm.so\n\
                            streams: [{name: joints, message: joint-state/1}]\n";

    /// A folder with the plugin `arm`, whose library is there or not.
    fn plugin_in(folder: &Path, with_library: bool) {
        fs::create_dir_all(folder).unwrap();
        fs::write(folder.join("plugin.yaml"), MANIFEST).unwrap();
        if with_library {
            fs::write(folder.join("libarm.so"), "").unwrap();
        }
    }

    #[test]
    fn the_first_plugin_of_a_name_counts_and_a_folder_is_searched_one_level_deep() {
        let folder = tempfile::tempdir().unwrap();
        let (first, second) = (folder.path().join("a"), folder.path().join("b"));
        plugin_in(&first.join("arm"), true);
        plugin_in(&second.join("arm"), true);
        plugin_in(&second.join("deep/er"), true);
        let catalogue = Catalogue::of(vec![first.clone(), second.clone()], None);
        assert_eq!(catalogue.find("arm").unwrap().manifest_path, first.join("arm/plugin.yaml"));
        assert_eq!(catalogue.rows().len(), 1);
        assert_eq!(catalogue.directories(), [first, second]);
    }

    #[test]
    fn a_plugin_that_cannot_be_used_is_reported_by_the_name_of_its_manifest_or_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        plugin_in(&folder.path().join("some"), false);
        let broken = folder.path().join("leg");
        fs::create_dir(&broken).unwrap();
        fs::write(broken.join("plugin.yaml"), "id: [\n").unwrap();
        let catalogue = Catalogue::of(vec![folder.path().to_owned()], None);
        let reason = |id: &str| match catalogue.find(id).unwrap_err() {
            CatalogueError::Unusable { reason } => Some(reason),
            CatalogueError::Unknown { looked_in, broken, .. } => {
                assert_eq!((looked_in.len(), broken.len()), (1, 2));
                None
            }
            other => panic!("{other}"),
        };
        assert!(reason("arm").unwrap().contains("library libarm.so of plugin 'arm'"));
        assert!(reason("leg").unwrap().contains("leg/plugin.yaml"));
        assert_eq!((reason("some"), reason("wing")), (None, None));
        let unknown = catalogue.find("wing").unwrap_err().to_string();
        assert!(unknown.contains(&folder.path().display().to_string()), "where it was looked for: {unknown}");
        assert!(unknown.contains("; one cannot be used: "), "what else is there: {unknown}");
    }

    #[test]
    fn a_plugin_that_nobody_named_is_trusted_only_where_nobody_else_may_change_it() {
        let folder = tempfile::tempdir().unwrap();
        let cell = folder.path().join("cell.yaml");
        plugin_in(&folder.path().join("plugins/arm"), true);
        let library = folder.path().join("plugins/arm/libarm.so");
        let found = |named: &[PathBuf]| {
            let catalogue = Catalogue::search_for_cell(named, Some(&cell));
            catalogue.find("arm").map(drop).map_err(|error| error.to_string())
        };
        assert_eq!(found(&[]), Ok(()));
        fs::set_permissions(&library, fs::Permissions::from_mode(0o666)).unwrap();
        let error = found(&[]).unwrap_err();
        assert!(error.contains("everybody may write to") && error.contains("libarm.so"), "{error}");
        assert_eq!(found(&[folder.path().join("plugins")]), Ok(()), "somebody has named it");
    }

    #[test]
    fn what_another_user_owns_is_reported_with_its_number() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("libarm.so");
        fs::write(&file, "").unwrap();
        if std::os::unix::fs::chown(&file, Some(54_321), None).is_err() {
            println!("skipped: only root may give a file away");
            return;
        }
        let why = format!("{} belongs to another user, number 54321", file.display());
        assert_eq!(may_be_changed(&file), Some(why));
    }

    /// The plugin `arm` of a folder whose driver is `driver.py`, and the file of its manifest.
    fn driver_in(folder: &Path) -> PathBuf {
        let manifest_path = folder.join("plugin.yaml");
        fs::write(&manifest_path, MANIFEST.replace("library: libarm.so", "driver: [python3, driver.py]"))
            .unwrap();
        fs::write(folder.join("driver.py"), "").unwrap();
        manifest_path
    }

    #[test]
    fn the_files_of_a_driver_are_those_its_command_names_and_are_trusted_like_a_library() {
        let folder = tempfile::tempdir().unwrap();
        let (manifest_path, script) = (driver_in(folder.path()), folder.path().join("driver.py"));
        let plugin = Plugin::at_library(&manifest_path, &manifest_path).unwrap();
        assert_eq!(plugin.driver_files(), [script.as_path()], "there is no file called python3");
        assert_eq!(foreign_hands(&plugin), None);
        fs::set_permissions(&script, fs::Permissions::from_mode(0o666)).unwrap();
        assert_eq!(foreign_hands(&plugin), Some(format!("everybody may write to {}", script.display())));
    }

    /// Where the library of a manifest is looked for: where it was found, or all the folders where it was not.
    fn looked_in(manifest_path: &Path, program_directory: Option<&Path>) -> Vec<PathBuf> {
        match read(manifest_path, program_directory) {
            Ok(plugin) => vec![plugin.library_path.parent().unwrap().to_owned()],
            Err(CatalogueError::NoLibrary { looked_in, .. }) => looked_in,
            Err(other) => panic!("{other}"),
        }
    }

    #[test]
    fn what_runs_drivers_is_looked_for_where_plumb_was_built_and_a_plugins_library_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let built = fs::canonicalize(BUILT).unwrap();
        plugin_in(folder.path(), false);
        assert_eq!(looked_in(&folder.path().join("plugin.yaml"), None), [folder.path()]);
        let driver = driver_in(folder.path());
        let folders = looked_in(&driver, None);
        assert!(folders.iter().any(|folder| folder.starts_with(&built)), "{folders:?}");
        let mut folders = looked_in(&driver, Some(&built));
        let all = folders.len();
        folders.dedup();
        folders.sort();
        folders.dedup();
        assert_eq!(folders.len(), all, "no place twice: {folders:?}");
    }

    #[test]
    fn a_library_that_is_not_there_is_named_with_whose_it_is_and_where_it_was_looked_for() {
        let message = |library: &str| {
            let error = CatalogueError::NoLibrary {
                manifest: PathBuf::from("arm/plugin.yaml"),
                id: "arm".to_owned(),
                library: library.to_owned(),
                looked_in: vec![PathBuf::from("arm"), PathBuf::from("lib")],
            };
            error.to_string()
        };
        let own =
            "arm/plugin.yaml: library libarm.so of plugin 'arm' is not there; looked in arm, lib; build";
        assert!(message("libarm.so").starts_with(own), "{}", message("libarm.so"));
        let bridge = Manifest::BRIDGE_LIBRARY;
        let of_plumb = format!(
            "arm/plugin.yaml: plumb's own {bridge}, which runs the driver of plugin 'arm', is not there; looked in"
        );
        assert!(message(bridge).starts_with(&of_plumb), "{}", message(bridge));
    }

    #[test]
    fn a_broken_manifest_that_two_directories_lead_to_is_one_row() {
        let folder = tempfile::tempdir().unwrap();
        let broken = folder.path().join("leg");
        fs::create_dir(&broken).unwrap();
        fs::write(broken.join("plugin.yaml"), "id: [\n").unwrap();
        let catalogue = Catalogue::of(vec![folder.path().to_owned(), broken.clone()], None);
        assert_eq!(catalogue.rows().len(), 1);
        assert_eq!(catalogue.rows()[0].manifest_path, broken.join("plugin.yaml"));
    }

    #[test]
    fn a_program_that_is_not_installed_has_the_plugins_of_its_source() {
        let source = fs::canonicalize(SOURCE).unwrap();
        let catalogue = Catalogue::search(&[]);
        let is_searched =
            |directory: &PathBuf| fs::canonicalize(directory).is_ok_and(|found| found == source);
        assert!(catalogue.directories().iter().any(is_searched), "{:?}", catalogue.directories());
    }

    #[test]
    fn of_the_two_a_plugin_was_built_into_the_newer_comes_first() {
        let directory = tempfile::tempdir().unwrap();
        let folder = directory.path();
        assert!(built_beside(folder, "libarm.so").is_empty(), "it is no project of cargo's");
        fs::write(folder.join("Cargo.toml"), "").unwrap();
        let library = |profile: &str| folder.join("target").join(profile).join("libarm.so");
        for profile in ["debug", "release"] {
            fs::create_dir_all(library(profile).parent().unwrap()).unwrap();
        }
        fs::write(library("release"), "").unwrap();
        assert_eq!(built_beside(folder, "libarm.so")[0], folder.join("target/release"));
        let later = std::time::SystemTime::now() + std::time::Duration::from_secs(60);
        fs::File::create(library("debug")).unwrap().set_modified(later).unwrap();
        assert_eq!(built_beside(folder, "libarm.so")[0], folder.join("target/debug"));
    }
}
