"""A sensor that measures a height. It makes its readings up: replace read by what reads yours."""
import plumb_driver


class {Type}(plumb_driver.Sensor):
    model, quantities = "{name}, made up", {"height": "mm"}

    def __init__(self, config, host):
        """Connects. config is what the cell file gives under `config:`, as plugin.yaml allows it."""
        super().__init__(config, host)

    def read(self, after_ns):
        """Measures now: a reading is never older than after_ns, because the arm may have moved since. None means nothing is there yet."""
        return {"height": (12.5, 0.01)}  # the value, and its standard uncertainty


plumb_driver.run({Type})
