-- Rows of one run, the newest first: what a fleet's page asks of every cell, every second.
CREATE INDEX outbox_of_run ON outbox (record, kind, ((body->>'run')::bigint), number DESC, sequence DESC);

CREATE OR REPLACE VIEW waiting AS
    SELECT r.record, r.cell, r.run, p.body->>'step' AS step, (p.body->>'asked')::timestamptz AS asked,
           (p.body->>'description')::jsonb->>'title' AS title
    FROM runs r CROSS JOIN LATERAL (
        SELECT DISTINCT ON (o.number) o.body FROM outbox o
        WHERE o.record = r.record AND o.kind = 'prompts' AND (o.body->>'run')::bigint = r.run
        ORDER BY o.number DESC, o.sequence DESC) p
    WHERE r.state = 'running' AND p.body->>'answered' IS NULL AND p.body->>'withdrawn' IS NULL;

-- The arm of each robot of each cell, as its newest model file names it.
CREATE VIEW arms AS
    SELECT DISTINCT ON (record, body->>'cell', body->>'device') record, body->>'cell' AS cell, body->>'device' AS device,
           substring(body->>'content' FROM '(?n)^arm:[ ]*([^ #]+)') AS arm
    FROM newest WHERE kind = 'model_revisions' ORDER BY record, body->>'cell', body->>'device', number DESC;

-- What each run measured with, and until when that was calibrated.
CREATE VIEW instruments AS
    SELECT record, (body->>'run')::bigint AS run, body->>'name' AS name, body->>'what' AS what, body->>'calibration_due' AS calibration_due
    FROM newest WHERE kind = 'instruments';

-- Runs that wait for their cell.
CREATE VIEW queue AS
    SELECT record, number AS entry, body->>'cell' AS cell, body->>'procedure' AS procedure, (body->>'place')::bigint AS place,
           body->>'author' AS author, (body->>'added')::timestamptz AS added
    FROM newest WHERE kind = 'queue' AND body->>'removed' IS NULL AND body->>'run' IS NULL;

CREATE OR REPLACE VIEW cells AS
    SELECT l.record, l.cell, k.host, k.last_seen, l.run, l.procedure, l.state, l.started, l.ended, l.message,
           s.body->>'step' AS step, w.title AS waits_for, w.asked AS waits_since,
           i.name AS due_instrument, i.calibration_due AS due,
           (SELECT max(p.ended) FROM runs p WHERE p.record = l.record AND p.cell = l.cell AND p.state = 'passed') AS last_passed,
           (SELECT count(*) FROM queue q WHERE q.record = l.record AND q.cell = l.cell) AS queued,
           (SELECT string_agg(DISTINCT a.arm, ', ') FROM arms a WHERE a.record = l.record AND a.cell = l.cell) AS arm
    FROM (SELECT DISTINCT ON (record, cell) * FROM runs ORDER BY record, cell, run DESC) l
    JOIN records k ON k.record = l.record
    LEFT JOIN LATERAL (
        SELECT o.body FROM outbox o WHERE o.record = l.record AND o.kind = 'steps' AND (o.body->>'run')::bigint = l.run
        ORDER BY o.number DESC, o.sequence DESC LIMIT 1) s ON true
    LEFT JOIN LATERAL (
        SELECT v.title, v.asked FROM waiting v WHERE v.record = l.record AND v.run = l.run ORDER BY v.asked DESC LIMIT 1) w ON true
    LEFT JOIN LATERAL (
        SELECT o.body->>'name' AS name, o.body->>'calibration_due' AS calibration_due FROM outbox o
        WHERE o.record = l.record AND o.kind = 'instruments' AND (o.body->>'run')::bigint = l.run AND o.body->>'calibration_due' IS NOT NULL
        ORDER BY o.body->>'calibration_due' LIMIT 1) i ON true;
