//! The page of a cell: what is served, who may answer, and that nobody who reads it touches the run.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

use plumb_record::{LoadedFile, NewRun, Record, RunEnd};
use serde_json::{Value, json};

use crate::browser::Browser;
use crate::http::request;
use crate::lab::{Lab, Running};
use crate::wait_until;

/// Readers at once in the test of many.
const MANY: usize = 1_000;

/// `plumb serve` on a port that the system chooses.
struct Page {
    child: Child,
    address: String,
}

impl Page {
    fn start(lab: &Lab, arguments: &[&str]) -> Self {
        let mut command = lab.command(&["serve", "--listen", "127.0.0.1:0"]);
        let mut child = command.args(arguments).stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.strip_prefix("http://").and_then(|rest| rest.split('/').next());
        let address = address.unwrap_or_else(|| panic!("an address: {line}")).to_owned();
        Self { child, address }
    }

    fn connect(&self) -> TcpStream {
        TcpStream::connect(&self.address).unwrap()
    }

    /// Status and body of a request.
    fn ask(&self, method: &str, path: &str, token: &str, body: &str) -> (u16, Value) {
        self.ask_as(&self.address, method, path, token, body)
    }

    fn ask_as(&self, host: &str, method: &str, path: &str, token: &str, body: &str) -> (u16, Value) {
        let headers = format!("Host: {host}\r\nAuthorization: Bearer {token}\r\n");
        request(&self.address, method, path, &headers, body)
    }

    fn state(&self) -> Value {
        self.ask("GET", "/api/state", "", "").1
    }

    /// The prompt that is open, once it is one of this step.
    fn prompt_of(&self, step: &str) -> Value {
        let mut prompt = Value::Null;
        wait_until(step, Duration::from_secs(30), || {
            prompt = self.state()["cells"][0]["prompt"].clone();
            prompt["step"] == step
        });
        prompt
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        let _over = self.child.kill();
        let _over = self.child.wait();
    }
}

fn new_token(lab: &Lab) -> (String, String) {
    let path = lab.path("token").display().to_string();
    let made = lab.plumb(&["serve", "--new-token", &path]);
    assert_eq!(made.code(), 0, "{}", made.all());
    let text = std::fs::read_to_string(&path).unwrap().trim().to_owned();
    (path, text)
}

fn attended_run(lab: &Lab) -> Running {
    let mut running = lab.start(&["run", "cell.yaml", "--attended", "--pace", "fast"]);
    running.until(|event| event["event"] == "prompt_asked");
    running
}

fn answer(lease: &str, prompt: &Value, text: &str) -> String {
    json!({ "lease": lease, "run": 1, "prompt": prompt["id"], "answer": text }).to_string()
}

#[test]
fn a_prompt_is_answered_from_the_page_by_one_holder_at_a_time() {
    let lab = Lab::new();
    let (file, token) = new_token(&lab);
    let page = Page::start(&lab, &["--token-file", &file]);
    let running = attended_run(&lab);
    let prompt = page.prompt_of("target");
    assert_eq!(prompt["title"], "Lay the target");

    let (status, output) =
        page.ask("POST", "/api/lease", "0123456789abcdef0123456789abcdef", r#"{"name": "eve"}"#);
    assert_eq!((status, &output["error"]), (401, &json!("the token is wrong or missing")));
    let (status, ada) = page.ask("POST", "/api/lease", &token, r#"{"name": "ada"}"#);
    assert_eq!(status, 200, "{ada}");
    let lease = ada["lease"].as_str().unwrap();
    let (status, output) = page.ask("POST", "/api/lease", &token, r#"{"name": "bob"}"#);
    assert!(
        status == 409 && output["error"].as_str().unwrap().starts_with("ada holds the lease"),
        "{output}"
    );
    let (status, output) = page.ask("POST", "/api/answer", &token, &answer("stolen", &prompt, "done"));
    assert!(status == 409 && output["error"].as_str().unwrap().contains("not valid"), "{output}");

    let (status, output) = page.ask("POST", "/api/answer", &token, &answer(lease, &prompt, "perhaps"));
    assert!(status == 422 && output["error"].as_str().unwrap().contains("write done"), "{output}");
    let (status, output) = page.ask("POST", "/api/answer", &token, &answer(lease, &prompt, "done"));
    assert_eq!((status, output), (200, json!({ "taken": true })));
    // The same request again: its prompt is over, and the next one does not get the answer.
    page.prompt_of("hand");
    let (status, output) = page.ask("POST", "/api/answer", &token, &answer(lease, &prompt, "done"));
    assert!(status == 409 && output["error"].as_str().unwrap().contains("answered already"), "{output}");

    let hand = page.prompt_of("hand");
    assert_eq!(page.ask("POST", "/api/answer", &token, &answer(lease, &hand, "done")).0, 200);
    let level = page.prompt_of("level");
    assert_eq!(page.ask("POST", "/api/answer", &token, &answer(lease, &level, "0.2")).0, 200);
    // What moves the arm is answered at the arm.
    let placing = page.prompt_of("place");
    assert!(placing["only_at_the_arm"].is_string(), "{placing}");
    let (status, output) = page.ask("POST", "/api/answer", &token, &answer(lease, &placing, "waist=20"));
    assert!(status == 403 && output["error"].as_str().unwrap().contains("where the arm is seen"), "{output}");

    let shown = lab.shown("1");
    assert_eq!(shown["prompts"][0]["answer"]["by"], "ada");
    let refusals = shown["log"].to_string();
    assert!(refusals.contains("an answer of ada from the page was not taken"), "{refusals}");
    running.signal(nix::sys::signal::Signal::SIGTERM);
    running.end();
}

#[test]
fn a_lease_that_has_run_out_answers_nothing_and_another_may_take_it() {
    let lab = Lab::new();
    let (file, token) = new_token(&lab);
    let page = Page::start(&lab, &["--token-file", &file]);
    let running = attended_run(&lab);
    let prompt = page.prompt_of("target");
    let (_, ada) = page.ask("POST", "/api/lease", &token, r#"{"name": "ada"}"#);
    let lease = ada["lease"].as_str().unwrap();
    // Her page is closed: the lease holds for half a minute.
    wait_until("the lease runs out", Duration::from_secs(45), || {
        page.ask("POST", "/api/lease", &token, r#"{"name": "bob"}"#).0 == 200
    });
    let (status, output) = page.ask("POST", "/api/answer", &token, &answer(lease, &prompt, "done"));
    assert!(status == 409 && output["error"].as_str().unwrap().contains("no longer"), "{status} {output}");
    assert_eq!(page.prompt_of("target")["id"], prompt["id"], "the prompt still waits");
    running.signal(nix::sys::signal::Signal::SIGTERM);
    running.end();
}

#[test]
fn of_two_answers_at_once_one_wins_and_both_are_answered() {
    let lab = Lab::new();
    let (file, token) = new_token(&lab);
    let page = Page::start(&lab, &["--token-file", &file]);
    let running = attended_run(&lab);
    let (_, ada) = page.ask("POST", "/api/lease", &token, r#"{"name": "ada"}"#);
    let lease = ada["lease"].as_str().unwrap();
    for step in ["target", "hand"] {
        let prompt = page.prompt_of(step);
        assert_eq!(page.ask("POST", "/api/answer", &token, &answer(lease, &prompt, "done")).0, 200, "{step}");
    }
    // Two readings of one level: they cannot both be the answer.
    let level = page.prompt_of("level");
    let bodies = [answer(lease, &level, "0.1"), answer(lease, &level, "0.2")];
    let mut replies = std::thread::scope(|scope| {
        let asked: Vec<_> =
            bodies.iter().map(|body| scope.spawn(|| page.ask("POST", "/api/answer", &token, body))).collect();
        asked.into_iter().map(|one| one.join().unwrap()).collect::<Vec<_>>()
    });
    replies.sort_by_key(|(status, _)| *status);
    assert_eq!((replies[0].0, replies[1].0), (200, 409), "{replies:?}");
    let reason = replies[1].1["error"].as_str().unwrap();
    assert!(reason.contains("answered already"), "{reason}");
    let answered = page.prompt_of("place");
    assert!(answered["id"].as_i64() > level["id"].as_i64());
    running.signal(nix::sys::signal::Signal::SIGTERM);
    running.end();
}

#[test]
fn a_thousand_readers_and_a_slow_one_do_not_touch_the_run() {
    let lab = Lab::new();
    let page = Page::start(&lab, &[]);
    let mut readers = Vec::new();
    for _ in 0..MANY {
        let mut stream = page.connect();
        write!(stream, "GET /api/events HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
        readers.push(stream);
    }
    // None of them ever reads; and one does not even finish its request.
    let mut half = page.connect();
    write!(half, "GET /api/state HTTP/1.1\r\nHo").unwrap();
    let passed = lab.plumb(&["run", "cell.yaml", "--headless", "--pace", "fast"]);
    assert_eq!(passed.code(), 0, "{}", passed.all());
    lab.assert_zeros_found("1");
    wait_until("the page has seen the end", Duration::from_secs(10), || {
        page.state()["cells"][0]["state"] == "passed"
    });
    let mut first = [0_u8; 4096];
    let read = readers[0].read(&mut first).unwrap();
    assert!(String::from_utf8_lossy(&first[..read]).starts_with("HTTP/1.1 200"), "the readers were served");
}

#[test]
fn what_is_asked_wrongly_is_refused() {
    let lab = Lab::new();
    let page = Page::start(&lab, &[]);
    let refused = |(status, output): (u16, Value), code: u16, expected: &str| {
        assert!(status == code && output.to_string().contains(expected), "{status} {output}");
    };
    refused(page.ask("POST", "/api/lease", "x", r#"{"name": "ada"}"#), 403, "read only");
    refused(page.ask("POST", "/api/answer", "x", "{}"), 422, "");
    refused(page.ask("POST", "/api/lease", "x", &"x".repeat(100_000)), 413, "");
    refused(page.ask("GET", "/etc/passwd", "", ""), 404, "the page is at /");
    refused(page.ask_as("evil.example", "GET", "/api/state", "", ""), 421, "not a name of this server");
    let far = lab.plumb(&["serve", "--listen", "0.0.0.0:0"]);
    assert_eq!(far.code(), 2);
    assert!(far.err().contains("is not encrypted") && far.err().contains("ssh -L"), "{}", far.err());
    let none = lab.plumb(&["serve", "--token-file", "nothing-here"]);
    assert!(none.code() == 2 && none.err().contains("--new-token"), "{}", none.err());
}

/// A real browser at the size of a telephone and of a desk: the page is laid out, its script makes no error, it asks nothing of
/// any other machine, and a prompt is answered with the keyboard alone.
#[test]
fn a_prompt_is_answered_in_a_browser_with_the_keyboard_alone() {
    let Some(browser) = Browser::start() else { return };
    let lab = Lab::new();
    let (file, token) = new_token(&lab);
    let page = Page::start(&lab, &["--token-file", &file]);
    let running = attended_run(&lab);
    page.prompt_of("target");
    browser.open(&format!("http://{}/", page.address));
    for (width, height) in [(390, 844), (1280, 900)] {
        browser.resize(width, height);
        wait_until("the prompt is shown", Duration::from_secs(20), || {
            browser.text().contains("Lay the target")
        });
        assert!(browser.text().contains("live"), "{}", browser.text());
        let wider = browser.run("return document.documentElement.scrollWidth > window.innerWidth");
        assert_eq!(wider, Value::Bool(false), "nothing is cut off at {width} pixels");
        // The drawing of the T keeps its columns: all its letters have one width.
        let drawing = browser.run("const drawing = document.querySelector('.prompt pre'); return drawing && getComputedStyle(drawing).fontFamily + drawing.textContent");
        let drawing = drawing.as_str().unwrap_or_default();
        assert!(drawing.starts_with("monospace") && drawing.contains("line B  ------"), "{drawing}");
        assert!(!drawing.contains("Lay the T target"), "sentences are no drawing: {drawing}");
        if let Some(pictures) = std::env::var_os("PLUMB_PICTURES") {
            browser.picture(&Path::new(&pictures).join(format!("serve-{width}.png")));
        }
    }
    // Tab from the top: first the list of steps, then name, token, and the button.
    browser.run("document.getElementById('name').focus()");
    browser.keys("ada\u{e004}");
    browser.keys(&format!("{token}\u{e007}"));
    wait_until("the lease is taken", Duration::from_secs(20), || {
        browser.text().contains("ada may answer now")
    });
    browser.run("document.querySelector('.prompt button').focus()");
    browser.keys(" ");
    wait_until("the next prompt is shown", Duration::from_secs(20), || {
        page.state()["cells"][0]["prompt"]["step"] == "hand"
    });
    assert_eq!(lab.shown("1")["prompts"][0]["answer"]["by"], "ada");
    assert_eq!(browser.complaints(), Vec::<String>::new());
    running.signal(nix::sys::signal::Signal::SIGTERM);
    running.end();
}

/// A run whose arm's model was worked on, and which has scanned something: both are seen on its page, drawn by the server.
#[test]
fn the_fall_of_the_error_and_the_clouds_of_a_run_are_on_its_page() {
    let lab = Lab::new();
    let made = lab.plumb(&[
        "trial",
        "new",
        "--seed",
        "3",
        "--arm",
        "puma560",
        "--effect",
        "joint_compliance(shoulder)=5x",
        "-o",
        "trial",
    ]);
    assert_eq!(made.code(), 0, "{}", made.all());
    let model = lab.path("trial/model.yaml").display().to_string();
    for effect in ["joint_compliance(shoulder)", "joint_backlash(elbow)"] {
        let added = lab.plumb(&["model", "add", &model, effect, "--yes", "--data", "trial/table.csv"]);
        assert_eq!(added.code(), 0, "{}", added.all());
    }
    let mut record = Record::open(&lab.state()).unwrap();
    let loaded = vec![LoadedFile { role: "model".into(), path: model, sha256: String::new(), content: None }];
    let run = record
        .start_run(&NewRun { cell: "puma".into(), title: "Scan a bar".into(), loaded, ..NewRun::default() })
        .unwrap();
    record.end_run(run, RunEnd::Passed, "all steps passed").unwrap();
    let folder = lab.state().join("run-1");
    std::fs::create_dir(&folder).unwrap();
    let points: String =
        (0..400).map(|at| format!("{} {} {}\n", at % 20, at / 20, (at % 20) * (at / 20) / 40)).collect();
    let head = "ply\nformat ascii 1.0\nelement vertex 400\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    std::fs::write(folder.join("bar.ply"), format!("{head}{points}")).unwrap();
    std::fs::write(folder.join("broken.ply"), "ply\nformat ascii 1.0\n").unwrap();
    std::fs::write(lab.state().join("secret.ply"), format!("{head}{points}")).unwrap();

    let page = Page::start(&lab, &[]);
    let list = page.ask("GET", "/api/drawings?run=1", "", "").1;
    assert_eq!(
        list,
        json!({ "models": [{ "model": 0, "name": "model.yaml" }], "clouds": ["bar.ply", "broken.ply"] })
    );
    let (status, svg) = page.ask("GET", "/api/fall.svg?run=1&model=0", "", "");
    let svg = svg.as_str().unwrap();
    assert!(
        status == 200 && svg.contains("joint_compliance(shoulder)") && svg.matches(" mm</text>").count() == 2,
        "{svg}"
    );
    for (path, expected) in [
        ("/api/cloud.png?run=1&name=../secret.ply", "has no such picture"),
        ("/api/cloud.png?run=1&name=broken.ply", "cannot be drawn"),
        ("/api/fall.svg?run=1&model=7", "has no such picture"),
        ("/api/drawings?run=9", "there is no run 9"),
        ("/api/drawings", "say which run"),
    ] {
        let (status, output) = page.ask("GET", path, "", "");
        assert!(
            (400..500).contains(&status) && output.to_string().contains(expected),
            "{path}: {status} {output}"
        );
    }
    let Some(browser) = Browser::start() else { return };
    browser.open(&format!("http://{}/", page.address));
    let seen = "return [...document.images].filter((image) => image.complete && image.naturalWidth > 0).map((image) => image.alt)";
    wait_until("both pictures are seen", Duration::from_secs(30), || {
        browser.run("document.images.length && document.images[document.images.length - 1].scrollIntoView()");
        let seen = browser.run(seen);
        seen.to_string().contains("model.yaml") && seen.to_string().contains("bar.ply")
    });
    wait_until("what is wrong with the third is said", Duration::from_secs(30), || {
        browser.text().contains("It cannot be drawn.")
    });
    if let Some(pictures) = std::env::var_os("PLUMB_PICTURES") {
        browser.resize(1280, 1400);
        browser.picture(&Path::new(&pictures).join("serve-pictures.png"));
    }
}
