CREATE TABLE identity (                -- one row: what tells this record from every other, so that a copy elsewhere knows whose rows it holds
    id TEXT NOT NULL
) STRICT;
INSERT INTO identity (id) VALUES (lower(hex(randomblob(16))));

CREATE TABLE outbox (                  -- every row of the other tables as it came to be, in order, to be sent elsewhere; see outbox.rs
    sequence INTEGER PRIMARY KEY AUTOINCREMENT,
    kind TEXT NOT NULL,                -- the table
    number INTEGER NOT NULL,           -- the row's number in it
    made TEXT NOT NULL,
    body TEXT NOT NULL                 -- JSON: the row
) STRICT;
