"""A scale that reports its weight fifty times a second, as many balances do on their serial line: 100 g and 102 g in turn, settled from the 20th on. It weighs in
memory: replace `send_weights` by what reads yours."""
import threading
import time

import plumb_driver


class Scale(plumb_driver.Sensor):
    model, quantities = "A scale, in memory", {"weight": "g"}

    def __init__(self, config, host):
        super().__init__(config, host)
        self.weight = 100.0
        threading.Thread(target=self.send_weights, daemon=True).start()

    def send_weights(self):
        for number in range(10**9):
            self.weight = 100.0 + 2 * (number % 2)
            self.host.emit("weights", weight=self.weight, settled=int(number >= 20))
            time.sleep(0.02)

    def read(self, after_ns):
        return {"weight": (self.weight, 0.05)}     # the value, and its standard uncertainty


plumb_driver.run(Scale)
