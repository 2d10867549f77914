//! What the questions to the database share.

/// Reads a row whose columns have the names of the fields.
macro_rules! from_row {
    ($name:ident: $($field:ident),+) => {
        impl<'r> FromRow<'r, PgRow> for $name {
            fn from_row(row: &'r PgRow) -> Result<Self, sqlx::Error> {
                Ok(Self { $($field: row.try_get(stringify!($field))?),+ })
            }
        }
    };
}

/// A time as RFC 3339, as SQL.
macro_rules! utc {
    ($column:literal) => {
        concat!("to_char(", $column, " AT TIME ZONE 'UTC', 'YYYY-MM-DD\"T\"HH24:MI:SS.MS\"Z\"')")
    };
}

pub(crate) use {from_row, utc};
