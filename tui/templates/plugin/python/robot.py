"""A robot of two joints, one that turns and one that slides. It moves in memory: replace what touches self.joints by what talks to yours."""
import math

import plumb_driver

STEP_S = 0.02                      # between two looks at a stop; the contract wants at least every 0.05 s
MAX_SPEED = [1.0, 100.0]           # rad/s, mm/s


class {Type}(plumb_driver.Robot):
    def __init__(self, config, host):
        """Connects. Nothing moves. config is what the cell file gives under `config:`, as plugin.yaml allows it."""
        super().__init__(config, host)
        self.joints = [0.0, 0.0]   # rad, mm

    def describe(self):
        return {
            "model": "{name}, in memory",
            "joints": [
                {"name": "waist", "unit": "rad", "lower": math.radians(-90), "upper": math.radians(90), "resolution": 1e-4, "max_speed": MAX_SPEED[0], "home": 0},
                {"name": "slide", "unit": "mm", "lower": 0, "upper": 200, "resolution": 0.01, "max_speed": MAX_SPEED[1], "home": 0},
            ],
            "capabilities": {"interruptible": True, "stop_time_ms": 50},
        }

    def read_joints(self):
        return self.joints

    def move_joints(self, motion):
        """Moves, and returns when it is at rest at its target. plumb has checked the limits."""
        start, end = self.joints, plumb_driver.end_of(motion, self.joints)
        way = [b - a for a, b in zip(start, end)]
        seconds = max(abs(part) / speed for part, speed in zip(way, MAX_SPEED)) / motion["speed_fraction"]
        steps = max(1, math.ceil(seconds / STEP_S))
        for step in range(1, steps + 1):
            self.host.wait(STEP_S)  # raises Stopped when a stop is asked for: command your controller to stop before that
            self.joints = [a + part * step / steps for a, part in zip(start, way)]
            self.host.emit("joints", joints=self.joints, moving=1)
        self.joints = end
        return self.joints

    def stop(self):
        """Brings it to rest, now."""


plumb_driver.run({Type})
