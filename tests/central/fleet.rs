//! Twenty cells over months: made-up records, shipped by the program as a lab runs it, and asked in SQL, in the terminal and on the page in a real browser.

use std::fmt::Write as _;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use plumb_record::Record;
use serde_json::Value;

use crate::browser::Browser;
use crate::http::request;
use crate::lab::{CommandOutput, Lab};
use crate::server::Server;
use crate::wait_until;

/// Cells, and runs of each.
const CELLS: usize = 20;
const RUNS: usize = 200;

/// A model is written with every so many runs.
const RUNS_A_MODEL: usize = 10;

/// The cell whose shoulder is softer than that of the others with the same arm.
const SOFT: usize = 13;

/// The cell one of whose models is off.
const ODD: usize = 5;

/// The true compliance, rad/(N mm).
const COMPLIANCE: f64 = 7e-6;

/// `plumb fleet --serve` on a port that the system chooses.
struct Page {
    child: Child,
    address: String,
}

impl Page {
    fn start(lab: &Lab, from: &str) -> Self {
        let mut command = lab.command(&["fleet", "--from", from, "--serve", "127.0.0.1:0"]);
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.strip_prefix("http://").and_then(|rest| rest.split('/').next());
        let address = address.unwrap_or_else(|| panic!("an address: {line}")).to_owned();
        Self { child, address }
    }

    fn get(&self, path: &str) -> (u16, String) {
        let (status, body) = request(&self.address, "GET", path, &format!("Host: {}\r\n", self.address), "");
        (status, body.as_str().map_or_else(|| body.to_string(), str::to_owned))
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        let _over = self.child.kill();
        let _over = self.child.wait();
    }
}

/// A number between -1 and 1 that looks random and is the same each time.
fn noise(cell: usize, run: usize) -> f64 {
    ((cell * 7_919 + run * 104_729) % 1_000) as f64 / 500.0 - 1.0
}

/// A moment of 2026: a run every 1.5 days.
fn moment(run: usize) -> String {
    let day = run * 3 / 2;
    format!("2026-{:02}-{:02}T{:02}:00:00.000Z", 1 + day / 28, 1 + day % 28, 8 + run % 10)
}

fn compliance(cell: usize, run: usize) -> f64 {
    let own = if cell == SOFT { 9e-6 } else { COMPLIANCE };
    let odd = if cell == ODD && run == RUNS / 2 { 8e-7 } else { 0.0 };
    own * (1.0 + 0.01 * noise(cell, run)) + odd
}

/// The record of one cell, written as the program's tables have it, so that the triggers fill the outbox.
fn write_record(folder: &Path, cell: usize) {
    drop(Record::open(folder).unwrap());
    let mut file = rusqlite::Connection::open(folder.join("plumb.sqlite3")).unwrap();
    let all = file.transaction().unwrap();
    let name = format!("cell-{cell:02}");
    let arm = if cell < 15 { "ur5" } else { "scara" };
    for run in 0..RUNS {
        let (time, last) = (moment(run), run == RUNS - 1);
        let state = if last && cell == 3 {
            "running"
        } else if cell == 7 && last {
            "failed"
        } else {
            "passed"
        };
        let ended = (state != "running").then_some(&time);
        let message = match state {
            "running" => None,
            "failed" => Some("line A was not found"),
            _ => Some("all steps passed"),
        };
        all.execute(
            "INSERT INTO runs (cell, cell_file, procedure, procedure_file, title, operator, unattended, parameters, settings, program, started, ended, state, message) \
             VALUES (?1, ?1, 'initialize', '', 'Initialize', 'ada', 1, '{}', '{}', '0.1.0', ?2, ?3, ?4, ?5)",
            (&name, &time, ended, state, message),
        )
        .unwrap();
        let id = all.last_insert_rowid();
        all.execute("INSERT INTO steps (run, step, attempt, started, ended, outcome) VALUES (?1, 'level', 1, ?2, ?3, ?4)", (id, &time, ended, ended.map(|_| "passed"))).unwrap();
        let due = if cell == 9 { "2026-02-01" } else { "2099-01-01" };
        all.execute("INSERT INTO instruments (run, name, what, calibration_due) VALUES (?1, 'level', 'spirit level', ?2)", (id, due)).unwrap();
        all.execute(
            "INSERT INTO revisions (cell, device, made, reason) VALUES (?1, 'arm', ?2, '')",
            (&name, &time),
        )
        .unwrap();
        let revision = all.last_insert_rowid();
        all.execute(
            "INSERT INTO corrections (run, step, cell, device, quantity, place, old, new, uncertainty, unit, proposed, revision) \
             VALUES (?1, 'x', ?2, 'arm', 'joint_zero', 'pan', 0, ?3, 0.01, 'deg', ?4, ?5)",
            (id, &name, 1.0 + cell as f64 / 100.0 + 0.01 * noise(cell, run), &time, revision),
        )
        .unwrap();
        if run.is_multiple_of(RUNS_A_MODEL) {
            let value = compliance(cell, run);
            let content = format!(
                "arm: {arm}\neffects:\n  - {{effect: joint_compliance, where: lift, values: {{compliance: {value:e}}}}}\n"
            );
            all.execute(
                "INSERT INTO model_revisions (cell, device, run, made, note, sha256, content) VALUES (?1, 'arm', ?2, ?3, '', ?4, ?5)",
                (&name, id, &time, format!("{cell} {run}"), content),
            )
            .unwrap();
        }
        if state == "running" {
            let prompt = "{\"title\": \"Lay the target & fix it\"}";
            all.execute(
                "INSERT INTO prompts (run, step, asked, description) VALUES (?1, 'target', ?2, ?3)",
                (id, &time, prompt),
            )
            .unwrap();
        }
    }
    all.commit().unwrap();
}

/// A database with all records, and the folder of each.
pub(crate) fn fleet(lab: &Lab, server: &Server) -> Vec<PathBuf> {
    let folders: Vec<PathBuf> = (0..CELLS).map(|cell| lab.path(&format!("record-{cell}"))).collect();
    for (cell, folder) in folders.iter().enumerate() {
        write_record(folder, cell);
        let output =
            lab.plumb(&["ship", "--once", "--to", &server.address(), "--record", folder.to_str().unwrap()]);
        assert_eq!(output.code(), 0, "{}", output.all());
    }
    folders
}

fn asked(lab: &Lab, server: &Server, arguments: &[&str]) -> CommandOutput {
    let output = lab.plumb(&[&["fleet", "--from", &server.address()], arguments].concat());
    assert_eq!(output.code(), 0, "{}", output.all());
    output
}

#[test]
fn one_effect_over_twenty_cells_and_months_in_sql_in_the_terminal_and_on_the_page() {
    let Some(server) = Server::new() else { return };
    let lab = Lab::new();
    fleet(&lab, &server);
    assert_eq!(server.ask("SELECT count(*) FROM runs"), (CELLS * RUNS).to_string());

    // SQL: each mean is what was put in.
    let mut means = String::new();
    for cell in 0..CELLS {
        let values: Vec<f64> = (0..RUNS).step_by(RUNS_A_MODEL).map(|run| compliance(cell, run)).collect();
        let _ =
            writeln!(means, "cell-{cell:02} {:.5}", values.iter().sum::<f64>() / values.len() as f64 * 1e6);
    }
    let there = server.ask("SELECT string_agg(line, chr(10)) FROM (SELECT cell || ' ' || round((avg(value) * 1e6)::numeric, 5) AS line FROM effects \
                            WHERE effect = 'joint_compliance' AND place = 'lift' GROUP BY cell ORDER BY cell) x");
    assert_eq!(there, means.trim_end());
    assert_eq!(
        server.ask("SELECT min(made) AT TIME ZONE 'UTC' FROM effects"),
        "2026-01-01 08:00:00",
        "when models were written, not when they were shipped"
    );

    // The terminal: the soft arm is different from those of its kind, and the odd model is outside its cell's limits.
    let text = asked(&lab, &server, &["--effect", "joint_compliance(lift)", "--arm", "ur5"]).out();
    let marked =
        |mark: &str| text.lines().filter(|line| line.contains(mark)).map(str::to_owned).collect::<Vec<_>>();
    let different = marked("DIFFERENT");
    assert!(different.len() == 1 && different[0].contains("cell-13"), "{different:?}");
    let outside = marked("OUTSIDE");
    assert!(outside.len() == 1 && outside[0].contains("2026-06"), "{outside:?}");
    assert!(!text.contains("cell-15"), "a SCARA is no UR5");
    let lines = asked(&lab, &server, &["--effect", "joint_compliance(lift)", "--json"]).out();
    assert_eq!(lines.lines().count(), CELLS * RUNS / RUNS_A_MODEL);

    // The page says the same.
    let page = Page::start(&lab, &server.address());
    let begin = Instant::now();
    let (status, html) = page.get("/trend?effect=joint_compliance%28lift%29&arm=ur5");
    assert!(
        status == 200 && begin.elapsed() < Duration::from_secs(5),
        "{status} after {:?}",
        begin.elapsed()
    );
    assert_eq!(html.matches("number different").count(), 1, "{html}");
    assert_eq!(html.matches("dot outside").count(), 1);
    assert_eq!(html.matches("<svg").count(), 16, "fifteen cells, and all beside each other");
    for (path, code, expected) in [
        ("/trend?correction=arm.pan", 200, "joint zero"),
        ("/trends", 200, "joint_compliance(lift)"),
        ("/trend?correction=pan", 400, "is no correction"),
        ("/trend?effect=x(", 400, "is no effect"),
        ("/trend", 400, "/trends lists them"),
        ("/trend?effect=joint_gain(lift)", 200, "No cell has shipped a value of it"),
        ("/trend?effect=%3Cscript%3E", 200, "&lt;script&gt;"),
        ("/etc/passwd", 404, "the page is at /"),
    ] {
        let begin = Instant::now();
        let (status, html) = page.get(path);
        assert!(
            status == code && html.contains(expected) && !html.contains("<script>"),
            "{path}: {status} {}",
            html.len()
        );
        assert!(begin.elapsed() < Duration::from_secs(5), "{path}: {:?}", begin.elapsed());
    }
    let far = lab.plumb(&["fleet", "--from", &server.address(), "--serve", "0.0.0.0:0"]);
    assert!(far.code() == 2 && far.err().contains("is not encrypted"), "{}", far.all());
    let (status, _) = request(&page.address, "GET", "/", "Host: evil.example\r\n", "");
    assert_eq!(status, 421);
}

/// Rows of the outbox that a plan has gone through (PostgreSQL's `EXPLAIN (ANALYZE, FORMAT JSON)`).
fn rows_gone_through(plan: &Value) -> f64 {
    let number = |key: &str| plan[key].as_f64().unwrap_or(0.0);
    let own = match plan["Relation Name"].as_str() {
        Some("outbox") => (number("Actual Rows") + number("Rows Removed by Filter")) * number("Actual Loops"),
        _ => 0.0,
    };
    own + plan["Plans"].as_array().into_iter().flatten().map(rows_gone_through).sum::<f64>()
}

#[test]
fn the_list_of_cells_does_not_go_through_all_their_runs() {
    let Some(server) = Server::new() else { return };
    let lab = Lab::new();
    fleet(&lab, &server);
    server.ask("ANALYZE");
    let plan: Value =
        serde_json::from_str(&server.ask("EXPLAIN (ANALYZE, FORMAT JSON) SELECT * FROM cells")).unwrap();
    let rows = rows_gone_through(&plan[0]["Plan"]);
    // A cell's last run, step, prompt and instrument, and its models for its arm.
    let most = (10 + RUNS / RUNS_A_MODEL) as f64;
    assert!(rows > 0.0 && rows / CELLS as f64 <= most, "{rows} rows for {CELLS} cells with {RUNS} runs each");
    assert_eq!(
        server.ask("SELECT max(ended) FROM runs WHERE state = 'passed' AND cell = 'cell-07'"),
        server.ask("SELECT last_passed FROM cells WHERE cell = 'cell-07'"),
    );
}

#[test]
fn the_fleets_page_is_read_on_a_desk_and_on_a_telephone_with_the_keyboard_alone() {
    let Some(browser) = Browser::start() else { return };
    let Some(mut server) = Server::new() else { return };
    let lab = Lab::new();
    fleet(&lab, &server);
    // As with a shipper beside each cell, but for one that has gone.
    server.ask("UPDATE records SET last_seen = now() + CASE WHEN directory LIKE '%-11' THEN interval '-2 hours' ELSE interval '1 hour' END");
    let page = Page::start(&lab, &server.address());
    let begin = Instant::now();
    let (status, html) = page.get("/");
    assert!(status == 200 && begin.elapsed() < Duration::from_secs(3), "{:?}", begin.elapsed());
    assert!(html.find("cell-03").unwrap() < html.find("cell-00").unwrap(), "who waits comes first");
    assert!(
        html.contains("Lay the target &amp; fix it")
            && html.contains("20 cells; 1 waits for an answer, 1 is silent"),
        "{html}"
    );
    assert!(html.contains("class=\"over\">2026-02-01 (level)"), "{html}");

    let pictures = std::env::var_os("PLUMB_PICTURES");
    let shot = |name: &str| {
        if let Some(folder) = &pictures {
            browser.picture(&Path::new(folder).join(format!("fleet-{name}.png")));
        }
    };
    for (path, name, expected) in
        [("", "cells", "cell-19"), ("trend?effect=joint_compliance(lift)&arm=ur5", "trend", "control limits")]
    {
        browser.open(&format!("http://{}/{path}", page.address));
        for (width, height, size) in [(390, 844, "phone"), (1280, 900, "desk")] {
            browser.resize(width, height);
            wait_until(expected, Duration::from_secs(20), || browser.text().contains(expected));
            let wider = browser.run("return document.documentElement.scrollWidth > window.innerWidth");
            assert_eq!(wider, Value::Bool(false), "{path}: nothing is cut off at {width} pixels");
            shot(&format!("{name}-{size}"));
            browser
                .run("const charts = document.querySelector('.charts'); if (charts) charts.scrollIntoView()");
            shot(&format!("{name}-{size}-below"));
            browser.run("scrollTo(0, 0)");
        }
    }
    // From row to row by keys, and the row stays chosen while the page renews itself.
    browser.open(&format!("http://{}/", page.address));
    wait_until("the page is live", Duration::from_secs(20), || browser.text().contains("live"));
    browser.keys("jj");
    let chosen = || browser.run("return document.activeElement.id").as_str().unwrap_or_default().to_owned();
    assert!(chosen().ends_with("-cell-00"), "{}", chosen());
    server.ask("UPDATE records SET last_seen = now()");
    std::thread::sleep(Duration::from_secs(5));
    assert!(chosen().ends_with("-cell-00"), "{}", chosen());
    assert_eq!(browser.complaints(), Vec::<String>::new());

    // The database goes and comes back: the page says so, and goes on by itself.
    server.kill();
    wait_until("the page says so", Duration::from_secs(30), || {
        browser.text().contains("The database does not answer")
    });
    server.start();
    wait_until("the page is back", Duration::from_secs(30), || browser.text().contains("20 cells"));
}
