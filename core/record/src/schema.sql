CREATE TABLE runs (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    cell TEXT NOT NULL,
    cell_file TEXT NOT NULL,
    procedure TEXT NOT NULL,
    procedure_file TEXT NOT NULL,
    title TEXT NOT NULL,
    operator TEXT NOT NULL,
    unattended INTEGER NOT NULL,
    parameters TEXT NOT NULL,          -- JSON object: name -> number
    settings TEXT NOT NULL,            -- JSON object: what else a resume needs (pace, answers file, plugin directories)
    program TEXT NOT NULL,             -- version of plumb
    world TEXT,                        -- socket of the simulated world
    started TEXT NOT NULL,
    ended TEXT,
    state TEXT NOT NULL,               -- running | passed | failed | error | aborted | needs_operator
    message TEXT
) STRICT;

CREATE TABLE loaded (
    run INTEGER NOT NULL REFERENCES runs (id),
    role TEXT NOT NULL,                -- cell | procedure | model | answers | world | plugin
    path TEXT NOT NULL,
    sha256 TEXT NOT NULL,
    content BLOB                       -- kept for text files
) STRICT;

CREATE TABLE plan (
    run INTEGER NOT NULL REFERENCES runs (id),
    position INTEGER NOT NULL,
    step TEXT NOT NULL,
    title TEXT NOT NULL,
    kind TEXT NOT NULL,
    depth INTEGER NOT NULL,
    estimate_s REAL,
    PRIMARY KEY (run, position)
) STRICT;

CREATE TABLE steps (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    run INTEGER NOT NULL REFERENCES runs (id),
    step TEXT NOT NULL,
    attempt INTEGER NOT NULL,
    started TEXT NOT NULL,
    intent TEXT,                       -- JSON: what it set out to do, so that doing it again ends in the same place
    ended TEXT,
    outcome TEXT,                      -- passed | failed | error | skipped | not_needed | interrupted
    message TEXT,
    result TEXT                        -- JSON: what later steps refer to
) STRICT;
CREATE INDEX steps_of_run ON steps (run, step);

CREATE TABLE prompts (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    run INTEGER NOT NULL REFERENCES runs (id),
    step TEXT NOT NULL,
    asked TEXT NOT NULL,
    description TEXT NOT NULL,         -- JSON
    answered TEXT,
    answer TEXT,                       -- JSON
    answered_by TEXT,
    withdrawn TEXT
) STRICT;
CREATE INDEX prompts_of_run ON prompts (run, step);

CREATE TABLE triggers (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    run INTEGER NOT NULL REFERENCES runs (id),
    step TEXT NOT NULL,
    device TEXT NOT NULL,
    sensor TEXT NOT NULL,
    fired INTEGER NOT NULL,            -- the condition began (1) or ended (0)
    fine INTEGER NOT NULL,             -- slow approach (1) or fast (0)
    time_ns INTEGER NOT NULL,          -- clock of the cell
    joint TEXT NOT NULL,               -- searched along
    joints TEXT NOT NULL,              -- JSON: names, what the drive said, what it means with the zeros in force, units
    half_width REAL NOT NULL,          -- of the searched joint
    unit TEXT NOT NULL
) STRICT;
CREATE INDEX triggers_of_run ON triggers (run);

CREATE TABLE readings (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    run INTEGER NOT NULL REFERENCES runs (id),
    step TEXT NOT NULL,
    source TEXT NOT NULL,              -- a device, or the step's own expression
    name TEXT NOT NULL,
    value REAL NOT NULL,
    unit TEXT NOT NULL,
    uncertainty REAL
) STRICT;
CREATE INDEX readings_of_run ON readings (run);

CREATE TABLE poses (
    run INTEGER NOT NULL REFERENCES runs (id),
    device TEXT NOT NULL,
    time TEXT NOT NULL,
    joints TEXT NOT NULL,              -- JSON, what the drive said
    PRIMARY KEY (run, device)
) STRICT;

CREATE TABLE revisions (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    cell TEXT NOT NULL,
    device TEXT NOT NULL,
    made TEXT NOT NULL,
    reason TEXT NOT NULL
) STRICT;

CREATE TABLE corrections (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    run INTEGER REFERENCES runs (id),
    step TEXT NOT NULL,
    cell TEXT NOT NULL,
    device TEXT NOT NULL,
    quantity TEXT NOT NULL,
    place TEXT NOT NULL,
    old REAL NOT NULL,
    new REAL NOT NULL,
    uncertainty REAL NOT NULL,
    unit TEXT NOT NULL,
    proposed TEXT NOT NULL,
    revision INTEGER REFERENCES revisions (id)
) STRICT;
CREATE INDEX corrections_in_force ON corrections (cell, device, quantity, place, revision);

CREATE TABLE model_revisions (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    cell TEXT NOT NULL,
    device TEXT NOT NULL,
    run INTEGER REFERENCES runs (id),
    made TEXT NOT NULL,
    note TEXT NOT NULL,
    sha256 TEXT NOT NULL,
    content TEXT NOT NULL
) STRICT;

CREATE TABLE interruptions (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    run INTEGER NOT NULL REFERENCES runs (id),
    time TEXT NOT NULL,
    kind TEXT NOT NULL,                -- sitting_began | paused | resumed | stopped | abort_asked | finish_asked | device_lost
    step TEXT,
    reason TEXT NOT NULL
) STRICT;
CREATE INDEX interruptions_of_run ON interruptions (run);

CREATE TABLE log (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    run INTEGER NOT NULL REFERENCES runs (id),
    time TEXT NOT NULL,
    level TEXT NOT NULL,
    source TEXT NOT NULL,
    step TEXT,
    message TEXT NOT NULL
) STRICT;
CREATE INDEX log_of_run ON log (run);
