//! Which files of a crate import one another: an edge for every name that a file takes from the file that defines it, `pub use` followed.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::source::{Source, Token, root};

/// A module by its path below the root of its crate.
type ModulePath = Vec<String>;

/// The modules of one crate.
#[derive(Default)]
struct Crate {
    modules: BTreeMap<ModulePath, Module>,
}

/// One module that has a file of its own.
struct Module {
    file: String,
    tokens: Vec<Token>,
    /// Names of what it defines.
    defines: BTreeSet<String>,
    /// What it imports for itself.
    uses: Vec<Vec<String>>,
    /// What it imports for others as well.
    reexports: Vec<Vec<String>>,
}

/// Words after which a name is defined.
const DEFINERS: [&str; 9] =
    ["fn", "struct", "enum", "trait", "type", "const", "static", "union", "macro_rules"];

/// Deeper than any chain of re-exports.
const DEEPEST: usize = 12;

/// The circles of all crates, each as its files.
pub(crate) fn circles() -> Vec<BTreeSet<String>> {
    crates().iter().flat_map(Crate::circles).collect()
}

fn crates() -> Vec<Crate> {
    let mut manifests = vec![root().join("tui"), root().join("tests/studies")];
    for folder in ["core", "plugins"] {
        manifests.extend(std::fs::read_dir(root().join(folder)).unwrap().map(|entry| entry.unwrap().path()));
    }
    let roots = manifests.iter().flat_map(|folder| [folder.join("src/lib.rs"), folder.join("src/main.rs")]);
    roots.filter(|file| file.is_file()).map(|file| Crate::read(&file)).collect()
}

impl Crate {
    fn read(file: &Path) -> Self {
        let mut found = Self::default();
        found.load(Vec::new(), file, file.parent().unwrap_or(file));
        found
    }

    /// Reads a module and those that it declares; `folder` is where they lie.
    fn load(&mut self, path: ModulePath, file: &Path, folder: &Path) {
        let source = Source::read(file);
        for (name, given) in declared(&source.tokens) {
            let beside = file.parent().unwrap_or(file);
            let paths: Vec<PathBuf> = match given {
                Some(given) => vec![beside.join(given)],
                None => vec![folder.join(format!("{name}.rs")), folder.join(&name).join("mod.rs")],
            };
            if let Some(found) = paths.into_iter().find(|path| path.is_file()) {
                let below = match found.file_name().is_some_and(|name| name == "mod.rs") {
                    true => found.parent().unwrap_or(folder).to_owned(),
                    false => found.with_extension(""),
                };
                self.load([path.clone(), vec![name]].concat(), &found, &below);
            }
        }
        let (uses, reexports, rest) = imports(&source.tokens);
        let defines = definitions(&rest);
        let module = Module { file: source.path, tokens: rest, defines, uses, reexports };
        self.modules.insert(path, module);
    }

    /// The module and the rest of the names that a path leads to from a module; none for a path out of the crate.
    fn resolve(&self, from: &ModulePath, path: &[String]) -> Option<(ModulePath, Vec<String>)> {
        let first = path.first()?.as_str();
        match first {
            "crate" => Some((Vec::new(), path.get(1..)?.to_vec())),
            "self" => Some((from.clone(), path.get(1..)?.to_vec())),
            "super" => {
                let ups = path.iter().take_while(|word| *word == "super").count();
                let module = from.get(..from.len().checked_sub(ups)?)?.to_vec();
                Some((module, path.get(ups..)?.to_vec()))
            }
            _ => {
                let below = [from.clone(), vec![first.to_owned()]].concat();
                self.modules.contains_key(&below).then(|| (from.clone(), path.to_vec()))
            }
        }
    }

    /// The module that defines the first of these names, as seen from a module; none for a module itself or a name of elsewhere.
    fn definer(&self, module: &ModulePath, names: &[String], depth: usize) -> Option<ModulePath> {
        if depth > DEEPEST {
            return None;
        }
        let name = names.first()?;
        let below = [module.clone(), vec![name.clone()]].concat();
        if self.modules.contains_key(&below) {
            return self.definer(&below, names.get(1..)?, depth + 1);
        }
        let here = self.modules.get(module)?;
        if name == "*" || here.defines.contains(name) {
            return Some(module.clone());
        }
        for path in &here.reexports {
            let last = path.last()?;
            if last != name && last != "*" {
                continue;
            }
            let Some((from, mut rest)) = self.resolve(module, path) else { continue };
            if last == "*" {
                rest.pop();
                rest.push(name.clone());
            }
            if let Some(found) = self.definer(&from, &rest, depth + 1) {
                return Some(found);
            }
        }
        Some(module.clone())
    }

    /// The modules whose definitions a module uses.
    fn neighbours(&self, path: &ModulePath, module: &Module) -> BTreeSet<ModulePath> {
        let mut paths = module.uses.clone();
        paths.extend(written_out(&module.tokens));
        // `name::rest` after `use ..::name`.
        let imported = module.uses.iter().chain(&module.reexports);
        let imported: BTreeMap<&String, &Vec<String>> =
            imported.filter_map(|path| path.last().map(|name| (name, path))).collect();
        for (first, second) in pairs(&module.tokens) {
            if let Some(begin) = imported.get(&first) {
                paths.push([(*begin).clone(), vec![second]].concat());
            }
        }
        let resolved = paths.iter().filter_map(|names| self.resolve(path, names));
        let found = resolved.filter_map(|(from, names)| self.definer(&from, &names, 0));
        found.filter(|other| other != path).collect()
    }

    fn circles(&self) -> Vec<BTreeSet<String>> {
        let edges: BTreeMap<&ModulePath, BTreeSet<ModulePath>> =
            self.modules.iter().map(|(path, module)| (path, self.neighbours(path, module))).collect();
        let reached: BTreeMap<&ModulePath, BTreeSet<ModulePath>> =
            edges.keys().map(|path| (*path, reachable(path, &edges))).collect();
        let mut circles: BTreeSet<BTreeSet<String>> = BTreeSet::new();
        for (path, reach) in &reached {
            let both = |other: &&ModulePath| reach.contains(*other) && reached[*other].contains(*path);
            let circle: BTreeSet<String> =
                self.modules.keys().filter(both).map(|other| self.modules[other].file.clone()).collect();
            if circle.len() > 1 {
                circles.insert(circle);
            }
        }
        circles.into_iter().collect()
    }
}

/// Every module that can be reached from one.
fn reachable(from: &ModulePath, edges: &BTreeMap<&ModulePath, BTreeSet<ModulePath>>) -> BTreeSet<ModulePath> {
    let (mut seen, mut open) = (BTreeSet::new(), vec![from.clone()]);
    while let Some(next) = open.pop() {
        for other in edges.get(&next).into_iter().flatten() {
            if seen.insert(other.clone()) {
                open.push(other.clone());
            }
        }
    }
    seen
}

/// The modules that a file declares with a file of their own: name, and the path that an attribute gives.
fn declared(tokens: &[Token]) -> Vec<(String, Option<String>)> {
    let text = |at: usize| tokens.get(at).map_or("", |token| token.text.as_str());
    let mut found = Vec::new();
    for at in 0..tokens.len() {
        if text(at) != "mod" || text(at + 2) != ";" {
            continue;
        }
        // `#[path = "..."] mod name;`, with a visibility in between at most.
        let attribute =
            (at.saturating_sub(12)..at).rev().find(|at| text(*at) == "path" && text(at + 1) == "=");
        let is_own = |from: usize| (from..at).all(|at| text(at) != ";");
        let given =
            attribute.filter(|from| is_own(*from)).map(|from| text(from + 2).trim_matches('"').to_owned());
        found.push((text(at + 1).to_owned(), given));
    }
    found
}

/// What is imported, what is imported for others as well, and the tokens without these.
fn imports(tokens: &[Token]) -> (Vec<Vec<String>>, Vec<Vec<String>>, Vec<Token>) {
    let (mut uses, mut reexports, mut rest) = (Vec::new(), Vec::new(), Vec::new());
    let mut at = 0;
    while let Some(token) = tokens.get(at) {
        // `use<..>` of a return type captures lifetimes and imports nothing.
        if token.text != "use" || tokens.get(at + 1).is_some_and(|next| next.text == "<") {
            rest.push(token.clone());
            at += 1;
            continue;
        }
        let length = tokens.iter().skip(at).take_while(|token| token.text != ";").count();
        let tree = tokens.get(at + 1..at + length).unwrap_or_default();
        let mut paths = Vec::new();
        expand(&[], tree, &mut paths);
        match visibility(&rest) {
            0 => uses.append(&mut paths),
            tokens => {
                rest.truncate(rest.len() - tokens);
                reexports.append(&mut paths);
            }
        }
        at += length + 1;
    }
    (uses, reexports, rest)
}

/// How many of the last tokens are `pub` or `pub(..)`; any of it makes a re-export, as a name seen through it is defined elsewhere.
fn visibility(before: &[Token]) -> usize {
    let text = |back: usize| before.len().checked_sub(back).map_or("", |at| before[at].text.as_str());
    match (text(1), (3..16).find(|back| text(*back) == "(")) {
        ("pub", _) => 1,
        (")", Some(open)) if text(open + 1) == "pub" => open + 1,
        _ => 0,
    }
}

/// The paths of a `use` tree, names after `as` left out.
fn expand(before: &[String], tree: &[Token], paths: &mut Vec<Vec<String>>) {
    let mut path = before.to_vec();
    let mut at = 0;
    while let Some(token) = tree.get(at) {
        match token.text.as_str() {
            "{" => {
                let inside = tree.get(at + 1..tree.len().saturating_sub(1)).unwrap_or_default();
                for part in parts(inside) {
                    expand(&path, part, paths);
                }
                return;
            }
            "as" => break,
            ":" => {}
            // `a::{self}` names `a`.
            "self" if !path.is_empty() => {}
            word => path.push(word.to_owned()),
        }
        at += 1;
    }
    if !path.is_empty() {
        paths.push(path);
    }
}

/// The parts of a list between commas that are in no bracket.
fn parts(tokens: &[Token]) -> Vec<&[Token]> {
    let (mut found, mut depth, mut begin) = (Vec::new(), 0_usize, 0);
    for (at, token) in tokens.iter().enumerate() {
        match token.text.as_str() {
            "{" => depth += 1,
            "}" => depth = depth.saturating_sub(1),
            "," if depth == 0 => {
                found.extend(tokens.get(begin..at));
                begin = at + 1;
            }
            _ => {}
        }
    }
    found.extend(tokens.get(begin..).filter(|part| !part.is_empty()));
    found
}

/// Names that a file defines.
fn definitions(tokens: &[Token]) -> BTreeSet<String> {
    let after = |at: usize| {
        let names = tokens.get(at + 1..)?.iter().map(|token| token.text.as_str());
        names.into_iter().find(|word| !["mut", "!"].contains(word)).map(str::to_owned)
    };
    let definers = tokens.iter().enumerate().filter(|(_, token)| DEFINERS.contains(&token.text.as_str()));
    definers.filter_map(|(at, _)| after(at)).collect()
}

/// Paths that are written out where they are used: those that begin with `crate`, `super` or `self`.
fn written_out(tokens: &[Token]) -> Vec<Vec<String>> {
    let text = |at: usize| tokens.get(at).map_or("", |token| token.text.as_str());
    let joined = |at: usize| text(at) == ":" && text(at + 1) == ":";
    let begins = |at: &usize| {
        ["crate", "super", "self"].contains(&text(*at)) && joined(at + 1) && (*at < 2 || !joined(at - 2))
    };
    let path = |at: usize| {
        let mut path = vec![text(at).to_owned()];
        let mut at = at;
        while joined(at + 1)
            && text(at + 3).starts_with(|letter: char| letter.is_alphabetic() || letter == '_')
        {
            path.push(text(at + 3).to_owned());
            at += 3;
        }
        path
    };
    (0..tokens.len()).filter(begins).map(path).collect()
}

/// Every `first::second` in which the first word is that of a module.
fn pairs(tokens: &[Token]) -> Vec<(String, String)> {
    let text = |at: usize| tokens.get(at).map_or("", |token| token.text.as_str());
    let is_pair = |at: &usize| {
        text(at + 1) == ":"
            && text(at + 2) == ":"
            && text(*at).starts_with(|letter: char| letter.is_ascii_lowercase())
    };
    (0..tokens.len()).filter(is_pair).map(|at| (text(at).to_owned(), text(at + 3).to_owned())).collect()
}
