//! TLS between a cell and the database, what `plumb doctor` says of a database, and an outbox that is trimmed.

use plumb_record::Record;

use crate::certificates::Authority;
use crate::lab::Lab;
use crate::server::Server;
use crate::{both_sides, write_run};

#[test]
fn rows_go_to_a_server_whose_certificate_and_name_are_right_and_to_no_other() {
    let Some(authority) = Authority::new() else { return };
    let Some(server) = Server::with_tls(&authority.certify("localhost")) else { return };
    let named_otherwise = Server::with_tls(&authority.certify("db.lab.example")).unwrap();
    let other = Authority::new().unwrap();
    let lab = Lab::new();
    write_run(&lab.state(), 3);
    let trusting = |authority: &Authority, mode: &str| {
        format!("sslmode={mode}&sslrootcert={}", authority.certificate().display())
    };
    let ship = |server: &Server, options: &str| {
        lab.plumb(&["ship", "--once", "--to", &server.address_by_port(options)])
    };
    let has_tables = |server: &Server| server.ask("SELECT to_regclass('outbox') IS NOT NULL") == "t";

    for (server, options, expected) in [
        (&server, trusting(&other, "verify-full"), "UnknownIssuer"),
        (&server, trusting(&other, "verify-ca"), "UnknownIssuer"),
        (&named_otherwise, trusting(&authority, "verify-full"), "not valid for name"),
        (&server, "sslmode=verify-full&sslrootcert=/nowhere/ca.pem".to_owned(), "No such file"),
    ] {
        let refused = ship(server, &options);
        assert!(refused.code() == 2 && refused.err().contains(expected), "{options}: {}", refused.all());
        assert!(!has_tables(server), "nothing was sent");
        let doctor = lab.plumb(&["doctor", "--database", &server.address_by_port(&options)]);
        assert!(doctor.code() == 1 && doctor.out().contains("database       WRONG"), "{}", doctor.out());
    }
    let sent = ship(&server, &trusting(&authority, "verify-full"));
    assert_eq!(sent.code(), 0, "{}", sent.all());
    assert_eq!(both_sides(&lab, &server).0, both_sides(&lab, &server).1);
    let doctor =
        lab.plumb(&["doctor", "--database", &server.address_by_port(&trusting(&authority, "verify-full"))]);
    assert!(doctor.out().contains("TLSv1.3; its certificate and its name are checked"), "{}", doctor.out());
    // The authority alone is looked at where only that is asked for, and the doctor says so.
    assert_eq!(ship(&named_otherwise, &trusting(&authority, "verify-ca")).code(), 0);
    let doctor = lab.plumb(&["doctor", "--database", &named_otherwise.address_by_port("sslmode=require")]);
    assert!(doctor.out().contains("nobody checks that it is the right server"), "{}", doctor.out());
    let authority_alone = named_otherwise.address_by_port(&trusting(&authority, "verify-ca"));
    let doctor = lab.plumb(&["doctor", "--database", &authority_alone]);
    assert!(doctor.out().contains("nobody checks that its certificate is of that name"), "{}", doctor.out());
}

#[test]
fn a_server_without_tls_gets_nothing_where_tls_was_asked_for() {
    let Some(server) = Server::on_a_port() else { return };
    let lab = Lab::new();
    write_run(&lab.state(), 3);
    let address = server.address_by_port("sslmode=require");
    let refused = lab.plumb(&["ship", "--once", "--to", &address]);
    assert!(refused.code() == 2 && refused.err().contains("does not support TLS"), "{}", refused.all());
    let doctor = lab.plumb(&["doctor", "--database", &address]);
    assert!(doctor.code() == 1 && doctor.out().contains("set ssl = on"), "{}", doctor.out());
}

#[test]
fn the_doctor_looks_at_a_database_and_changes_nothing() {
    let Some(mut server) = Server::new() else { return };
    let (lab, address) = (Lab::new(), server.address());
    let doctor = |address: &str| lab.plumb(&["doctor", "--database", address]);
    let first = doctor(&address);
    for expected in [
        "database       good   PostgreSQL ",
        "on this machine, without TLS",
        "no tables yet: `plumb ship` makes them",
    ] {
        assert!(first.out().contains(expected), "{expected}: {}", first.out());
    }
    assert_eq!(server.ask("SELECT to_regclass('plumb_schema') IS NULL"), "t", "it only looked");
    write_run(&lab.state(), 3);
    assert_eq!(lab.plumb(&["ship", "--once", "--to", &address]).code(), 0);
    write_run(&lab.state(), 3);
    let behind = doctor(&address);
    assert!(behind.out().contains("is shipped: 4 rows behind"), "{}", behind.out());
    server.ask("UPDATE records SET last_seen = now() - interval '1 hour'");
    let silent = doctor(&address);
    assert!(
        silent.code() == 1 && silent.out().contains("its shipper was not heard of for 36"),
        "{}",
        silent.out()
    );
    server.ask("UPDATE plumb_schema SET version = 99");
    let newer = doctor(&address);
    assert!(
        newer.code() == 1 && newer.out().contains("schema 99") && newer.out().contains("use the newer plumb"),
        "{}",
        newer.out()
    );
    let nobody = doctor(&address.replace("user=plumb", "user=nobody"));
    assert!(nobody.code() == 1 && nobody.out().contains("createuser --pwprompt plumb"), "{}", nobody.out());
    server.kill();
    let gone = doctor(&address);
    assert!(
        gone.code() == 1
            && gone.out().contains("does not answer")
            && gone.out().contains("systemctl status postgresql"),
        "{}",
        gone.out()
    );
    let wrong = doctor("lab-server");
    assert!(wrong.code() == 1 && wrong.out().contains("postgres://USER@HOST/DATABASE"), "{}", wrong.out());
}

#[test]
fn what_the_database_has_had_for_long_is_taken_off_the_outbox_and_another_database_is_reported() {
    let Some(server) = Server::new() else { return };
    let (lab, address) = (Lab::new(), server.address());
    write_run(&lab.state(), 40);
    assert_eq!(lab.plumb(&["ship", "--once", "--to", &address]).code(), 0);
    let young = lab.plumb(&["ship", "--to", &address, "--trim", "1"]);
    assert!(young.code() == 0 && young.out().contains("0 rows older than 1 days are off"), "{}", young.all());
    let file = rusqlite::Connection::open(lab.state().join("plumb.sqlite3")).unwrap();
    file.execute("UPDATE outbox SET made = '2020-01-01T00:00:00.000Z' WHERE sequence <> (SELECT max(sequence) FROM outbox)", []).unwrap();
    drop(file);
    write_run(&lab.state(), 2);
    let rows =
        |state: &std::path::Path| Record::open(state).unwrap().outbox_after(0, u32::MAX).unwrap().len();
    let trimmed = lab.plumb(&["ship", "--to", &address, "--trim", "1"]);
    assert_eq!(trimmed.code(), 0, "{}", trimmed.all());
    assert!(
        trimmed.out().contains(" rows older than 1 days are off the outbox; the database has them"),
        "{}",
        trimmed.out()
    );
    assert!(rows(&lab.state()) < 10, "{} rows are left", rows(&lab.state()));
    // It goes on as before.
    write_run(&lab.state(), 2);
    assert_eq!(lab.plumb(&["ship", "--once", "--to", &address]).code(), 0);
    assert_eq!(server.ask("SELECT count(*) FROM runs"), "3");
    assert_eq!(server.ask("SELECT max(sequence) - count(*) FROM outbox"), "0", "no gap");

    // A database that has nothing of it gets nothing by halves.
    let other = Server::new().unwrap();
    let gap = lab.plumb(&["ship", "--once", "--to", &other.address()]);
    assert!(gap.code() == 2 && gap.err().contains("plumb ship --new-identity"), "{}", gap.all());
    assert_eq!(other.ask("SELECT count(*) FROM outbox"), "0");
    let anew = lab.plumb(&["ship", "--once", "--to", &other.address(), "--new-identity"]);
    assert_eq!(anew.code(), 0, "{}", anew.all());
    assert_eq!(other.ask("SELECT count(*) FROM runs"), "3");
    assert_eq!(other.ask("SELECT count(*) FROM newest WHERE kind = 'log'"), "44");
}
