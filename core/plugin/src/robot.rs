//! What a robot can be asked.

use crate::{
    DigitalInputs, Host, JogState, JointState, JointVector, Motion, MotorState, PluginError,
    RobotDescription, Value,
};

/// A robot. The host calls these functions one at a time, always from the same thread.
///
/// A robot emits two streams: `joints` ([`JointState`], while it moves and when it comes to rest) and, when it has input lines, `inputs`
/// ([`DigitalInputs`], at every change and once at the end of every move).
///
/// A sensor that is wired to these streams is asked for what it has seen up to the moment of a reading, so after [`Robot::read_joints`] at rest there
/// has to be a message on each that is not older than the state it returned. Where the robot has not emitted one, the host does: that state on
/// `joints`, and what [`Robot::read_inputs`] then says on `inputs`. A robot with input lines therefore reads them.
pub trait Robot: Sized + Send {
    /// Connects to the device. Nothing moves. `config` is what the cell file gives under `config:`, or null.
    ///
    /// # Errors
    /// [`PluginError::Refused`] for a configuration that cannot be used, saying what would be right; [`PluginError::Disconnected`] for a
    /// device that does not answer.
    fn create(config: &Value, host: Host) -> Result<Self, PluginError>;

    /// Joints, lines and capabilities. Does not change while the plugin lives.
    fn describe(&self) -> RobotDescription;

    /// Makes the robot ready to move. Clears an earlier stop.
    ///
    /// # Errors
    /// Whatever keeps the robot from moving.
    fn activate(&mut self) -> Result<(), PluginError> {
        Ok(())
    }

    /// Brings the robot to rest so that it may be left alone.
    ///
    /// # Errors
    /// When the device does not confirm.
    fn deactivate(&mut self) -> Result<(), PluginError> {
        Ok(())
    }

    /// Where the joints are now.
    ///
    /// # Errors
    /// When the device does not answer.
    fn read_joints(&mut self) -> Result<JointState, PluginError>;

    /// Moves, and returns the state in which the robot came to rest.
    ///
    /// Looks at [`Host::should_stop`] at least every 50 ms. Limits have been checked by the host before the call.
    ///
    /// # Errors
    /// [`PluginError::Stopped`] when a stop ended the move early, with the robot at rest; anything the device reports.
    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError>;

    /// Brings the robot to rest, now. Called after a move was interrupted, and when none was under way.
    ///
    /// # Errors
    /// When the device does not confirm that it is at rest.
    fn stop(&mut self) -> Result<(), PluginError>;

    /// The levels of the input lines now.
    ///
    /// # Errors
    /// [`PluginError::Unsupported`] without input lines.
    fn read_inputs(&mut self) -> Result<DigitalInputs, PluginError> {
        Err(PluginError::unsupported("read its input lines"))
    }

    /// Sets the output lines: bit `n` is the level of line `n`.
    ///
    /// # Errors
    /// [`PluginError::Unsupported`] without output lines.
    fn write_outputs(&mut self, _levels: u64) -> Result<(), PluginError> {
        Err(PluginError::unsupported("set output lines"))
    }

    /// Hands the robot to its teach pendant (`on`) or takes it back, and reports where it is. Called again and again while the operator drives.
    ///
    /// # Errors
    /// [`PluginError::Unsupported`] without a pendant.
    fn jog(&mut self, _on: bool) -> Result<JogState, PluginError> {
        Err(PluginError::unsupported("be jogged from a pendant"))
    }

    /// Declares that the joints are at `joints` now, so that the controller counts from there. Nothing moves.
    ///
    /// # Errors
    /// [`PluginError::Unsupported`] where the controller cannot be informed.
    fn set_zero(&mut self, _joints: &JointVector) -> Result<(), PluginError> {
        Err(PluginError::unsupported("set its zero"))
    }

    /// What the motor of each joint reports of itself: temperature (degrees Celsius), load (fraction of full torque) and supply voltage (V), each
    /// NaN where a motor does not report it. Nothing moves.
    ///
    /// # Errors
    /// [`PluginError::Unsupported`] where the motors report none of this; when the device does not answer.
    fn read_motors(&mut self) -> Result<MotorState, PluginError> {
        Err(PluginError::unsupported("read its motors"))
    }
}
