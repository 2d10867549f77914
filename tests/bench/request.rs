//! A request to a plugin and back, through host, contract and bus, beside raw iceoryx2 requests of the same lengths with the same way of waking.

use std::error::Error;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use iceoryx2::config::Config;
use iceoryx2::prelude::{
    FileName, NodeBuilder, Path as IceoryxPath, SemanticString as _, ServiceName, SignalHandlingMode,
    ipc_threadsafe,
};
use plumb_bus::{Bus, Domain, Listener, Signal};

use crate::parts::{TestFolder, steady_robot};
use crate::statistics::{quantile, us};
use crate::{LONG, Measured};

/// How this program is asked to be the raw peer's other end.
pub(crate) const RAW_SERVER: &str = "serve-raw-requests";

/// Words of a request to read the joints, and of its answer, as the bus sends them.
const REQUEST_WORDS: usize = 3;
const ANSWER_WORDS: usize = 15;

/// Requests of one kind made in a row, before the other's turn.
const IN_A_ROW: usize = 200;

type Service = ipc_threadsafe::Service;
type Requests = iceoryx2::service::port_factory::request_response::PortFactory<Service, [u64], (), [u64], ()>;

pub(crate) fn measure(count: usize) -> Measured {
    let folder = TestFolder::new()?;
    let host = folder.host("arm", &steady_robot()?, serde_json::Value::Null, Vec::new())?;
    let robot = host.robot()?;
    let raw = Raw::start(&folder)?;
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    while ours.len() < count {
        for _ in 0..IN_A_ROW {
            let began = Instant::now();
            robot.read_joints()?;
            ours.push(began.elapsed());
        }
        for _ in 0..IN_A_ROW {
            let began = Instant::now();
            raw.ask()?;
            theirs.push(began.elapsed());
        }
    }
    println!("{:<34}{:>12}{:>12}{:>12}", "", "median", "95 %", "99 %");
    for (name, times) in [("through host, contract and bus", &mut ours), ("raw iceoryx2", &mut theirs)] {
        let [median, most, nearly_all] = [0.5, 0.95, 0.99].map(|fraction| us(quantile(times, fraction)));
        println!("{name:<34}{median:>9.1} us{most:>9.1} us{nearly_all:>9.1} us");
    }
    let ratio = us(quantile(&mut ours, 0.5)) / us(quantile(&mut theirs, 0.5));
    println!("{:<34}{ratio:>9.2} times (aim: at most 1.3)", "ratio of medians");
    drop(raw);
    drop(robot);
    host.finish(LONG);
    Ok(())
}

/// The asking end of the raw peer.
struct Raw {
    process: Child,
    port: iceoryx2::port::client::Client<Service, [u64], (), [u64], ()>,
    ask: Signal,
    answered: Listener,
}

impl Raw {
    fn start(folder: &TestFolder) -> Result<Self, Box<dyn Error>> {
        let (prefix, root) = (folder.domain.prefix(), folder.domain.root());
        let answered = folder.bus()?.listener("raw/answered")?;
        let ask = folder.bus()?.signal("raw/asked")?;
        let mut command = Command::new(std::env::current_exe()?);
        command.arg(RAW_SERVER).arg(prefix).arg(root).stdin(Stdio::piped());
        let process = command.spawn()?;
        // Its first ring says that it listens.
        answered.wait(LONG)?;
        let port = requests(prefix, root)?.client_builder().initial_max_slice_len(REQUEST_WORDS).create()?;
        Ok(Self { process, port, ask, answered })
    }

    fn ask(&self) -> Measured {
        let mut message = self.port.loan_slice(REQUEST_WORDS)?;
        message.payload_mut().fill(7);
        let pending = message.send()?;
        self.ask.notify()?;
        let end = Instant::now() + LONG;
        loop {
            if pending.receive()?.is_some() {
                return Ok(());
            }
            if Instant::now() > end {
                return Err("the raw peer does not answer".into());
            }
            self.answered.wait(Duration::from_millis(100))?;
        }
    }
}

impl Drop for Raw {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The raw peer's answering end, a process of its own.
pub(crate) fn serve_raw(arguments: &[String]) -> Measured {
    let [prefix, root] = arguments else { return Err("give a prefix and a directory".into()) };
    let root = Path::new(root);
    let bus = Bus::open(&Domain::new(prefix, root)?, "raw peer")?;
    let asked = bus.listener("raw/asked")?;
    let answered = bus.signal("raw/answered")?;
    let port = requests(prefix, root)?.server_builder().initial_max_slice_len(ANSWER_WORDS).create()?;
    answered.notify()?;
    loop {
        asked.wait(LONG)?;
        while let Some(request) = port.receive()? {
            let mut answer = request.loan_slice(ANSWER_WORDS)?;
            answer.payload_mut().fill(request.payload().iter().sum());
            answer.send()?;
            answered.notify()?;
        }
    }
}

fn requests(prefix: &str, root: &Path) -> Result<Requests, Box<dyn Error>> {
    let mut config = Config::default();
    config.global.prefix = FileName::new(format!("{prefix}raw_").as_bytes())?;
    config.global.set_root_path(&IceoryxPath::new(root.join("raw").as_os_str().as_encoded_bytes())?);
    std::fs::create_dir_all(root.join("raw"))?;
    let node = NodeBuilder::new()
        .config(&config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<Service>()?;
    let service = node
        .service_builder(&ServiceName::new("raw")?)
        .request_response::<[u64], [u64]>()
        .max_active_requests_per_client(2)
        .max_response_buffer_size(1)
        .open_or_create()?;
    Ok(service)
}
