//! Portable grey maps: P5, binary, and P2, plain.

use super::grey_picture::Picture;
use crate::extract::LARGEST_SIDE;

/// The next number of a header, comments left out, and the bytes after the one white space behind it.
fn number(bytes: &[u8]) -> Result<(usize, &[u8]), String> {
    let mut rest = bytes;
    loop {
        match rest {
            [b'#', ..] => {
                let end = rest.iter().position(|byte| *byte == b'\n').ok_or("its header has no end")?;
                rest = rest.get(end..).unwrap_or_default();
            }
            [space, after @ ..] if space.is_ascii_whitespace() => rest = after,
            _ => break,
        }
    }
    let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let text = rest.get(..digits).and_then(|text| std::str::from_utf8(text).ok()).unwrap_or_default();
    let value = text.parse().map_err(|_| "its header lacks a number".to_owned())?;
    Ok((value, rest.get(digits + 1..).unwrap_or_default()))
}

pub(super) fn parse(bytes: &[u8]) -> Result<Picture, String> {
    let plain = match bytes {
        [b'P', b'5', ..] => false,
        [b'P', b'2', ..] => true,
        _ => return Err("it does not begin with P5 or P2: it is no grey PGM file".to_owned()),
    };
    let (width, rest) = number(bytes.get(2..).unwrap_or_default())?;
    let (height, rest) = number(rest)?;
    let (brightest, rest) = number(rest)?;
    if !(1..=LARGEST_SIDE).contains(&width) || !(1..=LARGEST_SIDE).contains(&height) {
        return Err(format!("{width} x {height} pixels cannot be; each side is 1 to {LARGEST_SIDE}"));
    }
    if !(1..=65_535).contains(&brightest) {
        return Err(format!("its brightest level is {brightest}; it is 1 to 65535"));
    }
    let scaled = |level: usize| (level.min(brightest) * 255 / brightest) as u8;
    let count = width * height;
    let cut = |there: usize| format!("it is cut short: {there} of {count} pixels are there");
    let pixels = if plain {
        let text = std::str::from_utf8(rest).map_err(|_| "it is not plain text, as P2 says")?;
        let levels = text.split_ascii_whitespace().take(count).map(|level| level.parse().map(scaled));
        let levels: Vec<u8> = levels.collect::<Result<_, _>>().map_err(|_| "a grey level is no number")?;
        if levels.len() < count {
            return Err(cut(levels.len()));
        }
        levels
    } else if brightest > 255 {
        let levels = rest.get(..2 * count).ok_or_else(|| cut(rest.len() / 2))?;
        levels.chunks_exact(2).map(|two| scaled(usize::from(two[0]) << 8 | usize::from(two[1]))).collect()
    } else {
        let levels = rest.get(..count).ok_or_else(|| cut(rest.len()))?;
        if brightest == 255 {
            levels.to_vec()
        } else {
            levels.iter().map(|level| scaled(usize::from(*level))).collect()
        }
    };
    Ok(Picture { width, height, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn both_kinds_are_read() {
        let picture = Picture { width: 2, height: 2, pixels: vec![0, 10, 20, 255] };
        assert_eq!(parse(b"P5\n# a comment\n2 2\n255\n\x00\x0a\x14\xff").unwrap(), picture);
        assert_eq!(parse(b"P2 2 2 255\n0 10\n20 255\n").unwrap(), picture);
    }

    #[test]
    fn what_is_cut_short_says_so() {
        assert_eq!(parse(b"P5 2 2 255\n\x00\x0a").unwrap_err(), "it is cut short: 2 of 4 pixels are there");
        assert_eq!(parse(b"P5 2").unwrap_err(), "its header lacks a number");
        assert!(parse(b"P6 2 2 255 ").unwrap_err().contains("no grey PGM"));
    }

    proptest! {
        #[test]
        fn no_bytes_break_it(bytes in prop::collection::vec(any::<u8>(), 0..200), head in prop_oneof!["P5 ", "P2 ", "P5 3 2 255 ", ""]) {
            let mut all = head.into_bytes();
            all.extend(bytes);
            let _ = parse(&all);
        }
    }
}
