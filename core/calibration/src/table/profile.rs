//! Points of line profiles: what a laser line sensor on the hand shows in its own plane.

/// One point of the profile in each row: mm, frame of the sensor (x along its line, z away from it); not a number where nothing was seen.
#[derive(Debug, Clone)]
pub struct ProfileColumns {
    /// Its number in the headers, `profile3_x_mm`; 0 of `profile_x_mm`.
    pub number: usize,
    /// Per row: x and z in mm.
    pub xz: Vec<[f64; 2]>,
}

impl ProfileColumns {
    /// What the headers begin with.
    pub fn name(&self) -> String {
        match self.number {
            0 => "profile".to_owned(),
            number => format!("profile{number}"),
        }
    }

    /// The same columns without rows.
    pub fn empty(&self) -> Self {
        Self { number: self.number, xz: Vec::new() }
    }
}

/// The number of a point in the headers; nothing of what is no point of a profile.
pub(super) fn number_of(body: &str) -> Option<usize> {
    let digits = body.strip_prefix("profile")?;
    if digits.is_empty() {
        return Some(0);
    }
    let number = digits.parse::<usize>().ok().filter(|_| digits.bytes().all(|byte| byte.is_ascii_digit()));
    number.filter(|number| (1..1000).contains(number))
}
