//! The controller at work: a thread that serves its clients and leads the arm, cycle by cycle.

use std::fmt;
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::net::{IpAddr, TcpListener};
use std::os::fd::AsFd as _;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;

use super::arm::{ArmError, LedArm};
use super::client::{Client, Trouble};
use super::controller::Controller;
use super::event::Event;
use super::ports::{PortsError, Server, listen};
use super::primary;
use super::states::{AXES, CYCLE_S, Series};
use crate::physics::random::Random;

/// How often the primary and the secondary interface report how the robot is.
const SLOW_STATES: Duration = Duration::from_millis(100);

/// How an emulated controller is.
#[derive(Debug, Clone)]
pub struct EmulatorOptions {
    /// The socket of the world whose arm it leads.
    pub world: PathBuf,
    /// Where it listens; without one, at a free address of this computer's own.
    pub address: Option<IpAddr>,
    /// Which generation it is of.
    pub series: Series,
    /// The highest version of RTDE it speaks.
    pub protocol: u16,
    /// Whether motions take no time of the wall's clock.
    pub fast: bool,
    /// What chance is drawn from.
    pub seed: u64,
}

impl Default for EmulatorOptions {
    fn default() -> Self {
        Self { world: PathBuf::new(), address: None, series: Series::E, protocol: 2, fast: false, seed: 1 }
    }
}

/// The status of the controller.
#[derive(Debug, Clone, Default)]
pub struct Status {
    /// Where it listens.
    pub address: Option<IpAddr>,
    /// Whether the arm moves.
    pub moving: bool,
    /// What its modes are called.
    pub modes: String,
    /// Where the joints are, rad.
    pub joints: [f64; AXES],
    /// How many are connected.
    pub clients: usize,
}

/// Why a controller does not work, or no longer.
#[derive(Debug, thiserror::Error)]
pub enum EmulatorError {
    /// The arm is gone.
    #[error(transparent)]
    Arm(#[from] ArmError),
    /// Its ports are taken.
    #[error(transparent)]
    Ports(#[from] PortsError),
    /// The system failed.
    #[error("the emulated controller's connections failed: {0}")]
    System(#[from] io::Error),
    /// The thread panicked.
    #[error("the emulator panicked: a fault in its code")]
    Panicked,
}

/// What its thread is given.
enum Order {
    Happen(Event, SyncSender<()>),
    End,
}

/// A controller at work. Ends when it is dropped.
pub struct Emulator {
    orders: Sender<Order>,
    wake: UnixStream,
    status: Arc<Mutex<Status>>,
    thread: Option<JoinHandle<Result<(), EmulatorError>>>,
}

impl Emulator {
    /// Switches a controller on.
    ///
    /// # Errors
    /// [`EmulatorError`] when there is no world with an arm of six joints that turn, or the ports are taken.
    pub fn start(options: &EmulatorOptions) -> Result<Self, EmulatorError> {
        let arm = LedArm::connect(&options.world)?;
        let (address, listeners) = listen(options.address)?;
        let (wake, woken) = UnixStream::pair()?;
        woken.set_nonblocking(true)?;
        let (orders, received) = channel();
        let status = Arc::new(Mutex::new(Status { address: Some(address), ..Status::default() }));
        let mut service = Service {
            controller: Controller::new(arm, options.series, options.fast, options.seed),
            protocol: options.protocol,
            listeners,
            clients: Vec::new(),
            trouble: Trouble::default(),
            random: Random::new(options.seed, "pieces of packages"),
            next_cycle: Instant::now(),
            next_slow: Instant::now(),
            address,
        };
        let noted = Arc::clone(&status);
        let thread = std::thread::spawn(move || service.serve(&woken, &received, &noted));
        Ok(Self { orders, wake, status, thread: Some(thread) })
    }

    /// The status of the controller now.
    pub fn status(&self) -> Status {
        self.status.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Lets something happen to the controller, and returns when it has happened.
    pub fn inject(&mut self, event: Event) {
        let (happened, wait) = sync_channel(1);
        self.order(Order::Happen(event, happened));
        // A controller that has ended hears nothing more: `stop` says why it ended.
        let _ = wait.recv();
    }

    /// Whether it still works.
    pub fn is_working(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Switches the controller off.
    ///
    /// # Errors
    /// Why it had ended before, if it had.
    pub fn stop(mut self) -> Result<(), EmulatorError> {
        self.end()
    }

    fn end(&mut self) -> Result<(), EmulatorError> {
        self.order(Order::End);
        match self.thread.take() {
            Some(thread) => thread.join().unwrap_or(Err(EmulatorError::Panicked)),
            None => Ok(()),
        }
    }

    fn order(&mut self, order: Order) {
        // One that has ended takes no orders, and need not be woken.
        let _ = self.orders.send(order);
        let _ = self.wake.write(&[0]);
    }
}

impl fmt::Debug for Emulator {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Emulator").field("working", &self.is_working()).finish_non_exhaustive()
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // Anyone who wants to know why it ended asks with `stop`.
        let _ = self.end();
    }
}

/// The thread's own.
struct Service {
    controller: Controller,
    protocol: u16,
    listeners: Vec<(Server, TcpListener)>,
    clients: Vec<Client>,
    trouble: Trouble,
    random: Random,
    next_cycle: Instant,
    next_slow: Instant,
    address: IpAddr,
}

impl Service {
    /// Works until it is asked to end.
    fn serve(
        &mut self,
        woken: &UnixStream,
        orders: &Receiver<Order>,
        status: &Mutex<Status>,
    ) -> Result<(), EmulatorError> {
        loop {
            self.wait(woken)?;
            let mut happened = Vec::new();
            for order in orders.try_iter() {
                match order {
                    Order::Happen(event, done) => {
                        self.happen(&event);
                        happened.push(done);
                    }
                    Order::End => return Ok(()),
                }
            }
            self.accept()?;
            self.hear();
            let now = Instant::now();
            if now >= self.next_cycle || self.controller.hurries() {
                self.controller.cycle()?;
                let cycle = Duration::from_secs_f64(CYCLE_S);
                // A controller that was held up, or was in a hurry, goes on from now: it makes up for nothing.
                self.next_cycle = (self.next_cycle + cycle).clamp(now, now + cycle);
                self.publish(now);
            }
            self.clients.iter_mut().for_each(|client| client.flush(&mut self.random));
            self.clients.retain(|client| !client.ended);
            *status.lock().unwrap_or_else(PoisonError::into_inner) = self.status();
            for done in happened {
                // Anyone who reported it may have gone.
                let _ = done.send(());
            }
        }
    }

    /// Waits for a cycle, a client, or somebody who wakes it.
    fn wait(&self, woken: &UnixStream) -> io::Result<()> {
        let left = match self.controller.hurries() {
            true => Duration::ZERO,
            false => self.next_cycle.saturating_duration_since(Instant::now()),
        };
        let mut polled = vec![PollFd::new(woken.as_fd(), PollFlags::POLLIN)];
        let listeners = self.listeners.iter().map(|(_, listener)| listener.as_fd());
        let clients = self.clients.iter().map(Client::wait_on);
        polled.extend(listeners.chain(clients).map(|one| PollFd::new(one, PollFlags::POLLIN)));
        match ppoll(&mut polled, Some(TimeSpec::from_duration(left)), None) {
            Ok(_) | Err(Errno::EINTR) => {}
            Err(error) => return Err(error.into()),
        }
        // Nothing there is as good as something: it only wakes.
        let _ = (&*woken).read(&mut [0; 64]);
        Ok(())
    }

    fn happen(&mut self, event: &Event) {
        match event {
            Event::Freeze(on) => self.trouble.frozen = *on,
            Event::Silence(on) => self.trouble.silent = *on,
            Event::Late(late) => self.trouble.late = *late,
            Event::Cut => self.trouble.cut = true,
            Event::Disconnect => self.clients.clear(),
            Event::Gone => {
                self.clients.clear();
                self.listeners.clear();
            }
            event => self.controller.happen(event),
        }
    }

    fn accept(&mut self) -> io::Result<()> {
        for (server, listener) in &self.listeners {
            loop {
                match listener.accept() {
                    Ok((stream, _)) => {
                        self.clients.push(Client::greet(stream, *server, &self.controller, self.protocol));
                    }
                    Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                    Err(error)
                        if matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::ConnectionAborted) => {}
                    Err(error) => return Err(error),
                }
            }
        }
        Ok(())
    }

    fn hear(&mut self) {
        let claimed: Vec<Vec<usize>> = self.clients.iter().map(Client::claimed).collect();
        for (index, client) in self.clients.iter_mut().enumerate() {
            let others = claimed.iter().enumerate().filter(|(other, _)| *other != index);
            let others: Vec<usize> = others.flat_map(|(_, registers)| registers.iter().copied()).collect();
            client.hear(&mut self.controller, &others);
        }
    }

    /// Reports to the clients what has happened in a cycle.
    fn publish(&mut self, now: Instant) {
        let slow = now >= self.next_slow;
        if slow {
            self.next_slow = now + SLOW_STATES;
        }
        for (line, column, text) in std::mem::take(&mut self.controller.messages) {
            let message = primary::runtime_message(&self.controller, line, column, &text);
            self.clients.iter_mut().for_each(|client| client.send_message(&message));
        }
        for client in &mut self.clients {
            client.send_state(&self.controller, &self.trouble, slow);
        }
        if self.trouble.cut && self.clients.iter().any(Client::sends_states) {
            self.trouble.cut = false;
            for client in self.clients.iter_mut().filter(|client| client.sends_states()) {
                client.flush(&mut self.random);
                client.ended = true;
            }
        }
    }

    fn status(&self) -> Status {
        let controller = &self.controller;
        Status {
            address: Some(self.address),
            moving: controller.is_moving(),
            modes: format!(
                "{}, {}, program {:?}{}",
                controller.robot_mode.name(),
                controller.safety_mode.name(),
                controller.runtime,
                if controller.remote { "" } else { ", local control" }
            ),
            joints: controller.actual,
            clients: self.clients.len(),
        }
    }
}
