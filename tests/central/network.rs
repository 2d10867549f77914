//! A network of a test's own between cells and database, which can be cut: a network namespace and a pair of virtual cards. It needs root.

use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

/// Networks of this process so far.
static NUMBER: AtomicU32 = AtomicU32::new(0);

/// Goes with the test.
pub(crate) struct Network {
    namespace: String,
    card: String,
    address: String,
}

impl Network {
    /// A new one; or why there is none.
    pub(crate) fn new() -> Result<Self, String> {
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let process = std::process::id();
        // Names of cards have 15 characters at most.
        let (namespace, card, other) = (
            format!("plumb-{process}-{number}"),
            format!("pl{process}-{number}"),
            format!("pr{process}-{number}"),
        );
        // 198.18.0.0/15 is set aside for trying networks (RFC 2544), so that nothing real is there.
        let block = (process % 8_000) * 8 + number % 2 * 4;
        let part = |host: u32| {
            format!(
                "198.{}.{}.{}",
                18 + (block + host) / 65_536,
                (block + host) / 256 % 256,
                (block + host) % 256
            )
        };
        let (here, there) = (part(1), part(2));
        let network = Self { namespace: namespace.clone(), card: card.clone(), address: here.clone() };
        ip(&format!("netns add {namespace}"))?;
        ip(&format!("link add {card} type veth peer name {other} netns {namespace}"))?;
        ip(&format!("addr add {here}/30 dev {card}"))?;
        ip(&format!("link set {card} up"))?;
        ip(&format!("-n {namespace} addr add {there}/30 dev {other}"))?;
        ip(&format!("-n {namespace} link set {other} up"))?;
        ip(&format!("-n {namespace} link set lo up"))?;
        Ok(network)
    }

    /// The address on this side.
    pub(crate) fn server_address(&self) -> &str {
        &self.address
    }

    /// The same command on the other side.
    pub(crate) fn inside(&self, command: &Command) -> Command {
        let mut inside = Command::new("ip");
        inside.args(["netns", "exec", &self.namespace]).arg(command.get_program()).args(command.get_args());
        if let Some(folder) = command.get_current_dir() {
            inside.current_dir(folder);
        }
        for (name, value) in command.get_envs() {
            match value {
                Some(value) => inside.env(name, value),
                None => inside.env_remove(name),
            };
        }
        inside.stdin(Stdio::null());
        inside
    }

    /// Nothing comes through, and nobody is informed.
    pub(crate) fn cut(&self) {
        ip(&format!("link set {} down", self.card)).unwrap();
    }

    pub(crate) fn mend(&self) {
        ip(&format!("link set {} up", self.card)).unwrap();
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        let _gone = ip(&format!("link del {}", self.card));
        let _gone = ip(&format!("netns del {}", self.namespace));
    }
}

fn ip(words: &str) -> Result<(), String> {
    let made = Command::new("ip")
        .args(words.split_whitespace())
        .output()
        .map_err(|error| format!("ip {words}: {error}"))?;
    match made.status.success() {
        true => Ok(()),
        false => Err(format!("ip {words}: {}", String::from_utf8_lossy(&made.stderr).trim())),
    }
}
