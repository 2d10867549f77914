"""A positioner of ophyd as a robot of one joint. This one is simulated; an EpicsMotor goes the same way."""
import plumb_driver
from ophyd import SoftPositioner

LIMITS_MM = (0.0, 100.0)

class Axis(plumb_driver.Robot):
    def __init__(self, config, host):
        super().__init__(config, host)
        self.axis = SoftPositioner(name="slide", egu="mm", limits=LIMITS_MM, init_pos=0.0)

    def describe(self):
        slide = {"name": "slide", "unit": "mm", "lower": LIMITS_MM[0], "upper": LIMITS_MM[1], "resolution": 0.001, "max_speed": 10, "home": 0}
        return {"model": "ophyd SoftPositioner", "joints": [slide], "capabilities": {"interruptible": True, "stop_time_ms": 100}}

    def read_joints(self):
        return {"joints": [self.axis.position], "moving": int(self.axis.moving)}

    def move_joints(self, motion):
        self.host.wait(0)                         # after a stop nothing moves
        status = self.axis.move(plumb_driver.end_of(motion, [self.axis.position])[0], wait=False)
        try:
            while not status.done:
                self.host.emit("joints", joints=[self.axis.position], moving=1)
                self.host.wait(0.02)
        except plumb_driver.Stopped:
            self.axis.stop()
            raise
        if not status.success:
            raise plumb_driver.DriverError(f"the axis did not arrive: {status}")
        return [self.axis.position]

    def stop(self):
        self.axis.stop()

plumb_driver.run(Axis)
