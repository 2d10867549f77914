//! People are informed when a cell needs them: by a real HTTP server that works, fails, hangs or refuses, and by a mailer; and no run waits for it.

use std::io::Read as _;
use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;

use crate::certificates::Authority;
use crate::lab::{CommandOutput, Lab, Running, kill};
use crate::receiver::{Behaviour, Receiver};
use crate::wait_until;

/// A mailer that keeps what it is given.
const MAILER: &str = "#!/bin/sh\n{ echo \"$@\"; cat; echo ------; } >> \"$(dirname \"$0\")/mails\"\n";

fn mailer(lab: &Lab, name: &str, text: &str) -> PathBuf {
    lab.write(name, text);
    std::fs::set_permissions(lab.path(name), std::fs::Permissions::from_mode(0o755)).unwrap();
    lab.path(name)
}

fn mails(lab: &Lab) -> String {
    std::fs::read_to_string(lab.path("mails")).unwrap_or_default()
}

fn waiting_run(lab: &Lab) -> Running {
    let mut running = lab.start(&["run", "cell.yaml", "--attended", "--pace", "fast"]);
    running.until(|event| event["event"] == "prompt_asked");
    running
}

fn end(running: Running) {
    running.signal(Signal::SIGTERM);
    running.end();
}

/// `plumb alert` that goes on.
struct Alert(Child);

impl Alert {
    fn start(lab: &Lab, arguments: &[&str]) -> Self {
        let mut command = lab.command(&[&["alert", "--prompt-after", "0s"], arguments].concat());
        Self(command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap())
    }

    /// Kills it with -9; what it had complained of.
    fn kill(mut self) -> String {
        kill(self.0.id());
        let mut text = String::new();
        self.0.stderr.take().unwrap().read_to_string(&mut text).unwrap();
        self.0.wait().unwrap();
        text
    }
}

impl Drop for Alert {
    fn drop(&mut self) {
        let _over = self.0.kill();
        let _over = self.0.wait();
    }
}

fn once(lab: &Lab, arguments: &[&str]) -> CommandOutput {
    lab.plumb(&[&["alert", "--once", "--prompt-after", "0s"], arguments].concat())
}

#[test]
fn a_prompt_that_waits_is_reported_by_webhook_and_e_mail_once_although_the_program_is_killed() {
    let lab = Lab::new();
    let receiver = Receiver::new(Behaviour::Answers(200));
    let sendmail = mailer(&lab, "mailer", MAILER).display().to_string();
    let ways = [
        "--webhook",
        &receiver.address(),
        "--mail",
        "ada@lab.example",
        "--mail",
        "bob",
        "--sendmail",
        &sendmail,
    ];
    let running = waiting_run(&lab);
    let patient = lab.plumb(&[&["alert", "--once", "--prompt-after", "1h"], &ways[..]].concat());
    assert_eq!(patient.code(), 0, "{}", patient.all());
    assert_eq!(receiver.requests().len(), 0, "it has not waited for an hour");
    for _ in 0..3 {
        let alert = Alert::start(&lab, &ways);
        wait_until("it is reported", Duration::from_secs(20), || mails(&lab).contains("------"));
        std::thread::sleep(Duration::from_millis(1_500));
        assert_eq!(alert.kill(), "");
    }
    let messages = receiver.messages();
    assert_eq!(messages.len(), 1, "{messages:?}");
    let text = messages[0]["text"].as_str().unwrap();
    assert!(
        text.starts_with("teachmover: `Lay the target` has waited for an answer for ")
            && text.ends_with("(run 1)"),
        "{text}"
    );
    assert_eq!((&messages[0]["kind"], &messages[0]["run"]), (&"prompt_waits".into(), &1.into()));
    let mails = mails(&lab);
    assert!(
        mails.starts_with(
            "-i -- ada@lab.example bob\nTo: ada@lab.example, bob\nSubject: [plumb] teachmover: `Lay"
        ),
        "{mails}"
    );
    assert_eq!(mails.matches("------").count(), 1, "{mails}");
    // The next prompt is reported anew.
    assert_eq!(lab.plumb(&["answer", "done"]).code(), 0);
    wait_until("the next prompt", Duration::from_secs(20), || {
        lab.plumb(&["answer"]).out().contains("at hand")
    });
    assert_eq!(once(&lab, &ways).code(), 0);
    assert_eq!(receiver.messages().len(), 2);
    end(running);
}

#[test]
fn a_webhook_that_hangs_holds_up_neither_the_run_nor_the_e_mail() {
    let lab = Lab::new();
    let receiver = Receiver::new(Behaviour::Hangs);
    let sendmail = mailer(&lab, "mailer", MAILER).display().to_string();
    let running = waiting_run(&lab);
    let alert = Alert::start(
        &lab,
        &["--webhook", &receiver.address(), "--mail", "ada@lab.example", "--sendmail", &sendmail],
    );
    wait_until("the webhook is asked", Duration::from_secs(20), || !receiver.requests().is_empty());
    let begin = Instant::now();
    assert_eq!(lab.plumb(&["answer", "--prompt", "target", "done"]).code(), 0);
    wait_until("the run goes on", Duration::from_secs(3), || {
        lab.plumb(&["answer"]).out().contains("at hand")
    });
    assert!(begin.elapsed() < Duration::from_secs(5), "{:?}: while the webhook still hangs", begin.elapsed());
    wait_until("the e-mail goes out", Duration::from_secs(30), || mails(&lab).contains("------"));
    let output = alert.kill();
    assert!(
        output.contains("webhook at localhost: no answer within 10 s; trying again every 30 s"),
        "{output}"
    );
    assert!(!output.contains("secret"), "the address is not reported: {output}");
    end(running);
}

#[test]
fn a_server_that_fails_is_asked_again_and_one_that_refuses_is_not() {
    let lab = Lab::new();
    let running = waiting_run(&lab);
    for (behaviour, expected) in [
        (Behaviour::Answers(500), "it answers 500; trying again"),
        (Behaviour::Answers(429), "it answers 429; trying again"),
        (Behaviour::IsNoHttp, "no HTTP; trying again"),
    ] {
        let receiver = Receiver::new(behaviour);
        let failed = once(&lab, &["--webhook", &receiver.address()]);
        assert!(failed.code() == 1 && failed.err().contains(expected), "{behaviour:?}: {}", failed.all());
        receiver.behave(Behaviour::Answers(200));
        let arrived = once(&lab, &["--webhook", &receiver.address()]);
        assert_eq!((arrived.code(), receiver.requests().len()), (0, 2), "{behaviour:?}: {}", arrived.all());
    }
    for (status, expected) in
        [(404, "there is no such webhook"), (302, "leads elsewhere"), (401, "does not let this program in")]
    {
        let receiver = Receiver::new(Behaviour::Answers(status));
        let refused = once(&lab, &["--webhook", &receiver.address()]);
        assert!(
            refused.code() == 1
                && refused.err().contains(expected)
                && refused.err().contains("not tried again"),
            "{}",
            refused.all()
        );
        once(&lab, &["--webhook", &receiver.address()]);
        assert_eq!(receiver.requests().len(), 1, "{status}");
    }
    let trickles = Receiver::new(Behaviour::Trickles);
    let begin = Instant::now();
    let slow = once(&lab, &["--webhook", &trickles.address()]);
    assert!(slow.code() == 1 && slow.err().contains("no answer within 10 s"), "{}", slow.all());
    assert!(begin.elapsed() < Duration::from_secs(20), "a byte a second is no answer: {:?}", begin.elapsed());
    let closed = once(&lab, &["--webhook", "http://127.0.0.1:9/hook"]);
    assert!(closed.code() == 1 && closed.err().contains("it cannot be reached"), "{}", closed.all());
    end(running);
}

#[test]
fn a_step_that_hangs_and_a_run_whose_program_has_gone_are_reported() {
    let lab = Lab::new();
    let receiver = Receiver::new(Behaviour::Answers(204));
    let address = receiver.address();
    let mut running = lab.start(&["run", "cell.yaml", "--headless"]);
    running.until(|event| event["event"] == "step_started" && event["step"] == "waist.lower");
    running.signal(Signal::SIGSTOP);
    let late = |after: &str| {
        let printed = lab.plumb(&["alert", "--once", "--webhook", &address, "--step-after", after]);
        assert_eq!(printed.code(), 0, "{}", printed.all());
        receiver.messages().last().map(|message| message["text"].as_str().unwrap().to_owned())
    };
    assert_eq!(late("1h"), None);
    wait_until("the step is late", Duration::from_secs(60), || late("2s").is_some());
    let text = late("2s").unwrap();
    assert!(
        text.contains("step waist.lower of run 1 has taken") && text.ends_with("longer than planned"),
        "{text}"
    );
    assert_eq!(receiver.requests().len(), 1);
    kill(running.process());
    running.end();
    let text = late("1h").unwrap();
    assert!(text.contains("the program that ran run 1 has gone; `plumb run --resume 1`"), "{text}");

    // How runs end is reported where that is asked for.
    lab.write(
        "few.yaml",
        &std::fs::read_to_string(lab.path("answers.yaml")).unwrap().replace("level: offered", "level: 1.5"),
    );
    let failed = lab.plumb(&["run", "cell.yaml", "--headless", "--answers", "few.yaml"]);
    assert_eq!(failed.code(), 1, "{}", failed.all());
    let before = receiver.requests().len();
    late("1h");
    assert_eq!(receiver.requests().len(), before);
    let printed = lab.plumb(&["alert", "--once", "--webhook", &address, "--ended"]);
    assert_eq!(printed.code(), 0, "{}", printed.all());
    let last = receiver.messages().last().unwrap()["text"].as_str().unwrap().to_owned();
    assert!(last.contains("run 2 has ended: failed, "), "{last}");
}

#[test]
fn a_webhook_is_reached_by_tls_whose_certificate_this_machine_trusts_for_that_name() {
    let Some(authority) = Authority::new() else { return };
    let other = Authority::new().unwrap();
    let lab = Lab::new();
    let right = Receiver::with_tls(&authority.certify("localhost"));
    let wrong_name = Receiver::with_tls(&authority.certify("chat.lab.example"));
    let send = |receiver: &Receiver, trusted: &Authority| {
        let mut command = lab.command(&["alert", "--test"]);
        // As a secret comes: in the environment.
        command
            .env("PLUMB_WEBHOOK", receiver.address())
            .env("SSL_CERT_FILE", trusted.certificate())
            .env_remove("SSL_CERT_DIR");
        CommandOutput::of(command.output().unwrap())
    };
    let arrived = send(&right, &authority);
    assert_eq!(arrived.code(), 0, "{}", arrived.all());
    assert!(arrived.out().contains("webhook at localhost: delivered"), "{}", arrived.out());
    assert_eq!(right.messages()[0]["kind"], "test");
    for (receiver, trusted, expected) in
        [(&right, &other, "UnknownIssuer"), (&wrong_name, &authority, "not valid for name")]
    {
        let refused = send(receiver, trusted);
        assert!(refused.code() == 1 && refused.err().contains(expected), "{expected}: {}", refused.all());
    }
    assert_eq!(right.requests().len() + wrong_name.requests().len(), 1, "nothing was sent to a stranger");
}

#[test]
fn what_cannot_be_reported_says_why() {
    let lab = Lab::new();
    for (arguments, expected) in [
        (&[][..], "nobody to call: give --mail ADDRESS"),
        (&["--webhook", "http://chat.lab.example/hook"], "in plain text: give an https address"),
        (&["--webhook", "chat"], "a webhook looks like https://HOST/PATH"),
        (&["--mail=-t"], "is no e-mail address"),
        (&["--mail", "a@b c@d"], "is no e-mail address"),
        (&["--mail", "ada", "--prompt-after", "5"], "write a time with its unit"),
        (&["--mail", "ada", "--once"], "there is no record in"),
    ] {
        let printed = lab.plumb(&[&["alert"], arguments].concat());
        assert!(printed.code() == 2 && printed.err().contains(expected), "{arguments:?}: {}", printed.all());
    }
    let none = lab.plumb(&["alert", "--mail", "ada", "--sendmail", "/nowhere/sendmail", "--test"]);
    assert!(none.code() == 1 && none.err().contains("install one"), "{}", none.all());
    let sendmail =
        mailer(&lab, "refuses", "#!/bin/sh\necho 'no such user' >&2\nexit 67\n").display().to_string();
    let refused = lab.plumb(&["alert", "--mail", "ada", "--sendmail", &sendmail, "--test"]);
    assert!(refused.code() == 1 && refused.err().contains("no such user"), "{}", refused.all());
    let sendmail = mailer(&lab, "hangs", "#!/bin/sh\nexec sleep 60\n").display().to_string();
    let begin = Instant::now();
    let slow = lab.plumb(&["alert", "--mail", "ada", "--sendmail", &sendmail, "--test"]);
    assert!(slow.code() == 1 && slow.err().contains("took longer than 10 s"), "{}", slow.all());
    assert!(begin.elapsed() < Duration::from_secs(30));
}
