//! The central database: can it be reached, is it protected, does it fit this program, and does it have this machine's record.

use std::path::PathBuf;

use plumb_central::{Central, CentralError, Inspection, Shipment};
use plumb_document::counted;
use plumb_record::{Record, RecordError};

use super::finding::Finding;
use crate::failure::with_causes;
use crate::record_directory::record_directory;

const TOPIC: &str = "database";

/// The oldest server that is known to be enough; it is tried with 15.
const OLDEST: i32 = 13;

/// Clocks that differ by more than this make times of waiting wrong that are reported in seconds.
const CLOCKS_AGREE_S: f64 = 2.0;

/// A shipper that was not heard of for so long does not run, s.
const SILENT_S: f64 = 15.0;

pub(super) fn look(
    address: &str,
    record: Option<&PathBuf>,
) -> Result<Vec<Finding>, Box<dyn std::error::Error>> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let inspection = match runtime.block_on(Central::inspect(address)) {
        Ok(inspection) => inspection,
        Err(error) => return Ok(vec![not_reached(&error)]),
    };
    let mut findings = vec![version(&inspection), protection(&inspection, address)];
    findings.extend(clock(&inspection));
    findings.push(schema(&inspection));
    if inspection.schema.is_some()
        && let Some((identity, newest)) = identity(record)?
    {
        findings.push(match runtime.block_on(Central::shipment(address, &identity)) {
            Ok(shipment) => shipped(shipment.as_ref(), newest),
            Err(error) => not_reached(&error),
        });
    }
    Ok(findings)
}

/// Identity and newest row of this machine's record, where there is one.
fn identity(record: Option<&PathBuf>) -> Result<Option<(String, i64)>, RecordError> {
    let directory = record_directory(record)?;
    if !Record::file_in(&directory).exists() {
        return Ok(None);
    }
    // A record that cannot be opened is reported under its own topic.
    let Ok(record) = Record::open(&directory) else { return Ok(None) };
    Ok(Some((record.identity()?, record.newest_outbox_row()?)))
}

fn not_reached(error: &CentralError) -> Finding {
    let text = with_causes(error);
    let mend = [
        ("assword", "put it into ~/.pgpass (HOST:PORT:DATABASE:USER:PASSWORD, chmod 600) or into PGPASSWORD"),
        (
            "does not exist",
            "make user and database on its machine: createuser --pwprompt plumb; createdb --owner plumb plumb",
        ),
        (
            "ertificate",
            "give the authority that has signed it: ?sslmode=verify-full&sslrootcert=FILE, and the name that is in it",
        ),
        (
            "does not support TLS",
            "set ssl = on in its postgresql.conf, with a certificate; another machine is not asked in plain text",
        ),
        ("pg_hba.conf", "allow this machine in its pg_hba.conf: hostssl plumb plumb ADDRESS scram-sha-256"),
        ("lookup", "write the name of its machine as the network knows it"),
    ];
    let mend = mend.iter().find(|(word, _)| text.contains(word)).map(|(_, mend)| *mend);
    let usual = "is the server on, and does it listen there? On its machine: systemctl status postgresql, and listen_addresses in postgresql.conf";
    Finding::wrong(TOPIC, text, mend.unwrap_or(usual))
}

fn version(found: &Inspection) -> Finding {
    let text = format!("PostgreSQL {}", found.version);
    match found.major_version {
        ..OLDEST => Finding::wrong(TOPIC, text, format!("use PostgreSQL {OLDEST} or newer")),
        _ => Finding::good(TOPIC, text),
    }
}

fn protection(found: &Inspection, address: &str) -> Finding {
    let Some(version) = &found.tls else { return Finding::good(TOPIC, "on this machine, without TLS") };
    let unchecked = if address.contains("sslmode=verify-full") {
        return Finding::good(TOPIC, format!("{version}; its certificate and its name are checked"));
    } else if address.contains("sslmode=verify-ca") {
        "that its certificate is of that name"
    } else {
        "that it is the right server"
    };
    Finding::note(TOPIC, format!("{version}, but nobody checks {unchecked}")).mend(
        "add ?sslmode=verify-full to the address, and &sslrootcert=FILE where the authority is your own",
    )
}

fn clock(found: &Inspection) -> Option<Finding> {
    let ahead_s = found.clock_ahead_s;
    if ahead_s.abs() <= CLOCKS_AGREE_S {
        return None;
    }
    let (by, how) = (ahead_s.abs(), if ahead_s > 0.0 { "ahead of" } else { "behind" });
    let text = format!("its clock is {by:.0} s {how} this machine's: times of waiting are wrong by as much");
    Some(Finding::wrong(TOPIC, text, "let both follow the network's time: timedatectl set-ntp true"))
}

fn schema(found: &Inspection) -> Finding {
    let known = found.known_schema;
    match found.schema {
        None if found.may_make_tables => {
            Finding::note(TOPIC, "no tables yet: `plumb ship` makes them when it sends for the first time")
        }
        None => Finding::wrong(
            TOPIC,
            "no tables yet, and this user may not make them",
            "let the user own the database: ALTER DATABASE plumb OWNER TO plumb",
        ),
        Some(schema) if schema > known => Finding::wrong(
            TOPIC,
            format!("its tables have schema {schema}, this program knows up to {known}"),
            "use the newer plumb here too",
        ),
        Some(schema) if schema < known => Finding::note(
            TOPIC,
            format!("its tables have schema {schema}; this program brings them to {known} when it connects"),
        ),
        Some(schema) => Finding::good(TOPIC, format!("its tables have schema {schema}, as this program")),
    }
}

fn shipped(shipment: Option<&Shipment>, newest: i64) -> Finding {
    let start = "`plumb ship --to ADDRESS` sends it; as a service: workcells/many-cells.md";
    let Some(Shipment { up_to, silent_s }) = shipment else {
        return Finding::note(TOPIC, "this machine's record was never shipped there").mend(start);
    };
    let behind = (newest - up_to).max(0);
    if *silent_s > SILENT_S {
        let text = format!(
            "this machine's record: {} behind, and its shipper was not heard of for {silent_s:.0} s",
            counted(behind, "row", "rows")
        );
        return Finding::wrong(TOPIC, text, start);
    }
    Finding::good(
        TOPIC,
        format!("this machine's record is shipped: {} behind", counted(behind, "row", "rows")),
    )
}
