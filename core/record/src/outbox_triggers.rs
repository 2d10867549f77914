//! The triggers that fill the outbox.

use rusqlite::{Connection, Transaction};

/// The tables whose rows are not sent: the outbox itself, and what only this file means.
const NOT_SENT: [&str; 2] = ["outbox", "identity"];

/// The tables whose rows are sent, in the order in which they were made: a table comes after those it refers to.
pub(crate) fn sent_tables(connection: &Connection) -> rusqlite::Result<Vec<String>> {
    let mut statement = connection.prepare(
        "SELECT name FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite\\_%' ESCAPE '\\' ORDER BY rowid",
    )?;
    let names: Vec<String> = statement.query_map([], |row| row.get(0))?.collect::<Result<_, _>>()?;
    Ok(names.into_iter().filter(|name| !NOT_SENT.contains(&name.as_str())).collect())
}

/// The JSON object of a row of `table`, as SQL; `row` names it. Bytes are left out: JSON has none, and the files that the
/// record keeps as bytes are distinguished by the hash beside them.
fn row_as_json(connection: &Connection, table: &str, row: &str) -> rusqlite::Result<String> {
    let mut statement = connection.prepare("SELECT name, type FROM pragma_table_info(?1)")?;
    let columns: Vec<(String, String)> =
        statement.query_map([table], |row| Ok((row.get(0)?, row.get(1)?)))?.collect::<Result<_, _>>()?;
    let parts = columns.iter().filter(|(_, kind)| kind != "BLOB");
    let parts: Vec<String> = parts.map(|(name, _)| format!("'{name}', {row}.{name}")).collect();
    Ok(format!("json_object({})", parts.join(", ")))
}

/// Time of a row of the outbox, as SQL: as [`crate::timestamp`] writes it.
const NOW: &str = "strftime('%Y-%m-%dT%H:%M:%fZ', 'now')";

/// Makes the triggers anew for the tables as they are now. Called whenever tables were made or changed.
pub(crate) fn make_triggers(transaction: &Transaction<'_>) -> rusqlite::Result<()> {
    for table in sent_tables(transaction)? {
        let body = row_as_json(transaction, &table, "NEW")?;
        for (event, name) in [("INSERT", "added"), ("UPDATE", "changed")] {
            transaction.execute_batch(&format!(
                "DROP TRIGGER IF EXISTS outbox_{table}_{name}; \
                 CREATE TRIGGER outbox_{table}_{name} AFTER {event} ON {table} BEGIN \
                 INSERT INTO outbox (kind, number, made, body) VALUES ('{table}', NEW.rowid, {NOW}, {body}); END;"
            ))?;
        }
    }
    Ok(())
}

/// Puts the rows that an older program wrote into the outbox, table by table.
pub(crate) fn send_what_is_there(transaction: &Transaction<'_>) -> rusqlite::Result<()> {
    for table in sent_tables(transaction)? {
        let body = row_as_json(transaction, &table, "old")?;
        transaction.execute_batch(&format!(
            "INSERT INTO outbox (kind, number, made, body) SELECT '{table}', old.rowid, {NOW}, {body} FROM {table} AS old ORDER BY old.rowid"
        ))?;
    }
    Ok(())
}
