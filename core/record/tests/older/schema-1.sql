BEGIN TRANSACTION;
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
INSERT INTO "corrections" VALUES(1,1,'apply_waist','teachmover','arm','joint_zero','waist',0.0,1.70000000000305573344e+00,0.0,'deg','2026-11-21T10:05:47.645Z',1);
CREATE TABLE interruptions (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    run INTEGER NOT NULL REFERENCES runs (id),
    time TEXT NOT NULL,
    kind TEXT NOT NULL,                -- sitting_began | paused | resumed | stopped | abort_asked | finish_asked | device_lost
    step TEXT,
    reason TEXT NOT NULL
) STRICT;
INSERT INTO "interruptions" VALUES(1,1,'2026-11-21T10:05:47.537Z','sitting_began',NULL,'ada');
CREATE TABLE loaded (
    run INTEGER NOT NULL REFERENCES runs (id),
    role TEXT NOT NULL,                -- cell | procedure | model | answers | world | plugin
    path TEXT NOT NULL,
    sha256 TEXT NOT NULL,
    content BLOB                       -- kept for text files
) STRICT;
INSERT INTO "loaded" VALUES(1,'cell','cell.yaml','53022cbcc3d708f4c67ea744a8469ac7af469f78e216def6209b1a9f655a6684',NULL);
INSERT INTO "loaded" VALUES(1,'procedure','procedures/waist-initialization.yaml','74e088096c72bba8b17bd35f1c02cce823aa78f4ff9b8f2a9f20fb7efbbfdd00',NULL);
INSERT INTO "loaded" VALUES(1,'model','teachmover.model.yaml','2231045a85cc397c744ad156b6c4330b212d3503093dd8e1791d293a13921edf',NULL);
INSERT INTO "loaded" VALUES(1,'answers','answers.yaml','79e65262995815e76b644e5e147e6d79f0d679916a057d6f6b8959ff6e93bc22',NULL);
INSERT INTO "loaded" VALUES(1,'plugin','/opt/plumb/plugins/simulated/plugin.yaml','2792690f959e4d70fc17a8191fcf009c5c9917df588f337d38f260ebaff5e1d0',NULL);
INSERT INTO "loaded" VALUES(1,'plugin','/opt/plumb/plugins/libplumb_simulated.so','807608cbf1da2748136d4ebb7babb6c28d25039929af1d9a33ff7e887d206ad8',NULL);
INSERT INTO "loaded" VALUES(1,'plugin','/opt/plumb/plugins/ir-proximity/plugin.yaml','ed8f4310d9f84139c720dfade8b2e09cf088145192ffd6007eed45f84b13ef03',NULL);
INSERT INTO "loaded" VALUES(1,'plugin','/opt/plumb/plugins/libplumb_ir_proximity.so','d2fe6b8b3eda2f807654fe8b9510a241e8632b35696fb369eda6cb34262fc988',NULL);
INSERT INTO "loaded" VALUES(1,'world','world-ideal.yaml','74212e0c65fa826aec360713ea6e5cc16f0a4161399ccd434b556a2625be81df',NULL);
CREATE TABLE log (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    run INTEGER NOT NULL REFERENCES runs (id),
    time TEXT NOT NULL,
    level TEXT NOT NULL,
    source TEXT NOT NULL,
    step TEXT,
    message TEXT NOT NULL
) STRICT;
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
INSERT INTO "model_revisions" VALUES(1,'teachmover','arm',1,'2026-11-21T10:05:47.516Z','loaded','2231045a85cc397c744ad156b6c4330b212d3503093dd8e1791d293a13921edf','# Microbot TeachMover with the proximity sensor in its hand. The drive keeps the forearm''s and the hand''s attitude when a joint above them moves; the
# model''s angles are relative, link by link (see model_from_drive in the cell files). Lengths as in Yang & Siegel 1987, reconstructed from its numbers.
arm: teachmover
convention: distal
joints:
  - {name: waist, a_mm: 0, alpha_deg: 90, d_mm: 195, theta_deg: 0, limits_deg: [-90, 90]}
  - {name: shoulder, a_mm: 177.8, alpha_deg: 0, d_mm: 0, theta_deg: 0, limits_deg: [-35, 144]}
  - {name: elbow, a_mm: 177.8, alpha_deg: 0, d_mm: 0, theta_deg: 0, limits_deg: [-149, 0]}
  - {name: wrist_pitch, a_mm: 0, alpha_deg: 90, d_mm: 0, theta_deg: 90, limits_deg: [-90, 90]}
  - {name: wrist_roll, a_mm: 0, alpha_deg: 0, d_mm: 109, theta_deg: 0}
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
free: []
effects: []
surfaces:
  table: {plane: {normal: [0, 0, 1], offset_mm: 0}, free: false}
  # The outer edge of the T''s head, 140 mm from the waist axis, 8 degrees from line A.
  line_b: {line: {point_mm: [138.637, 19.484, 0], direction: [-0.139173, 0.990268, 0]}, free: false}
measured_from: world
');
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
INSERT INTO "plan" VALUES(1,0,'lower','Lower the hand until the sensor fires','search',0,3.32118884316415208246e+00);
INSERT INTO "plan" VALUES(1,1,'press','Go on a little below that height','move',0,1.45514403292181071503e-01);
INSERT INTO "plan" VALUES(1,2,'find_a','Turn the waist until line A is found','search',0,3.22224733207784064248e+00);
INSERT INTO "plan" VALUES(1,3,'apply_waist','Put the waist''s zero right','apply',0,0.01);
INSERT INTO "plan" VALUES(1,4,'raise','Raise the hand','move',0,5.43253772290809400224e-01);
INSERT INTO "plan" VALUES(1,5,'aside','Turn back over the white quadrant','move',0,1.43077596298205556024e+00);
CREATE TABLE poses (
    run INTEGER NOT NULL REFERENCES runs (id),
    device TEXT NOT NULL,
    time TEXT NOT NULL,
    joints TEXT NOT NULL,              -- JSON, what the drive said
    PRIMARY KEY (run, device)
) STRICT;
INSERT INTO "poses" VALUES(1,'arm','2026-11-21T10:05:47.670Z','[{"name":"waist","drive":6.299999999996945,"value":8.000000000000002,"unit":"deg"},{"name":"shoulder","drive":40.04637167974625,"value":40.04637167974625,"unit":"deg"},{"name":"elbow","drive":-79.3,"value":-79.3,"unit":"deg"},{"name":"wrist_pitch","drive":-90.0,"value":-90.0,"unit":"deg"},{"name":"wrist_roll","drive":0.0,"value":0.0,"unit":"deg"},{"name":"gripper","drive":20.000000000000004,"value":20.000000000000004,"unit":"mm"}]');
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
INSERT INTO "prompts" VALUES(1,1,'apply_waist','2026-11-21T10:05:47.649Z','{"id":1,"step":"apply_waist","title":"Put the waist''s zero right","text":"Put these corrections in force?\nzero of waist: 0.0000 -> 1.7000 deg (+- 0.0000)","help":"What was in force before is kept in the record and can be brought back.","kind":{"kind":"choice","options":[{"key":"accept","label":"Put them in force"},{"key":"reject","label":"Leave everything as it is"}],"default":"accept"}}','2026-11-21T10:05:47.650Z','{"kind":"choice","key":"accept"}','answers file',NULL);
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
CREATE TABLE revisions (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    cell TEXT NOT NULL,
    device TEXT NOT NULL,
    made TEXT NOT NULL,
    reason TEXT NOT NULL
) STRICT;
INSERT INTO "revisions" VALUES(1,'teachmover','arm','2026-11-21T10:05:47.653Z','run 1, step apply_waist');
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
INSERT INTO "runs" VALUES(1,'teachmover','/cells/cell/cell.yaml','waist-initialization','/cells/cell/procedures/waist-initialization.yaml','Waist initialization (Yang & Siegel 3.3.1)','ada',1,'{"line_a_deg":0,"offset_deg":8,"lower_deg":40,"turn_deg":30,"press_deg":0.6,"Ar_deg":5}','{"answers":"/cells/cell/answers.yaml"}','0.1.0',NULL,'2026-11-21T10:05:47.505Z','2026-11-21T10:05:47.671Z','passed','all steps passed');
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
INSERT INTO "steps" VALUES(1,1,'lower',1,'2026-11-21T10:05:47.589Z','{"start":[0.16231562043547265,0.757472895365539,-1.3840460968315031,-1.5707963267948966,0.0,20.000000000000004]}','2026-11-21T10:05:47.607Z','passed','eye came on with shoulder at 35.0464 deg (known to 0.00e0)','{"joints":{"waist_deg":9.3,"shoulder_deg":35.04637167974625,"elbow_deg":-79.3,"wrist_pitch_deg":-90.0,"wrist_roll_deg":0.0,"gripper_mm":20.000000000000004},"fast_joints":{"waist_deg":9.3,"shoulder_deg":35.04637167974625,"elbow_deg":-79.3,"wrist_pitch_deg":-90.0,"wrist_roll_deg":0.0,"gripper_mm":20.000000000000004},"half_width_deg":0.0}');
INSERT INTO "steps" VALUES(2,1,'press',1,'2026-11-21T10:05:47.617Z','{"target":[0.16231562043547265,0.6012026011773017,-1.3840460968315031,-1.5707963267948966,0.0,20.000000000000004]}','2026-11-21T10:05:47.625Z','passed','shoulder at 34.446 deg','{"joints":{"waist_deg":9.3,"shoulder_deg":34.44637167974625,"elbow_deg":-79.3,"wrist_pitch_deg":-90.0,"wrist_roll_deg":0.0,"gripper_mm":20.000000000000004}}');
INSERT INTO "steps" VALUES(3,1,'find_a',1,'2026-11-21T10:05:47.626Z','{"start":[0.16231562043547265,0.6012026011773017,-1.3840460968315031,-1.5707963267948966,0.0,20.000000000000004]}','2026-11-21T10:05:47.641Z','passed','eye went off with waist at -1.7000 deg (known to 0.00e0)','{"joints":{"waist_deg":-1.7000000000030557,"shoulder_deg":34.44637167974625,"elbow_deg":-79.3,"wrist_pitch_deg":-90.0,"wrist_roll_deg":0.0,"gripper_mm":20.000000000000004},"fast_joints":{"waist_deg":-1.7000000000030644,"shoulder_deg":34.44637167974625,"elbow_deg":-79.3,"wrist_pitch_deg":-90.0,"wrist_roll_deg":0.0,"gripper_mm":20.000000000000004},"half_width_deg":0.0}');
INSERT INTO "steps" VALUES(4,1,'apply_waist',1,'2026-11-21T10:05:47.645Z',NULL,'2026-11-21T10:05:47.657Z','passed','zeros shifted: waist by +1.7000 deg (revision 1)','{"applied":true,"revision":1}');
INSERT INTO "steps" VALUES(5,1,'raise',1,'2026-11-21T10:05:47.659Z','{"target":[-0.029670597283956934,0.6989410392889842,-1.3840460968315031,-1.5707963267948966,0.0,20.000000000000004]}','2026-11-21T10:05:47.662Z','passed','shoulder at 40.046 deg','{"joints":{"waist_deg":0.0,"shoulder_deg":40.04637167974625,"elbow_deg":-79.3,"wrist_pitch_deg":-90.0,"wrist_roll_deg":0.0,"gripper_mm":20.000000000000004}}');
INSERT INTO "steps" VALUES(6,1,'aside',1,'2026-11-21T10:05:47.665Z','{"target":[0.10995574287558943,0.6989410392889842,-1.3840460968315031,-1.5707963267948966,0.0,20.000000000000004]}','2026-11-21T10:05:47.670Z','passed','waist at 8.000 deg','{"joints":{"waist_deg":8.000000000000002,"shoulder_deg":40.04637167974625,"elbow_deg":-79.3,"wrist_pitch_deg":-90.0,"wrist_roll_deg":0.0,"gripper_mm":20.000000000000004}}');
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
INSERT INTO "triggers" VALUES(1,1,'lower','arm','eye',1,0,1405191086,'shoulder','[{"name":"waist","drive":9.3,"value":9.3,"unit":"deg"},{"name":"shoulder","drive":35.04637167974625,"value":35.04637167974625,"unit":"deg"},{"name":"elbow","drive":-79.3,"value":-79.3,"unit":"deg"},{"name":"wrist_pitch","drive":-90.0,"value":-90.0,"unit":"deg"},{"name":"wrist_roll","drive":0.0,"value":0.0,"unit":"deg"},{"name":"gripper","drive":20.000000000000004,"value":20.000000000000004,"unit":"mm"}]',0.0,'deg');
INSERT INTO "triggers" VALUES(2,1,'lower','arm','eye',1,1,2049952966,'shoulder','[{"name":"waist","drive":9.3,"value":9.3,"unit":"deg"},{"name":"shoulder","drive":35.04637167974625,"value":35.04637167974625,"unit":"deg"},{"name":"elbow","drive":-79.3,"value":-79.3,"unit":"deg"},{"name":"wrist_pitch","drive":-90.0,"value":-90.0,"unit":"deg"},{"name":"wrist_roll","drive":0.0,"value":0.0,"unit":"deg"},{"name":"gripper","drive":20.000000000000004,"value":20.000000000000004,"unit":"mm"}]',0.0,'deg');
INSERT INTO "triggers" VALUES(3,1,'find_a','arm','eye',0,0,3613307933,'waist','[{"name":"waist","drive":-1.7000000000030644,"value":-1.7000000000030644,"unit":"deg"},{"name":"shoulder","drive":34.44637167974625,"value":34.44637167974625,"unit":"deg"},{"name":"elbow","drive":-79.3,"value":-79.3,"unit":"deg"},{"name":"wrist_pitch","drive":-90.0,"value":-90.0,"unit":"deg"},{"name":"wrist_roll","drive":0.0,"value":0.0,"unit":"deg"},{"name":"gripper","drive":20.000000000000004,"value":20.000000000000004,"unit":"mm"}]',0.0,'deg');
INSERT INTO "triggers" VALUES(4,1,'find_a','arm','eye',0,1,4306967702,'waist','[{"name":"waist","drive":-1.7000000000030557,"value":-1.7000000000030557,"unit":"deg"},{"name":"shoulder","drive":34.44637167974625,"value":34.44637167974625,"unit":"deg"},{"name":"elbow","drive":-79.3,"value":-79.3,"unit":"deg"},{"name":"wrist_pitch","drive":-90.0,"value":-90.0,"unit":"deg"},{"name":"wrist_roll","drive":0.0,"value":0.0,"unit":"deg"},{"name":"gripper","drive":20.000000000000004,"value":20.000000000000004,"unit":"mm"}]',0.0,'deg');
CREATE INDEX steps_of_run ON steps (run, step);
CREATE INDEX prompts_of_run ON prompts (run, step);
CREATE INDEX triggers_of_run ON triggers (run);
CREATE INDEX readings_of_run ON readings (run);
CREATE INDEX corrections_in_force ON corrections (cell, device, quantity, place, revision);
CREATE INDEX interruptions_of_run ON interruptions (run);
CREATE INDEX log_of_run ON log (run);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('runs',1);
INSERT INTO "sqlite_sequence" VALUES('model_revisions',1);
INSERT INTO "sqlite_sequence" VALUES('interruptions',1);
INSERT INTO "sqlite_sequence" VALUES('steps',6);
INSERT INTO "sqlite_sequence" VALUES('triggers',4);
INSERT INTO "sqlite_sequence" VALUES('corrections',1);
INSERT INTO "sqlite_sequence" VALUES('prompts',1);
INSERT INTO "sqlite_sequence" VALUES('revisions',1);
COMMIT;