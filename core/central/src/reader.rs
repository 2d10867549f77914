//! Who asks the central database again and again, while it may come and go.

use std::time::Duration;

use crate::{Central, CentralError};

/// A connection that is made anew after it has failed.
pub struct Reader {
    from: String,
    within: Duration,
    /// The connection, while there is one.
    central: Option<Central>,
}

impl Reader {
    /// Connects when it is first asked. `within` is how long one answer may take: on a network that was cut the system itself would wait for a quarter of an
    /// hour.
    pub fn new(from: &str, within: Duration) -> Self {
        Self { from: from.to_owned(), within, central: None }
    }

    /// Asks. A connection that fails is dropped, and the next question makes a new one.
    ///
    /// # Errors
    /// [`CentralError::Slow`]; or the database does not answer.
    pub async fn ask<T>(
        &mut self,
        question: impl AsyncFnOnce(&mut Central) -> Result<T, CentralError>,
    ) -> Result<T, CentralError> {
        // A connection has a time limit of its own, and making new tables of many rows may take longer.
        let mut central = match self.central.take() {
            Some(central) => central,
            None => Central::connect(&self.from).await?,
        };
        let answered = tokio::time::timeout(self.within, question(&mut central)).await;
        let answer = answered.unwrap_or(Err(CentralError::Slow { limit_s: self.within.as_secs() }))?;
        self.central = Some(central);
        Ok(answer)
    }
}
