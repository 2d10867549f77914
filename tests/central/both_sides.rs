//! A record and what the database has of it.

use plumb_record::Record;

use crate::lab::Lab;
use crate::server::Server;

/// Number and digests of all rows, as one text, on both sides.
pub(crate) fn both_sides(lab: &Lab, server: &Server) -> (String, String) {
    let record = Record::open(&lab.state()).unwrap();
    let rows = record.outbox_after(0, u32::MAX).unwrap();
    let digests: String = rows.iter().map(|row| format!("{} {}\n", row.sequence, row.digest())).collect();
    let there = server.ask(&format!(
        "SELECT string_agg(sequence || ' ' || sha256 || chr(10), '' ORDER BY sequence) FROM outbox WHERE record = '{}'",
        record.identity().unwrap()
    ));
    (digests.trim_end().to_owned(), there)
}
