//! What can go wrong with the central database.

use plumb_record::RecordError;

/// Why rows were not shipped, or the fleet not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CentralError {
    /// The address cannot be read.
    #[error("{reason}; an address looks like postgres://USER@HOST/DATABASE")]
    Address {
        /// What is wrong with it.
        reason: String,
    },
    /// A password would cross the network in the clear.
    #[error(
        "sslmode={mode} would send rows to {host} unprotected: leave it out, or give sslmode=require, verify-ca or verify-full"
    )]
    Unprotected {
        /// The machine.
        host: String,
        /// What was asked for.
        mode: &'static str,
    },
    /// The database does not answer, or refuses.
    #[error("the central database {operation}: {cause}")]
    Database {
        /// What was being done: "does not answer".
        operation: &'static str,
        /// What it says.
        #[source]
        cause: sqlx::Error,
    },
    /// The database takes too long.
    #[error("the central database has not answered within {limit_s} s")]
    Slow {
        /// How long it was waited for, s.
        limit_s: u64,
    },
    /// A newer program made its tables.
    #[error("the central database has schema {found}, this program knows up to {known}: use the newer plumb")]
    TooNew {
        /// Schema version found.
        found: i32,
        /// Newest version known here.
        known: i32,
    },
    /// Two histories under one identity.
    #[error(
        "the central database has row {sequence} of this record, and it says something else, or is missing here: this record is a copy of another one, or was brought back from a backup. \
         Nothing was sent. `plumb ship --new-identity` makes it a record of its own, and sends it from the beginning"
    )]
    Copied {
        /// The row in question.
        sequence: i64,
    },
    /// Rows that the database lacks are no longer in the outbox.
    #[error(
        "the central database lacks rows of this record up to {first}, and they were taken off its outbox (`plumb ship --trim`) after another database had them. Nothing was sent. \
         `plumb ship --new-identity` sends everything the record holds from the beginning, under a new name"
    )]
    Trimmed {
        /// The first row that is still there.
        first: i64,
    },
    /// The cell's own record.
    #[error(transparent)]
    Record(#[from] RecordError),
}

impl CentralError {
    /// Whether it may go away by itself: the network, a server that starts anew.
    pub fn may_pass(&self) -> bool {
        let Self::Database { cause, .. } = self else {
            return matches!(self, Self::Slow { .. } | Self::Record(RecordError::Locked { .. }));
        };
        match cause {
            sqlx::Error::Io(_)
            | sqlx::Error::PoolTimedOut
            | sqlx::Error::PoolClosed
            | sqlx::Error::Protocol(_) => true,
            // Classes of SQLSTATE: 08 connection, 40 rolled back, 53 no resources, 57 operator intervention (a shutdown).
            sqlx::Error::Database(source) => source
                .code()
                .is_some_and(|code| ["08", "40", "53", "57"].iter().any(|class| code.starts_with(class))),
            _ => false,
        }
    }
}

/// Says what was being done.
pub(crate) trait During<T> {
    fn during(self, operation: &'static str) -> Result<T, CentralError>;
}

impl<T> During<T> for Result<T, sqlx::Error> {
    fn during(self, operation: &'static str) -> Result<T, CentralError> {
        self.map_err(|cause| CentralError::Database { operation, cause })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_network_that_is_gone_may_come_back_and_a_copied_record_stays_one() {
        let gone = std::io::Error::from(std::io::ErrorKind::ConnectionRefused);
        let gone = CentralError::Database { operation: "does not answer", cause: sqlx::Error::Io(gone) };
        assert!(gone.may_pass());
        assert!(!CentralError::Copied { sequence: 3 }.may_pass());
        assert!(!CentralError::Address { reason: "no host".into() }.may_pass());
        assert!(
            !CentralError::Database { operation: "answers", cause: sqlx::Error::RowNotFound }.may_pass(),
            "a question that was wrong stays wrong"
        );
    }
}
