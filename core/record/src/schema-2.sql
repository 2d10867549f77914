CREATE TABLE instruments (
    run INTEGER NOT NULL REFERENCES runs (id),
    name TEXT NOT NULL,
    what TEXT NOT NULL,
    serial TEXT,
    uncertainty REAL,                  -- one standard uncertainty of a reading
    unit TEXT,
    calibration_due TEXT,              -- a day: 2027-03-31
    PRIMARY KEY (run, name)
) STRICT;

CREATE TABLE notes (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    run INTEGER NOT NULL REFERENCES runs (id),
    time TEXT NOT NULL,
    author TEXT NOT NULL,
    text TEXT NOT NULL
) STRICT;
CREATE INDEX notes_of_run ON notes (run);

CREATE TABLE offers (                  -- answers given from elsewhere, until the run takes or refuses them
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    prompt INTEGER NOT NULL REFERENCES prompts (id),
    time TEXT NOT NULL,
    author TEXT NOT NULL,
    answer TEXT NOT NULL,              -- JSON
    refused TEXT                       -- why the run did not take it
) STRICT;
CREATE INDEX offers_to_prompt ON offers (prompt);

ALTER TABLE triggers ADD COLUMN direction INTEGER; -- +1 or -1: which way the searched joint went
ALTER TABLE triggers ADD COLUMN surface TEXT;    -- what the sensor stood over, as the model file calls it
ALTER TABLE triggers ADD COLUMN height_mm REAL;  -- how high over it
