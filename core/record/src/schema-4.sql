-- An uncertainty that was not determined is NULL. Until now it was written as 0, which no uncertainty is.
CREATE TABLE corrections_4 (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    run INTEGER REFERENCES runs (id),
    step TEXT NOT NULL,
    cell TEXT NOT NULL,
    device TEXT NOT NULL,
    quantity TEXT NOT NULL,
    place TEXT NOT NULL,
    old REAL NOT NULL,
    new REAL NOT NULL,
    uncertainty REAL,                  -- one standard uncertainty of the new value; NULL: not determined
    unit TEXT NOT NULL,
    proposed TEXT NOT NULL,
    revision INTEGER REFERENCES revisions (id),
    budget TEXT                        -- JSON: what the uncertainty is made of
) STRICT;
INSERT INTO corrections_4 (id, run, step, cell, device, quantity, place, old, new, uncertainty, unit, proposed, revision)
    SELECT id, run, step, cell, device, quantity, place, old, new, NULLIF(uncertainty, 0.0), unit, proposed, revision FROM corrections;
DROP TABLE corrections;
ALTER TABLE corrections_4 RENAME TO corrections;
CREATE INDEX corrections_in_force ON corrections (cell, device, quantity, place, revision);
