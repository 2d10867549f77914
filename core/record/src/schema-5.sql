CREATE TABLE zero_losses (             -- a drive that no longer counts from where its zeros were found
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    cell TEXT NOT NULL,
    device TEXT NOT NULL,
    run INTEGER NOT NULL REFERENCES runs (id),
    time TEXT NOT NULL,
    revision INTEGER NOT NULL,         -- the newest of the device then: zeros of it and of earlier ones no longer hold
    reason TEXT NOT NULL
) STRICT;
CREATE INDEX zero_losses_of_device ON zero_losses (cell, device);
