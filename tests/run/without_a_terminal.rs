//! The program where nobody sits at a terminal: in a pipe, a service, a container.

use crate::lab::Lab;

#[test]
fn screens_without_a_terminal_are_refused_without_a_letter_for_one() {
    let lab = Lab::new();
    assert_eq!(lab.plumb(&["run", "cell.yaml", "--headless"]).code(), 0);
    let refused = lab.plumb(&["watch", "1"]);
    assert_eq!(refused.code(), 2, "{}", refused.all());
    assert_eq!(refused.out(), "", "no escapes");
    assert!(refused.err().contains("the screens need a terminal"), "{}", refused.err());
}

#[test]
fn who_runs_it_is_known_where_no_variable_gives_it() {
    let lab = Lab::new();
    let mut command = lab.command(&["run", "cell.yaml", "--headless"]);
    let ran = command.env_remove("USER").env_remove("LOGNAME").output().unwrap();
    assert!(ran.status.success());
    let shown = lab.plumb(&["show", "1"]).out();
    assert!(shown.contains(", by ") && !shown.contains(", by unknown"), "{shown}");
}
