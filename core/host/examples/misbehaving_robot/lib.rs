//! A robot in memory that goes wrong on request, for tests of what surrounds it.

use std::f64::consts::TAU;
use std::fs::OpenOptions;
use std::io::Write;
use std::process;
use std::thread;
use std::time::Duration;

use plumb_plugin::{
    DigitalInputs, Host, JointDescription, JointState, JointUnit, JointVector, LineDescription, LogLevel,
    Motion, PluginError, Robot, RobotCapabilities, RobotDescription, Value,
};

/// The time between two steps of a move.
const STEP: Duration = Duration::from_millis(2);

/// The fastest a joint goes: rad/s, mm/s.
const MAX_SPEED: f64 = 1.0;

/// The line is high while the waist is above this: rad.
const THRESHOLD: f64 = 0.5;

struct MisbehavingRobot {
    host: Host,
    fault: String,
    faulty_call: String,
    diary: Option<String>,
    joints: JointVector,
    levels: u64,
}

plumb_plugin::export_robot!(MisbehavingRobot, include_str!("plugin.yaml"));

impl MisbehavingRobot {
    /// Goes wrong if this is the faulty call.
    fn misbehave(&self, call: &str) -> Result<(), PluginError> {
        if self.faulty_call != call {
            return Ok(());
        }
        match self.fault.as_str() {
            "panic" => panic!("the robot lost its head"),
            "abort" => process::abort(),
            "segfault" => segfault(),
            "exit" => process::exit(3),
            "hang" => loop {
                thread::sleep(Duration::from_secs(3600));
            },
            "flood" => self.flood(),
            "litter" => {
                let child = process::Command::new("sleep").arg("600").spawn()?;
                self.note(&child.id().to_string());
                Ok(())
            }
            "date" => {
                let since_1970 = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
                let time_ns = since_1970.map_or(0, |time| time.as_nanos() as u64);
                self.host.emit("joints", &JointState::new(time_ns, self.joints, false))
            }
            "print" => {
                for number in 0..100_000 {
                    println!("line {number} of what nobody wants to read");
                }
                Ok(())
            }
            "log" => {
                for number in 0..100_000 {
                    self.host.log(LogLevel::Info, &format!("line {number} of what nobody wants to read"));
                }
                Ok(())
            }
            "long error" => Err(PluginError::Failed("no ".repeat(2_000_000))),
            "eat" => {
                let mut eaten = Vec::new();
                loop {
                    eaten.push(vec![1_u8; 10_000_000]);
                    thread::sleep(Duration::from_millis(5));
                }
            }
            "grab" => {
                let grabbed: Vec<u8> = Vec::with_capacity(4_000_000_000);
                self.host.log(LogLevel::Info, &format!("{} bytes grabbed", grabbed.capacity()));
                Ok(())
            }
            "refuse" => Err(PluginError::Refused("the robot does not want to".to_owned())),
            "chatter" => {
                println!("printed by the plugin");
                eprintln!("complained by the plugin");
                self.host.log(LogLevel::Info, "logged by the plugin");
                self.host.progress(0.5, "half of it");
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Emits more than any receiver can take in.
    fn flood(&self) -> Result<(), PluginError> {
        for _ in 0..1000 {
            self.host.emit("joints", &self.state(false))?;
            self.host.emit("inputs", &self.inputs(0))?;
        }
        Ok(())
    }

    fn note(&self, word: &str) {
        if let Some(path) = &self.diary
            && let Ok(mut file) = OpenOptions::new().create(true).append(true).open(path)
        {
            let _ = writeln!(file, "{word}");
        }
    }

    fn state(&self, moving: bool) -> JointState {
        JointState::new(self.host.now_ns(), self.joints, moving)
    }

    fn inputs(&self, changed: u64) -> DigitalInputs {
        DigitalInputs {
            time_ns: self.host.now_ns(),
            sequence: 0,
            levels: self.levels,
            changed,
            joints: self.joints,
            joints_half_width: JointVector::zeros(2),
        }
    }

    fn step_to(&mut self, joints: JointVector, moving: bool) -> Result<(), PluginError> {
        self.joints = joints;
        let levels = u64::from(joints.get(0).unwrap_or(0.0) > THRESHOLD);
        let changed = levels ^ self.levels;
        self.levels = levels;
        if changed != 0 {
            self.host.emit("inputs", &self.inputs(changed))?;
        }
        self.host.emit("joints", &self.state(moving))
    }
}

#[allow(unsafe_code, reason = "the fault asked for")]
fn segfault() -> Result<(), PluginError> {
    // SAFETY: none; the crash is what is wanted.
    unsafe { std::ptr::null_mut::<u8>().write_volatile(1) };
    Ok(())
}

impl Robot for MisbehavingRobot {
    fn create(config: &Value, host: Host) -> Result<Self, PluginError> {
        let text = |key: &str| config[key].as_str().map(str::to_owned);
        let robot = Self {
            host,
            fault: text("fault").unwrap_or_default(),
            faulty_call: text("in").unwrap_or_default(),
            diary: text("diary"),
            joints: JointVector::zeros(2),
            levels: 0,
        };
        robot.misbehave("create")?;
        Ok(robot)
    }

    fn describe(&self) -> RobotDescription {
        let joint = |name: &str, unit, lower, upper| JointDescription {
            name: name.to_owned(),
            unit,
            lower,
            upper,
            resolution: 0.0,
            max_speed: MAX_SPEED,
            home: 0.0,
        };
        if self.misbehave("describe").is_err() {
            return RobotDescription {
                model: "no joints".to_owned(),
                joints: Vec::new(),
                inputs: Vec::new(),
                outputs: Vec::new(),
                capabilities: RobotCapabilities::default(),
            };
        }
        RobotDescription {
            model: match (self.fault.as_str(), self.faulty_call.as_str()) {
                ("epic", "describe") => "an epic ".repeat(400_000),
                _ => "misbehaving robot".to_owned(),
            },
            joints: vec![
                joint("waist", JointUnit::Radian, -16.0 * TAU, 16.0 * TAU),
                joint("gripper", JointUnit::Millimetre, 0.0, 75.0),
            ],
            inputs: vec![LineDescription { name: "line 0".to_owned(), bit: 0 }],
            outputs: Vec::new(),
            capabilities: RobotCapabilities {
                interruptible: true,
                stop_time_ms: 20,
                set_zero: true,
                ..RobotCapabilities::default()
            },
        }
    }

    fn activate(&mut self) -> Result<(), PluginError> {
        self.misbehave("activate")
    }

    fn deactivate(&mut self) -> Result<(), PluginError> {
        self.misbehave("deactivate")
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        self.misbehave("read")?;
        Ok(self.state(false))
    }

    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        self.misbehave("move")?;
        let from = self.joints;
        let end = motion.end_from(&from);
        let way = |joint: usize| end.get(joint).unwrap_or(0.0) - from.get(joint).unwrap_or(0.0);
        let step_length = MAX_SPEED * motion.speed_fraction * STEP.as_secs_f64();
        let steps = (way(0).abs().max(way(1).abs()) / step_length).ceil().max(1.0) as u64;
        for step in 1..=steps {
            self.host.wait(STEP)?;
            let mut joints = end;
            if step < steps {
                for joint in 0..joints.len() {
                    let part = step as f64 / steps as f64;
                    joints.set(joint, from.get(joint).unwrap_or(0.0) + way(joint) * part);
                }
            }
            self.step_to(joints, step < steps)?;
        }
        let state = self.state(false);
        self.host.emit("inputs", &self.inputs(0))?;
        Ok(state)
    }

    fn stop(&mut self) -> Result<(), PluginError> {
        self.misbehave("stop")?;
        self.note("stopped");
        Ok(())
    }

    fn read_inputs(&mut self) -> Result<DigitalInputs, PluginError> {
        self.misbehave("inputs")?;
        self.host.emit_in_place("frames", 1_300_000, |frame| {
            frame[..8].copy_from_slice(&self.host.now_ns().to_ne_bytes());
            frame[16..].fill(7);
            Ok(())
        })?;
        Ok(self.inputs(0))
    }

    fn set_zero(&mut self, joints: &JointVector) -> Result<(), PluginError> {
        self.joints = *joints;
        Ok(())
    }
}

impl Drop for MisbehavingRobot {
    fn drop(&mut self) {
        self.note("ended");
    }
}
