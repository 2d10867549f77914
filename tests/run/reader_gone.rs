//! Output that nobody reads any more, as in `plumb show | head -1`.

use std::process::Stdio;

use crate::lab::Lab;

#[test]
fn a_listing_whose_reader_has_gone_ends_without_a_word() {
    let lab = Lab::new();
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let listings: [&[&str]; 9] = [
        &["schema"],
        &["history"],
        &["history", "--csv"],
        &["history", "--trend", "arm.waist"],
        &["show"],
        &["show", "--csv"],
        &["show", "--table"],
        &["record", "check"],
        &["run", "cell.yaml", "--dry-run"],
    ];
    for arguments in listings {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let listing = lab.command(arguments).stdout(writer).stderr(Stdio::piped()).output().unwrap();
        let message = String::from_utf8_lossy(&listing.stderr);
        assert_eq!((listing.status.code(), message.as_ref()), (Some(0), ""), "{arguments:?}");
    }
}
