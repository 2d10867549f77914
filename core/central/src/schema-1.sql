CREATE TABLE records (
    record text PRIMARY KEY,                    -- identity of a cell's record, 32 hexadecimal digits
    host text NOT NULL,                         -- the machine that ships it
    directory text NOT NULL,                    -- where it lies there
    first_seen timestamptz NOT NULL DEFAULT now(),
    last_seen timestamptz NOT NULL DEFAULT now()
);

CREATE TABLE outbox (
    record text NOT NULL REFERENCES records (record),
    sequence bigint NOT NULL,                   -- the record's own order
    kind text NOT NULL,                         -- table of the record
    number bigint NOT NULL,                     -- row of that table
    made timestamptz NOT NULL,
    body jsonb NOT NULL,
    sha256 text NOT NULL,                       -- of the row as the record has it
    received timestamptz NOT NULL DEFAULT now(),
    PRIMARY KEY (record, sequence)
);
CREATE INDEX outbox_newest ON outbox (kind, record, number, sequence DESC);

CREATE TABLE effects (
    record text NOT NULL REFERENCES records (record),
    sequence bigint NOT NULL,                   -- row of the outbox that brought the model
    cell text NOT NULL,
    device text NOT NULL,
    made timestamptz NOT NULL,
    effect text NOT NULL,
    place text NOT NULL,                        -- joint, link, target; empty where the effect has none
    parameter text NOT NULL,
    value double precision NOT NULL,
    claim text NOT NULL,                        -- mechanism | correction
    PRIMARY KEY (record, sequence, effect, place, parameter)
);
CREATE INDEX effects_over_time ON effects (effect, place, made);

CREATE VIEW newest AS
    SELECT DISTINCT ON (kind, record, number) kind, record, number, sequence, made, body
    FROM outbox ORDER BY kind, record, number, sequence DESC;

CREATE VIEW runs AS
    SELECT record, number AS run, body->>'cell' AS cell, body->>'cell_file' AS cell_file, body->>'procedure' AS procedure, body->>'title' AS title,
           body->>'operator' AS operator, (body->>'started')::timestamptz AS started, (body->>'ended')::timestamptz AS ended,
           body->>'state' AS state, body->>'message' AS message
    FROM newest WHERE kind = 'runs';

CREATE VIEW steps AS
    SELECT record, number AS id, (body->>'run')::bigint AS run, body->>'step' AS step, (body->>'attempt')::int AS attempt,
           (body->>'started')::timestamptz AS started, (body->>'ended')::timestamptz AS ended, body->>'outcome' AS outcome, body->>'message' AS message
    FROM newest WHERE kind = 'steps';

CREATE VIEW prompts AS
    SELECT record, number AS id, (body->>'run')::bigint AS run, body->>'step' AS step, (body->>'asked')::timestamptz AS asked,
           (body->>'description')::jsonb AS description, (body->>'answered')::timestamptz AS answered, body->>'answer' AS answer,
           body->>'answered_by' AS answered_by, (body->>'withdrawn')::timestamptz AS withdrawn
    FROM newest WHERE kind = 'prompts';

CREATE VIEW corrections AS
    SELECT c.record, c.number AS id, (c.body->>'run')::bigint AS run, c.body->>'cell' AS cell, c.body->>'device' AS device,
           c.body->>'quantity' AS quantity, c.body->>'place' AS place, (c.body->>'old')::double precision AS old,
           (c.body->>'new')::double precision AS new, (c.body->>'uncertainty')::double precision AS uncertainty, c.body->>'unit' AS unit,
           (c.body->>'proposed')::timestamptz AS proposed, (c.body->>'revision')::bigint AS revision
    FROM newest c WHERE c.kind = 'corrections';

CREATE VIEW waiting AS
    SELECT p.record, r.cell, p.run, p.step, p.asked, p.description->>'title' AS title
    FROM prompts p JOIN runs r ON r.record = p.record AND r.run = p.run
    WHERE p.answered IS NULL AND p.withdrawn IS NULL AND r.state = 'running';

CREATE VIEW cells AS
    SELECT DISTINCT ON (r.record, r.cell) r.record, r.cell, k.host, k.last_seen, r.run, r.procedure, r.state, r.started, r.ended, r.message,
           (SELECT s.step FROM steps s WHERE s.record = r.record AND s.run = r.run ORDER BY s.id DESC LIMIT 1) AS step,
           (SELECT w.title FROM waiting w WHERE w.record = r.record AND w.run = r.run ORDER BY w.asked DESC LIMIT 1) AS waits_for,
           (SELECT w.asked FROM waiting w WHERE w.record = r.record AND w.run = r.run ORDER BY w.asked DESC LIMIT 1) AS waits_since
    FROM runs r JOIN records k ON k.record = r.record
    ORDER BY r.record, r.cell, r.run DESC;
