//! Who may answer: one holder at a time, for a short time.

use std::time::{Duration, Instant};

/// How long a lease holds after its holder was last heard of. A page renews it every few seconds; anyone who closes it is out of
/// the others' way within half a minute.
pub(super) const HOLDS: Duration = Duration::from_secs(30);

/// Longest name of a holder, in characters.
const LONGEST_NAME: usize = 60;

/// Why somebody may not answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum LeaseError {
    #[error("a name has 1 to {LONGEST_NAME} characters and no control characters")]
    NoName,
    #[error("{holder} holds the lease and may answer for {left_s} s more")]
    Held { holder: String, left_s: u64 },
    #[error("this lease is not valid, or no longer: take it anew")]
    NotHeld,
}

/// The lease of one server.
#[derive(Debug, Default)]
pub(super) struct Leases {
    current: Option<Lease>,
}

#[derive(Debug, Clone)]
struct Lease {
    key: String,
    holder: String,
    until: Instant,
}

impl Leases {
    /// Gives the lease to `name` with a `fresh` key, unless somebody else holds it. The holder's own key renews it.
    pub(super) fn take(
        &mut self,
        name: &str,
        own: Option<&str>,
        fresh: String,
        now: Instant,
    ) -> Result<String, LeaseError> {
        let name = name.trim();
        let length = name.chars().count();
        if length == 0 || length > LONGEST_NAME || name.chars().any(char::is_control) {
            return Err(LeaseError::NoName);
        }
        let held = self.current.as_ref().filter(|lease| lease.until > now);
        let key = match held {
            Some(lease) if own != Some(lease.key.as_str()) => {
                let left_s = (lease.until - now).as_secs().max(1);
                return Err(LeaseError::Held { holder: lease.holder.clone(), left_s });
            }
            Some(lease) => lease.key.clone(),
            None => fresh,
        };
        self.current = Some(Lease { key: key.clone(), holder: name.to_owned(), until: now + HOLDS });
        Ok(key)
    }

    /// The name of who holds this key now.
    pub(super) fn holder(&self, key: &str, now: Instant) -> Result<String, LeaseError> {
        let held = self.current.as_ref().filter(|lease| lease.until > now && lease.key == key);
        held.map(|lease| lease.holder.clone()).ok_or(LeaseError::NotHeld)
    }

    /// Gives it back.
    pub(super) fn give_back(&mut self, key: &str) {
        self.current.take_if(|lease| lease.key == key);
    }

    /// Who holds it now, for the page.
    pub(super) fn current_holder(&self, now: Instant) -> Option<String> {
        self.current.as_ref().filter(|lease| lease.until > now).map(|lease| lease.holder.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_holds_it_until_it_runs_out_or_is_given_back() {
        let (mut leases, begin) = (Leases::default(), Instant::now());
        assert_eq!(leases.take("ada", None, "a".into(), begin), Ok("a".to_owned()));
        let refused = leases.take("bob", None, "b".into(), begin + Duration::from_secs(10));
        assert_eq!(refused, Err(LeaseError::Held { holder: "ada".into(), left_s: 20 }));
        assert_eq!(leases.holder("a", begin + Duration::from_secs(29)), Ok("ada".to_owned()));
        assert_eq!(leases.holder("b", begin), Err(LeaseError::NotHeld));
        // It has run out: its own key opens nothing any more, and another may have it.
        let late = begin + HOLDS + Duration::from_secs(1);
        assert_eq!(leases.holder("a", late), Err(LeaseError::NotHeld));
        assert_eq!(leases.take("bob", None, "b".into(), late), Ok("b".to_owned()));
        leases.give_back("a");
        assert_eq!(leases.current_holder(late), Some("bob".to_owned()), "a stranger gives nothing back");
        leases.give_back("b");
        assert_eq!(leases.current_holder(late), None);
    }

    #[test]
    fn the_holder_renews_it_with_the_same_key() {
        let (mut leases, begin) = (Leases::default(), Instant::now());
        leases.take("ada", None, "a".into(), begin).expect("free");
        let later = begin + Duration::from_secs(20);
        assert_eq!(leases.take("ada", Some("a"), "c".into(), later), Ok("a".to_owned()));
        assert!(leases.holder("a", begin + Duration::from_secs(45)).is_ok());
        assert!(leases.take("ada", Some("wrong"), "c".into(), later).is_err(), "a name alone is nobody");
    }

    #[test]
    fn a_name_is_a_name() {
        let mut leases = Leases::default();
        for wrong in ["", "  ", "a\nb", &"x".repeat(61)] {
            assert_eq!(
                leases.take(wrong, None, "a".into(), Instant::now()),
                Err(LeaseError::NoName),
                "{wrong:?}"
            );
        }
    }
}
