CREATE TABLE queue (                   -- runs that wait for their cell
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    place INTEGER NOT NULL,            -- the smaller, the sooner
    cell TEXT NOT NULL,
    cell_file TEXT NOT NULL,
    procedure TEXT NOT NULL,
    parameters TEXT NOT NULL,          -- JSON object: name -> number
    answers TEXT,                      -- path of the file of answers; NULL: the cell's own
    author TEXT NOT NULL,
    added TEXT NOT NULL,
    removed TEXT,                      -- when it was taken off
    run INTEGER REFERENCES runs (id)   -- the run that carries it out; written in the transaction that begins that run
) STRICT;
CREATE INDEX queue_of_cell ON queue (cell_file, place);
