//! From the levels of a device's input lines to the edges of a sensor's output.

use plumb_plugin::{DigitalInputs, PluginError, ProximityEdge};

use crate::config::{Active, Config};

/// What has been seen of the line.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    /// The level, once anything was heard.
    fired: Option<bool>,
    /// A change that may still be taken back.
    pending: Option<ProximityEdge>,
    /// Everything up to this moment has been seen, ns.
    pub(crate) seen_ns: u64,
}

impl Watch {
    /// Takes in a message, and returns the edges that are certain with it, oldest first.
    ///
    /// # Errors
    /// [`PluginError::InputLost`] when the line's level is not what the messages so far left it at.
    pub(crate) fn take(
        &mut self,
        config: &Config,
        message: &DigitalInputs,
    ) -> Result<Vec<ProximityEdge>, PluginError> {
        let fired = message.level(config.bit()) == (config.active == Active::High);
        self.seen_ns = self.seen_ns.max(message.time_ns);
        let mut certain = Vec::new();
        certain.extend(self.certain_at(message.time_ns, config.debounce_ns()));
        if message.has_changed(config.bit()) {
            let edge = ProximityEdge {
                time_ns: message.time_ns,
                fired: u32::from(fired),
                joints: message.joints,
                joints_half_width: message.joints_half_width,
                ..Default::default()
            };
            match self.pending.take() {
                Some(taken_back) if taken_back.fired != edge.fired => {}
                _ => self.pending = Some(edge),
            }
            certain.extend(self.certain_at(message.time_ns, config.debounce_ns()));
        } else if self.fired.is_some_and(|before| before != fired) {
            self.forget();
            return Err(PluginError::InputLost(format!(
                "line {} went to {} in no message: one must have been lost",
                config.bit(),
                u8::from(message.level(config.bit()))
            )));
        }
        self.fired = Some(fired);
        Ok(certain)
    }

    /// The change that may still be taken back, made certain: for the end of a motion, when nothing moves that could take it back.
    pub(crate) fn settle(&mut self) -> Option<ProximityEdge> {
        self.pending.take()
    }

    /// Whether the sensor sees a reflection, where that is known.
    pub(crate) fn fired(&self) -> Option<bool> {
        self.fired
    }

    /// Forgets the level: messages were lost.
    pub(crate) fn forget(&mut self) {
        self.fired = None;
        self.pending = None;
    }

    fn certain_at(&mut self, time_ns: u64, debounce_ns: u64) -> Option<ProximityEdge> {
        self.pending.take_if(|edge| time_ns >= edge.time_ns.saturating_add(debounce_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_plugin::JointVector;

    fn config(debounce_ms: f64) -> Config {
        Config::of_bit(2, Active::High, debounce_ms)
    }

    fn message(time_ms: u64, level: bool, changed: bool) -> DigitalInputs {
        DigitalInputs {
            time_ns: time_ms * 1_000_000,
            levels: u64::from(level) << 2,
            changed: u64::from(changed) << 2,
            joints: JointVector::from_slice(&[time_ms as f64]).unwrap(),
            joints_half_width: JointVector::from_slice(&[0.5]).unwrap(),
            ..Default::default()
        }
    }

    fn edges(config: &Config, messages: &[DigitalInputs]) -> Vec<(u64, bool)> {
        let mut watch = Watch::default();
        let mut edges = Vec::new();
        for message in messages {
            edges.extend(watch.take(config, message).unwrap());
        }
        edges.extend(watch.settle());
        edges.iter().map(|edge| (edge.time_ns / 1_000_000, edge.has_fired())).collect()
    }

    #[test]
    fn a_change_of_the_line_is_an_edge_with_its_pose() {
        let mut watch = Watch::default();
        assert!(watch.take(&config(0.0), &message(1, false, false)).unwrap().is_empty());
        let edges = watch.take(&config(0.0), &message(7, true, true)).unwrap();
        assert_eq!(edges.len(), 1);
        assert!(edges[0].has_fired());
        assert_eq!(edges[0].joints.as_slice(), [7.0]);
        assert_eq!(edges[0].joints_half_width.as_slice(), [0.5]);
        assert_eq!(watch.fired(), Some(true));
    }

    #[test]
    fn a_line_that_is_active_low_fires_when_it_falls() {
        let config = Config::of_bit(2, Active::Low, 0.0);
        assert_eq!(edges(&config, &[message(1, true, false), message(2, false, true)]), [(2, true)]);
    }

    #[test]
    fn another_lines_change_is_no_edge() {
        let mut other = message(2, false, false);
        other.levels = 1;
        other.changed = 1;
        assert!(edges(&config(0.0), &[message(1, false, false), other]).is_empty());
    }

    #[test]
    fn a_change_taken_back_within_the_debounce_time_is_none() {
        let chatter = [
            message(1, false, false),
            message(10, true, true),
            message(12, false, true),
            message(20, true, true),
            message(40, true, false),
        ];
        assert_eq!(edges(&config(5.0), &chatter), [(20, true)]);
        assert_eq!(edges(&config(0.0), &chatter), [(10, true), (12, false), (20, true)]);
    }

    #[test]
    fn a_change_at_the_very_end_of_a_motion_is_kept() {
        assert_eq!(
            edges(
                &config(5.0),
                &[message(1, false, false), message(10, true, true), message(11, true, false)]
            ),
            [(10, true)]
        );
    }

    #[test]
    fn a_level_that_no_message_brought_is_a_loss() {
        let mut watch = Watch::default();
        watch.take(&config(0.0), &message(1, false, false)).unwrap();
        let error = watch.take(&config(0.0), &message(2, true, false)).unwrap_err();
        assert_eq!(error.to_string(), "line 2 went to 1 in no message: one must have been lost");
        assert_eq!(watch.fired(), None);
    }
}
