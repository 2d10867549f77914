//! The names of streams and signals in a domain: both ends of each make them here.

use plumb_plugin::StreamDescription;

/// The name of a device's stream, `device/stream`.
pub(crate) fn stream_name(device: &str, stream: &StreamDescription) -> String {
    format!("{device}/{}", stream.name)
}

/// The service on which the messages of a stream of that name go.
pub(crate) fn stream_service_name(stream: &str) -> String {
    format!("stream/{stream}")
}

/// The signal sent with every message of a stream of that name.
pub(crate) fn stream_signal(stream: &str) -> String {
    format!("stream/{stream}")
}

/// The signal sent with every request to a device.
pub(crate) fn request_signal(device: &str) -> String {
    format!("request/{device}")
}

/// The signal sent with every answer of a device.
pub(crate) fn reply_signal(device: &str) -> String {
    format!("reply/{device}")
}

#[cfg(test)]
mod tests {
    use plumb_plugin::JointState;

    use super::*;

    /// Programs in other languages and other versions meet by these names.
    #[test]
    fn streams_and_signals_have_the_names_that_others_know() {
        let stream = stream_name("arm", &StreamDescription::of::<JointState>("joints"));
        assert_eq!(stream, "arm/joints");
        assert_eq!(stream_service_name(&stream), "stream/arm/joints");
        assert_eq!(stream_signal(&stream), "stream/arm/joints");
        assert_eq!((request_signal("arm"), reply_signal("arm")), ("request/arm".into(), "reply/arm".into()));
    }
}
