//! Streams, requests and liveness between processes, over iceoryx2.
