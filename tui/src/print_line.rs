//! What commands print: to standard output, with an error where `println!` would panic, as in `plumb show | head -1`.

/// Writes a line to standard output, formatted as by `println!`; gives an [`std::io::Result`].
#[macro_export]
macro_rules! print_line {
    ($($words:tt)*) => {{
        use std::io::Write as _;
        writeln!(std::io::stdout(), $($words)*)
    }};
}

pub(crate) use print_line;
