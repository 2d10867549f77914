"""A gauge on a serial line, through pyserial: it answers `?` with its height in mm, as `12.503`."""
import plumb_driver
import serial

class Gauge(plumb_driver.Sensor):
    model, quantities = "Digital gauge on a serial line", {"height": "mm"}

    def __init__(self, config, host):
        super().__init__(config, host)
        try:
            self.line = serial.Serial(config["port"], config.get("baud", 9600), timeout=2)
        except serial.SerialException as error:
            raise plumb_driver.Disconnected(f"{config['port']} cannot be opened: {error}")

    def read(self, after_ns):
        self.line.reset_input_buffer()            # nothing from before the arm was at rest
        self.line.write(b"?\r")
        answer = self.line.read_until(b"\r")
        if not answer.endswith(b"\r"):
            raise plumb_driver.TimedOut("the gauge does not answer within 2 s: is it switched on, and the baud rate right?")
        try:
            return {"height": (float(answer), 0.005)}
        except ValueError:
            raise plumb_driver.DriverError(f"the gauge answered {answer!r}, which is no height")

    def close(self):
        self.line.close()

plumb_driver.run(Gauge)
