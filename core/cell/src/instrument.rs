//! What the operator measures with. In a simulated cell the world has instruments of its own, and answers can come from them.

/// One use of an instrument.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InstrumentUse {
    /// Which: what there is, the world knows.
    pub instrument: String,
    /// Where it is put.
    pub at: Option<String>,
    /// Whether it is turned end for end.
    pub turned: bool,
    /// The joint that is driven with the pendant until the instrument shows zero; without it, the instrument is read.
    pub drive: Option<String>,
}

/// What came of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InstrumentResult {
    /// It reads so, in the unit its prompt asks for.
    Reading(f64),
    /// The joint was driven until it showed zero.
    Driven,
}

impl std::fmt::Display for InstrumentUse {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(&self.instrument)?;
        if let Some(at) = &self.at {
            write!(formatter, " at {at}")?;
        }
        if self.turned {
            formatter.write_str(", turned")?;
        }
        Ok(())
    }
}
