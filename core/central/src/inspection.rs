//! What is to be known of the central database before anything is shipped: it is only looked at.

use sqlx::{Connection as _, Row as _};

use crate::central::{KNOWN, open};
use crate::error::During as _;
use crate::{Central, CentralError};

/// How a database was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Inspection {
    /// The server's version, as it says it: `15.8 (Debian 15.8-0+deb12u1)`.
    pub version: String,
    /// Its first number.
    pub major_version: i32,
    /// Version of plumb's tables; none where there are none yet.
    pub schema: Option<i32>,
    /// Newest version of the tables that this program knows.
    pub known_schema: i32,
    /// Whether this user may make tables there.
    pub may_make_tables: bool,
    /// The version of TLS in use: `TLSv1.3`. None where the connection is in plain text.
    pub tls: Option<String>,
    /// The server's clock less this machine's, s.
    pub clock_ahead_s: f64,
}

/// How far the database is with one record.
#[derive(Debug, Clone, PartialEq)]
pub struct Shipment {
    /// Number of the last row it has.
    pub up_to: i64,
    /// How long ago its shipper was heard of, s.
    pub silent_s: f64,
}

impl Central {
    /// Looks at the database. No table is made.
    ///
    /// # Errors
    /// It cannot be reached, or does not let this user in.
    pub async fn inspect(address: &str) -> Result<Inspection, CentralError> {
        let operation = "cannot be looked at";
        let mut connection = open(address).await?;
        let before_s = now_s();
        let row = sqlx::query(
            "SELECT current_setting('server_version') AS version, current_setting('server_version_num')::int / 10000 AS major, \
             to_regclass('plumb_schema') IS NOT NULL AS has_tables, \
             coalesce((SELECT has_schema_privilege(n.oid, 'CREATE') FROM pg_namespace n WHERE n.nspname = current_schema()), false) AS may_make, \
             (SELECT s.version FROM pg_stat_ssl s WHERE s.pid = pg_backend_pid() AND s.ssl) AS tls, \
             extract(epoch FROM clock_timestamp())::float8 AS clock",
        )
        .fetch_one(&mut connection)
        .await
        .during(operation)?;
        let middle_s = f64::midpoint(before_s, now_s());
        let schema = if row.get::<bool, _>("has_tables") {
            sqlx::query_scalar("SELECT max(version) FROM plumb_schema")
                .fetch_one(&mut connection)
                .await
                .during(operation)?
        } else {
            None
        };
        // The server notices an end by itself; who looked has what it wanted.
        let _closed = connection.close().await;
        Ok(Inspection {
            version: row.get("version"),
            major_version: row.get("major"),
            schema,
            known_schema: KNOWN,
            may_make_tables: row.get("may_make"),
            tls: row.get("tls"),
            clock_ahead_s: row.get::<f64, _>("clock") - middle_s,
        })
    }

    /// How far the database is with a record; none where it was never heard of.
    ///
    /// # Errors
    /// The database does not answer.
    pub async fn shipment(address: &str, record: &str) -> Result<Option<Shipment>, CentralError> {
        let operation = "cannot tell how far it is";
        let mut connection = open(address).await?;
        let found = sqlx::query(
            "SELECT coalesce((SELECT max(sequence) FROM outbox o WHERE o.record = r.record), 0) AS up_to, \
             extract(epoch FROM now() - last_seen)::float8 AS silent_s FROM records r WHERE record = $1",
        )
        .bind(record)
        .fetch_optional(&mut connection)
        .await
        .during(operation)?;
        let _closed = connection.close().await;
        Ok(found.map(|row| Shipment { up_to: row.get("up_to"), silent_s: row.get("silent_s") }))
    }
}

/// This machine's clock, s since 1970.
fn now_s() -> f64 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    since.map_or(0.0, |since| since.as_secs_f64())
}
