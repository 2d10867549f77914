-- The newest run of each cell, and the newest that has passed, without going through all runs: after a year they are many, and a fleet's page asks every second.
CREATE INDEX outbox_runs_of_cell ON outbox (record, (body->>'cell'), number DESC, sequence DESC) WHERE kind = 'runs';
CREATE INDEX outbox_passed_of_cell ON outbox (record, (body->>'cell'), number DESC, sequence DESC) WHERE kind = 'runs' AND body->>'state' = 'passed';

-- What was written of runs lately: how they have ended is looked at every few seconds.
CREATE INDEX outbox_runs_made ON outbox (made) WHERE kind = 'runs';

CREATE OR REPLACE VIEW cells AS
    -- From cell to cell along the index (PostgreSQL's own wiki, "Loose indexscan").
    WITH RECURSIVE names AS (
        (SELECT record, body->>'cell' AS cell FROM outbox WHERE kind = 'runs' ORDER BY record, body->>'cell' LIMIT 1)
        UNION ALL
        SELECT n.record, n.cell FROM names p CROSS JOIN LATERAL (
            SELECT o.record, o.body->>'cell' AS cell FROM outbox o
            WHERE o.kind = 'runs' AND (o.record, o.body->>'cell') > (p.record, p.cell) ORDER BY o.record, o.body->>'cell' LIMIT 1) n)
    SELECT n.record, n.cell, k.host, k.last_seen, l.run, l.body->>'procedure' AS procedure, l.body->>'state' AS state,
           (l.body->>'started')::timestamptz AS started, (l.body->>'ended')::timestamptz AS ended, l.body->>'message' AS message,
           s.body->>'step' AS step, w.title AS waits_for, w.asked AS waits_since,
           i.name AS due_instrument, i.calibration_due AS due,
           -- The newest run that has passed: the last, but for one that was resumed after a newer one had passed.
           (SELECT (p.body->>'ended')::timestamptz FROM outbox p
            WHERE p.record = n.record AND p.kind = 'runs' AND p.body->>'cell' = n.cell AND p.body->>'state' = 'passed'
            ORDER BY p.number DESC, p.sequence DESC LIMIT 1) AS last_passed,
           (SELECT count(*) FROM queue q WHERE q.record = n.record AND q.cell = n.cell) AS queued,
           (SELECT string_agg(DISTINCT a.arm, ', ') FROM arms a WHERE a.record = n.record AND a.cell = n.cell) AS arm
    FROM names n
    JOIN records k ON k.record = n.record
    CROSS JOIN LATERAL (
        SELECT o.number AS run, o.body FROM outbox o WHERE o.record = n.record AND o.kind = 'runs' AND o.body->>'cell' = n.cell
        ORDER BY o.number DESC, o.sequence DESC LIMIT 1) l
    LEFT JOIN LATERAL (
        SELECT o.body FROM outbox o WHERE o.record = n.record AND o.kind = 'steps' AND (o.body->>'run')::bigint = l.run
        ORDER BY o.number DESC, o.sequence DESC LIMIT 1) s ON true
    LEFT JOIN LATERAL (
        SELECT v.title, v.asked FROM waiting v WHERE v.record = n.record AND v.run = l.run ORDER BY v.asked DESC LIMIT 1) w ON true
    LEFT JOIN LATERAL (
        SELECT o.body->>'name' AS name, o.body->>'calibration_due' AS calibration_due FROM outbox o
        WHERE o.record = n.record AND o.kind = 'instruments' AND (o.body->>'run')::bigint = l.run AND o.body->>'calibration_due' IS NOT NULL
        ORDER BY o.body->>'calibration_due' LIMIT 1) i ON true;
