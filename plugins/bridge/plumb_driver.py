"""Drivers for plumb in Python, with the standard library alone: protocol 1 of plugins/bridge/README.md.

    class Gauge(plumb_driver.Sensor):
        model, quantities = "My gauge", {"height": "mm"}
        def read(self, after_ns):
            return {"height": (12.5, 0.01)}      # the value, and its standard uncertainty

    plumb_driver.run(Gauge)

Calls come one at a time on the main thread. Lengths are mm, angles rad, times s, or ns of the cell's clock where a name ends in _ns.
What a driver prints goes to plumb's log. Any exception is an error for the operator; those below say more exactly what happened.
"""
import json, os, queue, sys, threading, time, traceback
class DriverError(Exception): kind = "failed"
class Refused(DriverError): kind = "refused"              # the configuration or an argument cannot be used; say what would be right
class OutOfRange(DriverError): kind = "out_of_range"
class Unsupported(DriverError): kind = "unsupported"
class Stopped(DriverError): kind = "stopped"              # a stop ended it; the robot is at rest
class NotReady(DriverError): kind = "not_ready"
class Disconnected(DriverError): kind = "disconnected"
class TimedOut(DriverError): kind = "timed_out"
class InputLost(DriverError): kind = "input_lost"         # messages of an input were lost
_KINDS = {error.kind: error for error in DriverError.__subclasses__()}

class Host:
    """What plumb offers a driver. Every method may be called from any thread."""

    def __init__(self, source, sink):
        self._source, self._sink = source, sink
        self._calls, self._answers = queue.Queue(), queue.Queue()
        self._stop, self._writing, self._asking = threading.Event(), threading.Lock(), threading.Lock()
        threading.Thread(target=self._listen, daemon=True).start()

    def log(self, text, level="info"):           # error, warn, info or debug
        self._send(log=level, text=str(text))

    def now_ns(self):                             # the cell's clock, with which everything is dated
        return self._ask(ask="now_ns")

    def should_stop(self):                        # look at least every 50 ms in a call that takes long
        return self._stop.is_set()

    def wait(self, seconds):                      # raises Stopped when a stop is asked for
        if self._stop.wait(seconds):
            raise Stopped("stopped")

    def emit(self, stream, **message):            # on a stream of plugin.yaml: the fields of its layout, or hex="..." for one of your own
        message.setdefault("time_ns", self.now_ns())
        self._send(emit=stream, message=message)

    def receive(self, name):                      # the next message of a wired input, or None
        return self._ask(ask="receive", input=name)

    def progress(self, fraction, text=""): self._send(progress=fraction, text=text)

    def _send(self, **message):
        line = json.dumps(message, allow_nan=False, default=float)
        with self._writing:
            self._sink.write(line + "\n")
            self._sink.flush()

    def _ask(self, **question):
        with self._asking:
            self._send(**question)
            answer = self._answers.get()
        if "error" in answer:
            raise _KINDS.get(answer.get("kind"), DriverError)(answer["error"])
        return answer["answer"]

    def _listen(self):
        for line in self._source:
            message = json.loads(line)
            if "stop" in message:
                self._stop.set() if message["stop"] else self._stop.clear()
            if "call" in message:
                self._calls.put(message)
            elif "answer" in message or "error" in message:
                self._answers.put(message)
        self._stop.set()                          # plumb is gone: come to rest, close, and end
        self._calls.put({"call": "close"})
        time.sleep(2)
        os._exit(1)

class Robot:
    """A robot. describe, read_joints, move_joints and stop must be there; what a method does not do it leaves as it is here."""
    def __init__(self, config, host): self.config, self.host = config, host     # connects; nothing moves
    def activate(self): pass                      # makes ready to move
    def deactivate(self): pass
    def read_inputs(self): raise Unsupported("this device cannot read its input lines")
    def write_outputs(self, levels): raise Unsupported("this device cannot set output lines")
    def jog(self, on): raise Unsupported("this device cannot be jogged from a pendant")       # as read_joints, or {"joints": [..], "key": 3, "finished": 1}
    def set_zero(self, joints): raise Unsupported("this device cannot set its zero")
    def read_motors(self): raise Unsupported("this device cannot read its motors")            # {"temperature": [..], "load": [..], "voltage": [..]}
    def close(self): pass
class Sensor:
    """A sensor. model, quantities and read must be there. read gives {name: value or (value, standard uncertainty)}, or None."""
    model, quantities, switches = "", {}, False
    def __init__(self, config, host): self.config, self.host = config, host
    def describe(self):
        quantities = [{"name": name, "unit": unit} for name, unit in self.quantities.items()]
        return {"model": self.model, "switches": self.switches, "quantities": quantities}
    def configure(self, settings): raise Unsupported("this device cannot be configured while it runs")
    def arm(self): pass
    def poll(self): pass
    def close(self): pass

def end_of(motion, joints):
    """Where the joints end when the motion that move_joints is given starts at these. A joint that takes no part stays; its target is no number."""
    takes_part = [motion["joint_mask"] >> index & 1 for index in range(len(joints))]
    return [(target + at if motion["relative"] else target) if moves else at
            for moves, target, at in zip(takes_part, motion["target"], joints)]

def _answer(host, device, name, arguments):
    """The answer to a call. A reading is dated before it is taken, a move after it has ended."""
    time_ns = host.now_ns() if name.startswith("read") or name == "jog" else 0
    answer = getattr(device, name)(*arguments)
    if name == "read" and answer is not None and not {"quantities", "edges"} & set(answer):
        pairs = {key: value if isinstance(value, (tuple, list)) else (value, 0) for key, value in answer.items()}
        quantities = [{"name": key, "value": float(value), "standard_uncertainty": float(u)} for key, (value, u) in pairs.items()]
        return {"time_ns": time_ns, "quantities": quantities}
    if name in ("read_joints", "move_joints", "read_inputs", "jog", "read_motors"):
        answer = answer if isinstance(answer, dict) else {"joints": [float(joint) for joint in answer]}
        answer = {"time_ns": time_ns or host.now_ns(), **answer}
    if name == "move_joints":                     # anyone who listens to its streams learns that the move has ended
        host.emit("joints", **{**answer, "moving": 0})
        if type(device).read_inputs is not Robot.read_inputs:
            host.emit("inputs", changed=0, **device.read_inputs())
    return answer

def run(driver):
    """Serves a driver, a class of Robot or Sensor, until plumb is done with it."""
    sink = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)                                 # what is printed goes to the log, not between the messages
    sys.stdout.reconfigure(line_buffering=True)
    host, device, name = Host(sys.stdin, sink), None, ""
    while name != "close":
        message = host._calls.get()
        name, arguments = message["call"], message.get("arguments", [])
        try:
            if name == "create":
                device = driver(arguments[0], host)
                host._send(done=device.describe())
            else:
                host._send(done=_answer(host, device, name, arguments))
        except DriverError as error:
            host._send(error=str(error) or type(error).__name__, kind=error.kind)
        except BrokenPipeError:
            os._exit(1)                           # plumb is gone
        except Exception as error:
            traceback.print_exc()
            host._send(error=f"{type(error).__name__}: {error}", kind="failed")
