//! The connection to the central database, and its tables.

use std::time::Duration;

use sqlx::postgres::{PgConnectOptions, PgConnection, PgSslMode};
use sqlx::{ConnectOptions as _, Connection as _, Executor as _};

use crate::CentralError;
use crate::error::During as _;

/// Each entry takes the schema from its index to the next version. Entries are never changed, only added.
const MIGRATIONS: [&str; 4] = [
    include_str!("schema-1.sql"),
    include_str!("schema-2.sql"),
    include_str!("schema-3.sql"),
    include_str!("schema-4.sql"),
];

/// The version this program knows.
pub(crate) const KNOWN: i32 = MIGRATIONS.len() as i32;

/// How long the server may take to answer a connection: long enough for a slow line, short enough to be reported the same minute.
const CONNECT_WITHIN: Duration = Duration::from_secs(10);

/// What the server does with a connection whose other end has gone without a word, as when the network is cut: it lets go of it within a quarter of a
/// minute. By the system's own settings it would keep the transaction open for two hours, and anyone who sends the same rows again would wait for it.
const SERVER_LETS_GO: [(&str, &str); 5] = [
    ("idle_in_transaction_session_timeout", "15s"),
    ("tcp_keepalives_idle", "5"),
    ("tcp_keepalives_interval", "5"),
    ("tcp_keepalives_count", "2"),
    ("tcp_user_timeout", "15000"),
];

/// The server compiles questions that it takes for long ones, which takes longer than any of these does.
const NO_COMPILATION: [(&str, &str); 1] = [("jit", "off")];

/// Key of the lock that lets one program at a time make the tables. Any number serves that nobody else uses; this one is "plumb"
/// in ASCII.
const MIGRATION_LOCK: i64 = 0x70_6c_75_6d_62;

/// An open connection to the central database.
pub struct Central {
    pub(crate) connection: PgConnection,
}

impl Central {
    /// Connects to `address`, `postgres://USER:PASSWORD@HOST:PORT/DATABASE`, and makes or updates the tables. A password may
    /// are in `PGPASSWORD` or `~/.pgpass` instead. To another machine the connection is protected by TLS.
    ///
    /// # Errors
    /// [`CentralError::Address`], [`CentralError::Unprotected`], [`CentralError::TooNew`]; or the server does not answer.
    pub async fn connect(address: &str) -> Result<Self, CentralError> {
        let mut central = Self { connection: open(address).await? };
        central.migrate().await?;
        Ok(central)
    }

    /// Whether the server still answers.
    ///
    /// # Errors
    /// It does not.
    pub async fn ping(&mut self) -> Result<(), CentralError> {
        self.connection.ping().await.during("does not answer any more")
    }

    /// What nobody checks of the server that `address` leads to, in words; none where nothing crosses a network, or its certificate and its name are
    /// checked.
    ///
    /// # Errors
    /// [`CentralError::Address`], [`CentralError::Unprotected`].
    pub fn unchecked(address: &str) -> Result<Option<String>, CentralError> {
        let options = options_of(address)?;
        let host = options.get_host();
        if options.get_socket().is_some() || is_this_machine(host) {
            return Ok(None);
        }
        let open = match options.get_ssl_mode() {
            PgSslMode::VerifyFull => return Ok(None),
            PgSslMode::VerifyCa => "whether its certificate is of that name",
            _ => "whether it is the right server",
        };
        Ok(Some(format!(
            "the connection to {host} is encrypted, but nobody checks {open}: give sslmode=verify-full in the address, and sslrootcert=FILE where the authority is your own"
        )))
    }

    async fn migrate(&mut self) -> Result<(), CentralError> {
        let operation = "cannot make its tables";
        let mut transaction = self.connection.begin().await.during(operation)?;
        sqlx::query("SELECT pg_advisory_xact_lock($1)")
            .bind(MIGRATION_LOCK)
            .execute(&mut *transaction)
            .await
            .during(operation)?;
        (&mut *transaction)
            .execute("CREATE TABLE IF NOT EXISTS plumb_schema (version int NOT NULL)")
            .await
            .during(operation)?;
        let found: Option<i32> = sqlx::query_scalar("SELECT max(version) FROM plumb_schema")
            .fetch_one(&mut *transaction)
            .await
            .during(operation)?;
        let found = found.unwrap_or(0);
        if found > KNOWN {
            return Err(CentralError::TooNew { found, known: KNOWN });
        }
        for statements in MIGRATIONS.iter().skip(usize::try_from(found).unwrap_or(0)) {
            (&mut *transaction).execute(sqlx::raw_sql(*statements)).await.during(operation)?;
        }
        if found < KNOWN {
            sqlx::query("INSERT INTO plumb_schema VALUES ($1)")
                .bind(KNOWN)
                .execute(&mut *transaction)
                .await
                .during(operation)?;
        }
        transaction.commit().await.during(operation)
    }
}

/// A connection to what `address` says.
pub(crate) async fn open(address: &str) -> Result<PgConnection, CentralError> {
    let options = options_of(address)?;
    let connecting = tokio::time::timeout(CONNECT_WITHIN, options.connect()).await;
    connecting.unwrap_or_else(|_| Err(sqlx::Error::PoolTimedOut)).during("does not answer")
}

/// The options in an address. Where it says nothing of TLS, another machine is reached by TLS alone.
fn options_of(address: &str) -> Result<PgConnectOptions, CentralError> {
    let scheme = ["postgres://", "postgresql://"].iter().any(|scheme| address.starts_with(scheme));
    if !scheme {
        return Err(CentralError::Address { reason: "this is no address of PostgreSQL".to_owned() });
    }
    let options: PgConnectOptions =
        address.parse().map_err(|cause: sqlx::Error| CentralError::Address { reason: cause.to_string() })?;
    // What goes wrong is said by the caller; the library's own log would say it twice.
    let options = options.application_name("plumb").disable_statement_logging();
    let options = options.options(SERVER_LETS_GO).options(NO_COMPILATION);
    let host = options.get_host().to_owned();
    if options.get_socket().is_some() || is_this_machine(&host) {
        return Ok(options);
    }
    let unprotected = |mode| CentralError::Unprotected { host: host.clone(), mode };
    match options.get_ssl_mode() {
        // The library's default, and what a person writes who does not care: neither may lead to plain text.
        PgSslMode::Prefer => Ok(options.ssl_mode(PgSslMode::Require)),
        PgSslMode::Disable => Err(unprotected("disable")),
        PgSslMode::Allow => Err(unprotected("allow")),
        PgSslMode::Require | PgSslMode::VerifyCa | PgSslMode::VerifyFull => Ok(options),
    }
}

/// Whether a host's name means this machine, so that nothing crosses a network.
fn is_this_machine(host: &str) -> bool {
    let address = host.trim_start_matches('[').trim_end_matches(']').parse::<std::net::IpAddr>();
    host == "localhost" || host.starts_with('/') || address.is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_that_is_none_is_refused_with_what_it_should_look_like() {
        for wrong in ["", "lab-server", "http://lab/plumb", "postgres://user@host:notaport/plumb"] {
            let message = options_of(wrong).expect_err("refused").to_string();
            assert!(message.contains("postgres://USER@HOST/DATABASE"), "{wrong}: {message}");
        }
    }

    #[test]
    fn another_machine_is_reached_by_tls_or_not_at_all() {
        let mode = |address: &str| options_of(address).map(|options| format!("{:?}", options.get_ssl_mode()));
        assert_eq!(mode("postgres://u@lab.example/plumb").expect("taken"), "Require");
        assert_eq!(mode("postgres://u@lab.example/plumb?sslmode=verify-full").expect("taken"), "VerifyFull");
        assert_eq!(mode("postgres://u@127.0.0.1/plumb").expect("taken"), "Prefer");
        assert_eq!(mode("postgres://u@localhost/plumb?sslmode=disable").expect("taken"), "Disable");
        let message =
            mode("postgres://u@lab.example/plumb?sslmode=disable").expect_err("refused").to_string();
        assert!(message.contains("lab.example") && message.contains("verify-full"), "{message}");
    }

    #[test]
    fn what_nobody_checks_of_another_machine_is_reported() {
        let unchecked = |address: &str| Central::unchecked(address).expect("an address");
        for (mode, expected) in [
            ("", "whether it is the right server"),
            ("?sslmode=require", "whether it is the right server"),
            ("?sslmode=verify-ca", "whether its certificate is of that name"),
        ] {
            let text = unchecked(&format!("postgres://u@lab.example/plumb{mode}")).expect("a warning");
            assert!(text.contains(expected) && text.contains("lab.example"), "{mode}: {text}");
        }
        assert_eq!(unchecked("postgres://u@lab.example/plumb?sslmode=verify-full"), None);
        assert_eq!(unchecked("postgres://u@localhost/plumb"), None);
        assert!(Central::unchecked("lab").is_err());
    }

    #[test]
    fn this_machine_has_many_names() {
        assert!(
            ["localhost", "127.0.0.1", "::1", "[::1]", "/run/postgresql"].into_iter().all(is_this_machine)
        );
        assert!(["10.0.0.4", "lab", "localhost.example"].into_iter().all(|host| !is_this_machine(host)));
    }
}
