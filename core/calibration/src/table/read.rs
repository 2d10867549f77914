//! Reading a table from CSV: any of the usual separators, marks and line ends; errors name line, column and reason.

use std::path::Path;

use csv::StringRecord;
use plumb_document::{FileKind, read_bytes};

use super::columns::{Covariate, MOST_LEVELS, Names, PositionColumns, Table};
use super::error::{HeaderProblem, TableError};
use super::flange_pose;
use super::header::{self, Meaning};
use super::naming::{self, Naming};
use super::number::{self, DecimalMark};
use super::orientation::{self, Body, RotationPart};
use super::profile::ProfileColumns;
use super::scalar::ScalarColumn;
use super::text::{decoded, with_line_feeds};

/// A line that begins with this is no row: it says something about the file.
const COMMENT: char = '#';

struct Column {
    /// As the file has it.
    name: String,
    /// As it is read: the file's own, or what it means.
    read_as: String,
    meaning: Meaning,
}

/// The most columns of a table: an arm has some ten joints, and what is measured beside them some dozens.
const MOST_COLUMNS: usize = 1000;

/// The longest line of a table, bytes: a thousand cells of a hundred characters.
const LONGEST_LINE: usize = 100_000;

impl Table {
    /// Reads a table from a file.
    ///
    /// # Errors
    /// See [`TableError`].
    pub fn read(path: &Path) -> Result<Self, TableError> {
        Self::read_named(path, &Naming::default())
    }

    /// The same, with headers that are written otherwise.
    ///
    /// # Errors
    /// See [`TableError`].
    pub fn read_named(path: &Path, naming: &Naming) -> Result<Self, TableError> {
        let shown = path.display().to_string();
        let bytes = read_bytes(path, FileKind::TABLE)
            .map_err(|cause| TableError::Open { path: shown.clone(), cause: cause.into() })?;
        Self::parse_named(&shown, &decoded(bytes), naming)
    }

    /// Reads a table from text; `source` is the name used in messages.
    ///
    /// # Errors
    /// See [`TableError`].
    pub fn parse(source: &str, text: &str) -> Result<Self, TableError> {
        Self::parse_named(source, text, &Naming::default())
    }

    /// The same, with headers that are written otherwise.
    ///
    /// # Errors
    /// See [`TableError`].
    pub fn parse_named(source: &str, text: &str, naming: &Naming) -> Result<Self, TableError> {
        let text = with_line_feeds(text.strip_prefix('\u{feff}').unwrap_or(text));
        within_limits(source, &text)?;
        let comments: Vec<&str> = text.lines().take_while(|line| line.starts_with(COMMENT)).collect();
        let header = text.lines().nth(comments.len()).unwrap_or("");
        // The mark that the header has most of; a comma where it has none of them.
        let separator = [',', ';', '\t']
            .into_iter()
            .max_by_key(|mark| (header.matches(*mark).count(), *mark == ','))
            .unwrap_or(',');
        // Where commas part the columns, they cannot mean decimal points as well.
        let mark = if separator == ',' { DecimalMark::Point } else { DecimalMark::Comma };
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(separator as u8)
            .flexible(true)
            .comment(Some(COMMENT as u8))
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let headers = reader.headers().map_err(|error| malformed(source, &error))?.clone();
        let columns = columns(source, &headers, naming)?;
        let mut table = empty_table(source, &columns)?;
        let mut record = StringRecord::new();
        while reader.read_record(&mut record).map_err(|error| malformed(source, &error))? {
            // Spreadsheets write rows of separators below the last row.
            if record.iter().all(str::is_empty) {
                continue;
            }
            push_row(&mut table, &columns, &record, mark)?;
        }
        warn_of_many_levels(&mut table);
        table.orientations.retain(|columns| columns.body != Body::Flange);
        table.comments =
            comments.iter().map(|line| line.trim().trim_start_matches(COMMENT).trim().to_owned()).collect();
        if table.is_empty() {
            return Err(TableError::Empty {
                path: source.to_owned(),
                reason: "no rows below the header".to_owned(),
            });
        }
        Ok(table)
    }
}

/// What the reader of CSV says of a file that it cannot read.
fn malformed(source: &str, error: &csv::Error) -> TableError {
    TableError::Malformed { path: source.to_owned(), reason: error.to_string() }
}

/// Lines longer than any of a table are no lines of one; they are refused before anything is made of them.
fn within_limits(path: &str, text: &str) -> Result<(), TableError> {
    match text.split('\n').position(|line| line.len() > LONGEST_LINE) {
        None => Ok(()),
        Some(index) => {
            let reason = format!(
                "line {} is longer than {LONGEST_LINE} bytes: see whether this is the right file",
                index + 1
            );
            Err(TableError::Malformed { path: path.to_owned(), reason })
        }
    }
}

fn columns(path: &str, headers: &StringRecord, naming: &Naming) -> Result<Vec<Column>, TableError> {
    if headers.len() > MOST_COLUMNS {
        let reason = format!("it has {} columns; a table has at most {MOST_COLUMNS}", headers.len());
        return Err(TableError::Malformed { path: path.to_owned(), reason });
    }
    if headers.iter().all(str::is_empty) {
        let reason = "the file is empty; the first line must name the columns".to_owned();
        return Err(TableError::Empty { path: path.to_owned(), reason });
    }
    if let Some(reason) = naming.missing(headers.iter()) {
        return Err(TableError::Malformed { path: path.to_owned(), reason });
    }
    let mut columns: Vec<Column> = Vec::with_capacity(headers.len());
    // All that is wrong is reported at once: a table of seven joints without units is one message.
    let mut problems: Vec<HeaderProblem> = Vec::new();
    for (index, name) in headers.iter().enumerate() {
        match column(name, naming, &columns) {
            Ok(column) => columns.push(column),
            Err(reason) => problems.push(HeaderProblem { column: index + 1, name: name.to_owned(), reason }),
        }
    }
    if problems.len() > 1 {
        return Err(TableError::Headers { path: path.to_owned(), problems });
    }
    match problems.pop() {
        Some(HeaderProblem { column, name, reason }) => {
            Err(TableError::Header { path: path.to_owned(), column, name, reason })
        }
        None => Ok(columns),
    }
}

/// One column, beside those before it; or what is wrong with its header.
fn column(name: &str, naming: &Naming, before: &[Column]) -> Result<Column, String> {
    // First what a header means, then what that means: a rename may lead to any column.
    let read_as = naming.canonical(name);
    if let Some(refused) = naming::refused_orientation(&read_as) {
        return Err(refused);
    }
    let meaning = header::parse(&read_as)?;
    if let Some(other) = before.iter().find(|other| other.read_as == read_as && !read_as.is_empty()) {
        return Err(match other.name == name {
            true => format!("the column `{name}` appears twice"),
            false => format!("it says the same as `{}`; keep one", other.name),
        });
    }
    let slot = meaning.slot();
    if let Some(other) = before.iter().find(|other| slot.is_some() && other.meaning.slot() == slot) {
        return Err(format!("it says the same as `{}`, in another unit; keep one", other.name));
    }
    Ok(Column { name: name.to_owned(), read_as, meaning })
}

/// What to say of a header that names no joints.
fn without_joints(columns: &[Column]) -> String {
    let mut names = columns.iter().map(|column| column.name.as_str()).filter(|name| !name.is_empty());
    let what = match columns {
        // A model file, whose first line is `arm: ...`, read as a table has one column.
        [only] if only.name.contains(':') => "this is no table",
        _ if names.all(|name| name.parse::<f64>().is_ok()) => "line 1 holds numbers where names belong",
        _ => "no joint columns",
    };
    let needed = "the header needs q1_deg ... qn_deg or the model's names of its joints, and what was measured, such as p1_x_mm";
    match naming::suggestion(columns.iter().map(|column| column.read_as.as_str())) {
        Some(option) => format!("{what}; {needed}\n  {option}"),
        None => format!("{what}; {needed}"),
    }
}

fn joint_count(path: &str, columns: &[Column]) -> Result<usize, TableError> {
    let joints: Vec<usize> = columns
        .iter()
        .filter_map(
            |column| if let Meaning::Coordinate { joint, .. } = column.meaning { Some(joint) } else { None },
        )
        .collect();
    let count = joints.iter().max().map_or(0, |highest| highest + 1);
    if let Some(wrong) = of_flange(columns, count) {
        return wrong.map_err(|reason| TableError::Empty { path: path.to_owned(), reason });
    }
    if count == 0 {
        let reason = without_joints(columns);
        return Err(TableError::Empty { path: path.to_owned(), reason });
    }
    // A gap is a column that was lost on the way, not a joint that is at rest.
    if let Some(missing) = (0..count).find(|joint| !joints.contains(joint)) {
        let reason = format!("joint columns go up to q{count} but q{} is missing", missing + 1);
        return Err(TableError::Empty { path: path.to_owned(), reason });
    }
    Ok(count)
}

/// The coordinates of a table with poses of the flange in place of joints, or what such a pose lacks; nothing of any other table.
fn of_flange(columns: &[Column], joints: usize) -> Option<Result<usize, String>> {
    let mut has = [false; 3];
    let mut turns = false;
    for column in columns {
        match column.meaning {
            Meaning::Flange { axis, .. } => has[axis] = true,
            Meaning::Turn { body: Body::Flange, .. } => turns = true,
            _ => {}
        }
    }
    if has == [false; 3] && !turns {
        return None;
    }
    let lost = has
        .iter()
        .position(|has| !has)
        .and_then(|axis| flange_pose::POSITIONS.get(flange_pose::coordinate_of(axis)));
    Some(match lost {
        _ if joints > 0 => {
            Err("a row has joints or the pose of its flange, not both; --columns NAME= leaves a column out"
                .to_owned())
        }
        Some(lost) => Err(format!("the pose of the flange lacks `{lost}`")),
        None if !turns => {
            Err("the pose of the flange lacks its orientation: flange_qw ... or flange_rx_rad ...".to_owned())
        }
        None => Ok(flange_pose::COORDINATES),
    })
}

fn empty_table(path: &str, columns: &[Column]) -> Result<Table, TableError> {
    let joints = joint_count(path, columns)?;
    let mut table = Table { source: path.to_owned(), joints, ..Table::default() };
    table.coordinate_columns = vec![(String::new(), false); joints];
    for (index, column) in columns.iter().enumerate() {
        match &column.meaning {
            Meaning::Coordinate { joint, .. } => {
                if let Some(known) = table.coordinate_columns.get_mut(*joint) {
                    *known = (column.name.clone(), header::is_in_length(&column.read_as));
                }
            }
            Meaning::Flange { axis, .. } => {
                if let Some(known) = table.coordinate_columns.get_mut(flange_pose::coordinate_of(*axis)) {
                    *known = (column.name.clone(), true);
                }
            }
            Meaning::Position { target, .. }
                if table.positions.iter().any(|known| known.number == *target) => {}
            Meaning::Position { target, .. } => {
                let name = format!("p{}", target + 1);
                table.positions.push(PositionColumns { number: *target, target: name, xyz: Vec::new() });
            }
            Meaning::Board { .. } => table.board = Some(Vec::new()),
            Meaning::Profile { number, .. } if table.profiles.iter().all(|known| known.number != *number) => {
                table.profiles.push(ProfileColumns { number: *number, xz: Vec::new() });
            }
            Meaning::Std { .. } => table.std = Some(Vec::new()),
            Meaning::Scalar { scalar, target, .. } => {
                table.scalars.push(ScalarColumn { target: *target, ..ScalarColumn::empty(scalar) });
            }
            Meaning::Tilt { .. } => table.tilt = Some(Vec::new()),
            Meaning::Signal => table.signal = Some(Vec::new()),
            Meaning::Time => table.time = Some(Vec::new()),
            Meaning::Temperature => table.temperature = Some(Vec::new()),
            Meaning::Payload => table.payload = Some(Vec::new()),
            Meaning::Approach { joint } if *joint >= joints => {
                let reason = format!("there is no q{}; the table has {joints} joints", joint + 1);
                return Err(TableError::Header {
                    path: path.to_owned(),
                    column: index + 1,
                    name: column.name.clone(),
                    reason,
                });
            }
            Meaning::Approach { .. } => table.approach = Some(Vec::new()),
            Meaning::Covariate if !column.read_as.is_empty() => keep_covariate(&mut table, &column.read_as),
            _ => {}
        }
    }
    table.orientations =
        orientation::orientations(&rotation_parts(columns)).map_err(|(column, reason)| {
            let name = columns.get(column).map_or_else(String::new, |column| column.name.clone());
            TableError::Header { path: path.to_owned(), column: column + 1, name, reason }
        })?;
    Ok(table)
}

/// Keeps a column that the reader does not know, and asks whether one that it knows was meant.
fn keep_covariate(table: &mut Table, name: &str) {
    table.covariates.push(Covariate::empty(name));
    if let Some(known) = header::near_miss(name, table.joints).or_else(|| naming::likely(name)) {
        table.warnings.push(format!(
            "column `{name}` is kept as a covariate; was `{known}` meant? --columns {name}={known}"
        ));
    }
}

/// The columns that hold numbers of orientations.
fn rotation_parts(columns: &[Column]) -> Vec<RotationPart> {
    let parts = columns.iter().enumerate().filter_map(|(index, column)| match column.meaning {
        Meaning::Turn { body, form, part, .. } => Some((index, body, form, part)),
        _ => None,
    });
    parts.collect()
}

/// Ends a row's orientations; what is wrong with one is reported at its first column.
fn end_orientations(table: &mut Table, columns: &[Column], line: u64) -> Result<(), TableError> {
    let row = table.len();
    for index in 0..table.orientations.len() {
        let Some(known) = table.orientations.get_mut(index) else { continue };
        let own = known.body;
        let mut ended = known.end_row();
        if own == Body::Flange && ended.is_ok() {
            ended = flange_pose::end_row(table, row);
        }
        let mut meanings = columns.iter().map(|column| &column.meaning);
        let index =
            meanings.position(|one| matches!(one, Meaning::Turn { body, .. } if *body == own)).unwrap_or(0);
        ended.map_err(|reason| TableError::Cell {
            path: table.source.clone(),
            line,
            column: index + 1,
            name: columns.get(index).map_or_else(String::new, |column| column.name.clone()),
            reason,
        })?;
    }
    Ok(())
}

fn push_row(
    table: &mut Table,
    columns: &[Column],
    record: &StringRecord,
    mark: DecimalMark,
) -> Result<(), TableError> {
    let line = record.position().map_or(0, csv::Position::line);
    if record.len() != columns.len() {
        return Err(TableError::RowLength {
            path: table.source.clone(),
            line,
            found: record.len(),
            expected: columns.len(),
            hint: length_hint(columns.len(), record, mark),
        });
    }
    let row = table.len();
    start_row(table);
    let mut covariate = 0;
    for (index, (column, cell)) in columns.iter().zip(record.iter()).enumerate() {
        let stored = push_cell(table, row, column, cell, mark, &mut covariate);
        stored.map_err(|reason| TableError::Cell {
            path: table.source.clone(),
            line,
            column: index + 1,
            name: column.name.clone(),
            reason,
        })?;
    }
    end_orientations(table, columns, line)?;
    table.lines.push(u32::try_from(line).unwrap_or(u32::MAX));
    for names in names_of(table) {
        // A table without the column has an empty cell there.
        if names.of_row.len() <= row {
            names.push("");
        }
    }
    Ok(())
}

/// The columns of names, in no order that matters.
fn names_of(table: &mut Table) -> [&mut Names; 7] {
    let Table { on, distance_to, touch, level, board_seen, session, repeat, .. } = table;
    [on, distance_to, touch, level, board_seen, session, repeat]
}

/// Puts one cell where it belongs; says what is wrong with it. `covariate` counts the covariates met so far in the row.
fn push_cell(
    table: &mut Table,
    row: usize,
    column: &Column,
    cell: &str,
    mark: DecimalMark,
    covariate: &mut usize,
) -> Result<(), String> {
    match &column.meaning {
        Meaning::On => table.on.push(cell),
        Meaning::DistanceTo => table.distance_to.push(cell),
        Meaning::Touch => table.touch.push(cell),
        Meaning::Level => table.level.push(cell),
        Meaning::BoardSeen => table.board_seen.push(cell),
        Meaning::Session => table.session.push(cell),
        Meaning::Repeat => table.repeat.push(cell),
        Meaning::Signal => {
            let came_on = signal(cell)?;
            if let Some(known) = table.signal.as_mut().and_then(|signals| signals.get_mut(row)) {
                *known = came_on;
            }
        }
        // A column that was renamed to nothing is left out.
        Meaning::Covariate if column.read_as.is_empty() => {}
        Meaning::Covariate => {
            if let Some(known) = table.covariates.get_mut(*covariate) {
                known.push(cell, number::parse(cell, mark).ok());
            }
            *covariate += 1;
        }
        Meaning::Coordinate { .. } | Meaning::Flange { .. } if cell.is_empty() => {
            return Err("empty; every joint needs its commanded value".to_owned());
        }
        _ if cell.is_empty() => {}
        meaning => {
            let value = number::parse(cell, mark)?;
            check(meaning, value)?;
            store(table, row, meaning, value);
        }
    }
    Ok(())
}

/// What a sensor did, as a word.
fn signal(cell: &str) -> Result<Option<bool>, String> {
    match cell {
        "" => Ok(None),
        "on" => Ok(Some(true)),
        "off" => Ok(Some(false)),
        other => Err(format!("`{other}` is nothing a sensor does: it comes `on` or goes `off`")),
    }
}

/// What may have gone wrong with a row that is too long or too short.
fn length_hint(expected: usize, record: &StringRecord, mark: DecimalMark) -> &'static str {
    // Decimal commas cut every number into two whole ones.
    let are_whole =
        record.iter().all(|cell| cell.trim_start_matches('-').bytes().all(|byte| byte.is_ascii_digit()));
    if mark == DecimalMark::Point && record.iter().any(|cell| cell.contains(';')) {
        "; the rows are separated by semicolons and the header by commas: use one of them throughout"
    } else if mark == DecimalMark::Point && record.len() > expected && are_whole {
        "; if the commas are decimal commas, separate the columns by semicolons"
    } else {
        "; give every row one cell a column, empty where nothing was measured"
    }
}

/// The column in which plumb's own tables say which step of the procedure made a row: nobody means it to be tested against.
const STEP: &str = "step";

/// Says which columns of words hold too many different ones to be tested against.
fn warn_of_many_levels(table: &mut Table) {
    let conditions = table.covariates.iter().filter(|covariate| covariate.name != STEP);
    for covariate in conditions.filter(|covariate| covariate.has_too_many_levels()) {
        table.warnings.push(format!(
            "column `{}` holds more than {MOST_LEVELS} different words: what is left is not tested against it",
            covariate.name
        ));
    }
}

fn start_row(table: &mut Table) {
    let joints = table.joints;
    // Not a number until a cell says otherwise: a number that was not measured is never 0.
    table.q.extend(std::iter::repeat_n(f64::NAN, joints));
    for columns in &mut table.positions {
        columns.xyz.push([f64::NAN; 3]);
    }
    if let Some(board) = &mut table.board {
        board.push([f64::NAN; 3]);
    }
    for columns in &mut table.profiles {
        columns.xz.push([f64::NAN; 2]);
    }
    if let Some(std) = &mut table.std {
        std.push([f64::NAN; 3]);
    }
    if let Some(signal) = &mut table.signal {
        signal.push(None);
    }
    if let Some(tilt) = &mut table.tilt {
        tilt.push([f64::NAN; 2]);
    }
    for column in &mut table.scalars {
        column.values.push(f64::NAN);
    }
    let plain = [&mut table.time, &mut table.temperature, &mut table.payload];
    for column in plain.into_iter().flatten() {
        column.push(f64::NAN);
    }
    if let Some(approach) = &mut table.approach {
        // 0 is not known.
        approach.extend(std::iter::repeat_n(0, joints));
    }
}

fn check(meaning: &Meaning, value: f64) -> Result<(), String> {
    match meaning {
        Meaning::Approach { .. } if ![-1.0, 0.0, 1.0].contains(&value) => {
            Err(format!("{value} is no way of arriving; 1 is one where the coordinate grew, -1 one where it fell, 0 is not known"))
        }
        Meaning::Std { .. } if value <= 0.0 => {
            Err(format!("a sigma of {value} cannot be; it must be above zero"))
        }
        Meaning::Payload if value < 0.0 => Err(format!("a load of {value} kg cannot be")),
        Meaning::Scalar { scalar, scale, .. } => scalar.check(value * scale),
        Meaning::Coordinate { .. }
        | Meaning::Position { .. }
        | Meaning::Board { .. }
        | Meaning::Profile { .. }
            // A thousand kilometres: a cell that lost its decimal point.
            if value.abs() > 1e9 =>
        {
            Err(format!("{value} is too large to be meant"))
        }
        _ => Ok(()),
    }
}

fn set(column: Option<&mut Vec<f64>>, row: usize, value: f64) {
    if let Some(cell) = column.and_then(|column| column.get_mut(row)) {
        *cell = value;
    }
}

fn set_part<const N: usize>(column: Option<&mut Vec<[f64; N]>>, row: usize, part: usize, value: f64) {
    if let Some(cell) = column.and_then(|column| column.get_mut(row)).and_then(|cells| cells.get_mut(part)) {
        *cell = value;
    }
}

fn store(table: &mut Table, row: usize, meaning: &Meaning, value: f64) {
    let joints = table.joints;
    match meaning {
        Meaning::Coordinate { joint, scale } => set(Some(&mut table.q), row * joints + joint, value * scale),
        Meaning::Position { target, axis, scale } => {
            let columns = table.positions.iter_mut().find(|known| known.number == *target);
            set_part(columns.map(|known| &mut known.xyz), row, *axis, value * scale);
        }
        Meaning::Flange { axis, scale } => {
            set(Some(&mut table.q), row * joints + flange_pose::coordinate_of(*axis), value * scale);
        }
        Meaning::Profile { number, part, scale } => {
            let columns = table.profiles.iter_mut().find(|known| known.number == *number);
            set_part(columns.map(|known| &mut known.xz), row, *part, value * scale);
        }
        Meaning::Board { axis, scale } => set_part(table.board.as_mut(), row, *axis, value * scale),
        Meaning::Turn { body, part, scale, .. } => {
            if let Some(known) = table.orientations.iter_mut().find(|known| known.body == *body) {
                known.set(*part, value * scale);
            }
        }
        Meaning::Std { axis, scale } => set_part(table.std.as_mut(), row, *axis, value * scale),
        Meaning::Scalar { scalar, target, scale } => {
            let mut columns = table.scalars.iter_mut();
            let column = columns.find(|column| column.scalar == *scalar && column.target == *target);
            set(column.map(|column| &mut column.values), row, value * scale);
        }
        Meaning::Tilt { axis, scale } => set_part(table.tilt.as_mut(), row, *axis, value * scale),
        Meaning::Time => set(table.time.as_mut(), row, value),
        Meaning::Temperature => set(table.temperature.as_mut(), row, value),
        Meaning::Payload => set(table.payload.as_mut(), row, value),
        Meaning::Approach { joint } => {
            if let Some(side) = table.approach.as_mut().and_then(|sides| sides.get_mut(row * joints + joint))
            {
                *side = value as i8;
            }
        }
        Meaning::On
        | Meaning::Signal
        | Meaning::DistanceTo
        | Meaning::Touch
        | Meaning::Level
        | Meaning::BoardSeen
        | Meaning::Session
        | Meaning::Repeat
        | Meaning::Covariate => {}
    }
}
