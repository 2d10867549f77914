//! Examples of every command, for its help and its manual page. Files are called as `plumb init` calls them. A test types each of them.

use super::example::{Entry, example};

pub(super) const EXAMPLES: &[Entry] = &[
    (
        "init",
        &[
            example("plumb init lab", "the TeachMover over a T target, in lab/teachmover"),
            example("plumb init lab --cell light-stripe --cell ur5", "two other cells beside it"),
            example("plumb init --list", "which examples there are"),
        ],
    ),
    (
        "run",
        &[
            example("plumb run teachmover/cell.yaml", "the cell's first procedure, on the screens"),
            example("plumb run teachmover/cell.yaml --dry-run", "what it would do; nothing is started"),
            example(
                "plumb run teachmover/cell.yaml shoulder-elbow-initialization --headless --set Br_deg=10",
                "another procedure with another back rotation, unattended",
            ),
            example(
                "plumb run teachmover/cell.yaml --json --events step_finished,run_ended",
                "its results, for another program",
            ),
            example("plumb run --resume", "go on with the run that was interrupted last"),
        ],
    ),
    (
        "watch",
        &[
            example("plumb watch 12", "the screens of run 12, from another terminal"),
            example(
                "plumb run teachmover/cell.yaml --json | plumb watch -",
                "the screens of events that come in",
            ),
            example("plumb watch events.jsonl", "a run that was kept as events"),
        ],
    ),
    (
        "answer",
        &[
            example("plumb answer", "what is asked"),
            example("plumb answer done", "an acknowledgement"),
            example(
                "plumb answer simulate",
                "in a simulated cell: leave this and everything like it to the program",
            ),
            example("plumb answer --prompt level 0.2", "only if the prompt of that step is still open"),
            example("plumb answer 12 shoulder=45,elbow=-70", "run 12: move the arm there and take that pose"),
        ],
    ),
    (
        "target",
        &[
            example(
                "plumb target teachmover/cell.yaml -o target.pdf",
                "the T to print, with rulers to check the print",
            ),
            example(
                "plumb target teachmover/cell.yaml -o target.svg --paper a3",
                "the same as SVG, on larger paper",
            ),
        ],
    ),
    (
        "check",
        &[
            example("plumb check teachmover/cell.yaml", "a cell and everything it names"),
            example("plumb check ur5/ur5.model.yaml table.csv", "a model and a table"),
        ],
    ),
    (
        "doctor",
        &[
            example("plumb doctor", "this computer: limits, ports, terminal, plugins, record"),
            example("plumb doctor teachmover/cell-hardware.yaml", "a cell's serial ports too"),
            example(
                "plumb doctor --database postgres://plumb@db.lab.example/plumb",
                "the central database too",
            ),
            example("plumb doctor --clean", "remove what killed runs have left"),
        ],
    ),
    (
        "history",
        &[
            example("plumb history", "the newest runs"),
            example(
                "plumb history --cell teachmover --ended failed --since 2026-11-01",
                "runs that failed since then",
            ),
            example("plumb history --trend arm.waist", "the waist's zero over time"),
        ],
    ),
    (
        "show",
        &[
            example("plumb show 12", "run 12 in full"),
            example(
                "plumb show --cell teachmover --table > table.csv",
                "its newest run as a table for the model lab",
            ),
            example("plumb show 12 --json", "everything, for another program"),
        ],
    ),
    (
        "certificate",
        &[
            example("plumb certificate 12 -o waist.html", "as found and as left, to print"),
            example("plumb certificate 3 -o c.html --record br10", "of a run in another record"),
        ],
    ),
    (
        "note",
        &[
            example("plumb note 12 'the table was moved'", "add it to run 12"),
            example("plumb note 12 'new belt' --operator Maria", "in somebody's name"),
        ],
    ),
    (
        "record backup",
        &[
            example("plumb record backup monday.sqlite3", "a copy while runs go on"),
            example("plumb record backup br10.sqlite3 --record br10", "of another record"),
        ],
    ),
    (
        "record check",
        &[
            example("plumb record check", "is the record sound?"),
            example("plumb record check --record br10", "another one"),
        ],
    ),
    (
        "record zeros",
        &[
            example("plumb record zeros teachmover", "its corrections, revision by revision"),
            example("plumb record zeros teachmover --json", "for another program"),
        ],
    ),
    (
        "record rollback",
        &[
            example("plumb record rollback teachmover 3", "as they were at revision 3"),
            example("plumb record rollback teachmover 0", "as they were before the first"),
        ],
    ),
    (
        "model compare",
        &[
            example(
                "plumb model compare ur5/ur5.model.yaml --data table.csv",
                "how far the model misses, and where",
            ),
            example(
                "plumb model compare ur5/ur5.model.yaml --data table.csv --plot svg -o residuals.svg",
                "with the residuals drawn",
            ),
        ],
    ),
    (
        "model diagnose",
        &[
            example("plumb model diagnose ur5/ur5.model.yaml --data table.csv", "which effect is missing"),
            example(
                "plumb model diagnose ur5/ur5.model.yaml --data table.csv --holdout random:0.3:1 --json",
                "held out by chance with seed 1; for another program",
            ),
        ],
    ),
    (
        "model add",
        &[
            example(
                "plumb model add ur5/ur5.model.yaml 'joint_compliance(lift)' --data table.csv",
                "fit it and write the next revision",
            ),
            example(
                "plumb model add ur5/ur5.model.yaml 'geometry(*)' --data table.csv",
                "lengths and angles of every link",
            ),
            example(
                "plumb model add ur5/ur5.model.yaml 'link_torsion(lift)' --data table.csv --yes",
                "in a script: add it although the lab may not name it",
            ),
        ],
    ),
    (
        "model remove",
        &[
            example(
                "plumb model remove ur5/ur5.model.yaml 'joint_compliance(lift)' --data table.csv",
                "fit without it",
            ),
            example(
                "plumb model remove ur5/ur5.model.yaml 'joint_zero(*)' --data table.csv",
                "of every joint",
            ),
        ],
    ),
    (
        "model accept",
        &[
            example(
                "plumb model accept ur5/ur5.model.yaml --data table.csv",
                "take over the free parameters' values",
            ),
            example(
                "plumb model accept ur5/ur5.model.yaml --data table.csv --free 'joint_zero(*)'",
                "of the zeros alone",
            ),
        ],
    ),
    (
        "model grow",
        &[
            example(
                "plumb model grow ur5/ur5.model.yaml --data table.csv",
                "add until nothing more can be named",
            ),
            example("plumb model grow ur5/ur5.model.yaml --data table.csv --dry", "show it, write nothing"),
        ],
    ),
    (
        "model history",
        &[
            example("plumb model history ur5/ur5.model.yaml", "its revisions"),
            example("plumb model history ur5/ur5.model.yaml --json", "for another program"),
        ],
    ),
    (
        "model undo",
        &[
            example("plumb model undo ur5/ur5.model.yaml", "as it was before the last change"),
            example("plumb model undo ur5/ur5.model.yaml --json", "for another program"),
        ],
    ),
    (
        "model next",
        &[
            example(
                "plumb model next ur5/ur5.model.yaml --data table.csv -n 8",
                "eight poses to measure next",
            ),
            example(
                "plumb model next ur5/ur5.model.yaml --data table.csv --keep-out 0,0,1,20 --csv > poses.csv",
                "20 mm clear of the table, as a table for a procedure",
            ),
        ],
    ),
    (
        "model effects",
        &[
            example("plumb model effects", "the library"),
            example("plumb model effects joint_backlash", "what to measure to see it, and its parameters"),
        ],
    ),
    (
        "model template",
        &[
            example("plumb model template ur5", "model and table of a known robot"),
            example("plumb model template arm.urdf --tip flange -o calibration", "of a URDF file"),
        ],
    ),
    (
        "model report",
        &[
            example(
                "plumb model report ur5/ur5.model.yaml --data table.csv -o ur5.html",
                "the story as one page",
            ),
            example(
                "plumb model report ur5/ur5.model.yaml --data table.csv --json",
                "with its numbers as JSON",
            ),
        ],
    ),
    (
        "model screen",
        &[
            example("plumb model screen ur5/ur5.model.yaml --data table.csv", "the lab on the screen"),
            example(
                "plumb model screen ur5/ur5.model.yaml --data table.csv --free none",
                "with nothing fitted beforehand",
            ),
        ],
    ),
    (
        "stripe diagnose",
        &[
            example(
                "plumb stripe diagnose light-stripe/cell.yaml --scans scans",
                "what zeros and rig leave unexplained",
            ),
            example(
                "plumb stripe diagnose light-stripe/cell.yaml --scans scans --add 'joint_compliance(shoulder)' --json",
                "with an effect named before; for another program",
            ),
        ],
    ),
    (
        "stripe next",
        &[
            example(
                "plumb stripe next light-stripe/cell.yaml --scans scans -n 6",
                "poses of six pictures that would tell what these scans cannot",
            ),
            example("plumb stripe next light-stripe/cell.yaml --scans scans --json", "the same for a script"),
        ],
    ),
    (
        "stripe screen",
        &[
            example(
                "plumb stripe screen light-stripe/cell.yaml --scans scans",
                "what could explain the error, and what would be left",
            ),
            example(
                "plumb stripe screen light-stripe/cell.yaml --scans scans --add 'joint_compliance(shoulder)'",
                "beside what has been named",
            ),
        ],
    ),
    (
        "stripe adjust",
        &[
            example("plumb stripe adjust light-stripe/cell.yaml --scans scans", "fit zeros and rig to scans"),
            example(
                "plumb stripe adjust light-stripe/cell.yaml --scans scans -o light-stripe/better.yaml",
                "and write a cell that uses them",
            ),
        ],
    ),
    (
        "stripe correct",
        &[
            example(
                "plumb stripe correct light-stripe/cell.yaml -o light-stripe/better.yaml",
                "the rig in force as a file",
            ),
            example(
                "plumb stripe correct light-stripe/cell.yaml -o light-stripe/better.yaml --record br10",
                "by another record",
            ),
        ],
    ),
    (
        "stripe show",
        &[
            example("plumb stripe show cloud.ply", "on the Scan screen"),
            example("plumb stripe show cloud.ply --picture cloud.png --turn 40", "as a picture"),
        ],
    ),
    (
        "stripe export",
        &[
            example("plumb stripe export cloud.ply cloud.e57", "for surveyors' programs"),
            example(
                "plumb stripe export cloud.ply cloud.mcap --rig light-stripe/rig.yaml",
                "for Foxglove, with the camera",
            ),
        ],
    ),
    (
        "trial new",
        &[
            example("plumb trial new --seed 3 -o trial", "an arm and a fault drawn by chance"),
            example(
                "plumb trial new --cell ur5 --fault 'backlash(lift)' --seed 1 -o trial",
                "a whole cell that hides it",
            ),
        ],
    ),
    (
        "trial batch",
        &[
            example("plumb trial batch --seed 1 --count 20 -o trials", "twenty trials"),
            example("plumb trial batch --seed 1 --count 5 --arm puma560 -o trials", "of one arm"),
        ],
    ),
    (
        "trial measure",
        &[
            example(
                "plumb trial measure trial --poses next.json",
                "the poses that `plumb model next --json` asks for",
            ),
            example("plumb trial measure trials/7 --poses diagnosis.json", "those of a diagnosis"),
        ],
    ),
    (
        "trial inject",
        &[
            example(
                "plumb trial inject arm.yaml --data table.csv --effect 'joint_backlash(elbow)' --size 0.05deg -o injected",
                "would the lab have seen it?",
            ),
            example(
                "plumb trial inject arm.yaml --data table.csv --effect joint_harmonic -o injected",
                "at a joint drawn by chance, twice as large as what the model leaves",
            ),
        ],
    ),
    (
        "trial reveal",
        &[
            example("plumb trial reveal trial", "what was hidden"),
            example("plumb trial reveal trial --diagnosis diagnosis.json", "and was the diagnosis right?"),
        ],
    ),
    (
        "trial rehearse",
        &[
            example("plumb trial rehearse --cell teachmover", "every fault of this cell, the whole way"),
            example("plumb trial rehearse --cell puma --fault backlash -n 5", "one fault, five seeds"),
        ],
    ),
    (
        "emulate dobot",
        &[
            example("plumb emulate dobot --link magician", "an arm of air; a link to the port"),
            example(
                "plumb emulate dobot --world world.socket --sensors-off 0,1.2,-0.8,0",
                "over the arm of a simulated world; two angle sensors are off",
            ),
        ],
    ),
    (
        "emulate feetech",
        &[
            example(
                "plumb emulate feetech --link so101",
                "six servos with nothing on them; a link to the port",
            ),
            example(
                "plumb emulate feetech --world world.socket --reversed 2",
                "an arm whose second servo is reversed",
            ),
        ],
    ),
    (
        "emulate teachmover",
        &[
            example("plumb emulate teachmover", "motors on a bench; prints its port"),
            example("plumb emulate teachmover --as-fast-as-possible", "without the line's own slowness"),
        ],
    ),
    (
        "emulate universal-robots",
        &[
            example(
                "plumb emulate universal-robots --world /run/user/1000/world.socket",
                "over the arm of a simulated world; prints its address",
            ),
            example(
                "plumb emulate universal-robots --world world.socket --series cb3",
                "a controller of the generation before",
            ),
        ],
    ),
    (
        "emulate val2",
        &[
            example(
                "plumb emulate val2 --world /run/user/1000/world.socket",
                "over the arm of a simulated world",
            ),
            example(
                "plumb emulate val2 --world world.socket --as-fast-as-possible",
                "without the line's own slowness",
            ),
        ],
    ),
    (
        "wire record",
        &[
            example(
                "plumb wire record /dev/ttyUSB0 --baud 9600 --link port -o arm.wire",
                "then drive the arm through ./port",
            ),
            example(
                "plumb wire record /dev/ttyACM0 --baud 1000000 --link port -o so101.wire",
                "an SO-101's bus",
            ),
        ],
    ),
    (
        "wire replay",
        &[
            example(
                "plumb wire replay arm.wire cell-hardware.yaml",
                "does plumb send now what was sent then?",
            ),
            example(
                "plumb wire replay arm.wire cell-hardware.yaml first-day -- --answers answers.yaml",
                "another procedure, and options of `plumb run`",
            ),
        ],
    ),
    (
        "study design",
        &[
            example(
                "plumb study design teachmover/teachmover.model.yaml",
                "where to put the target of this arm",
            ),
            example(
                "plumb study design arm.yaml --K 300 --h 10 -o figures",
                "with the distance given; writes the figures",
            ),
        ],
    ),
    (
        "plugins list",
        &[
            example("plumb plugins list", "what can be found"),
            example("plumb plugins list --plugins ./mine", "with a folder of your own"),
        ],
    ),
    (
        "plugins verify",
        &[
            example("plumb plugins verify", "load each and check its manifest"),
            example("plumb plugins verify teachmover ./mine/plugin.yaml", "two of them"),
        ],
    ),
    (
        "plugins check",
        &[
            example(
                "plumb plugins check ./my-gauge --config '{port: /dev/ttyUSB0}'",
                "a sensor, on its device",
            ),
            example("plumb plugins check ./my-arm --move", "a robot; it moves, so keep clear"),
        ],
    ),
    (
        "plugins new",
        &[
            example("plumb plugins new sensor my-gauge --lang python", "no compiler needed"),
            example("plumb plugins new robot my-arm", "in Rust; --lang c for C"),
        ],
    ),
    (
        "streams",
        &[
            example("plumb streams teachmover/cell.yaml", "what its devices emit"),
            example(
                "plumb streams teachmover/cell.yaml arm/joints --json --wait 60",
                "from the start of its next run, for another program",
            ),
        ],
    ),
    (
        "schema",
        &[
            example("plumb schema cell > cell.schema.json", "for an editor that completes cell files"),
            example("plumb schema procedure", "of procedures, with every kind of step"),
            example("plumb schema events", "of the lines that `plumb run --json` writes"),
        ],
    ),
    (
        "completions",
        &[
            example("plumb completions bash > ~/.local/share/bash-completion/completions/plumb", "for bash"),
            example("plumb completions zsh > ~/.zfunc/_plumb", "for zsh, where fpath has ~/.zfunc"),
        ],
    ),
    (
        "man",
        &[
            example("plumb man -o man1", "a manual page for each command"),
            example("plumb man -o ~/.local/share/man/man1", "where `man plumb` finds them"),
        ],
    ),
];
