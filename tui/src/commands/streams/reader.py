

class Lost(RuntimeError):
    """Messages came faster than they were read, and some are gone."""


class NotRunning(RuntimeError):
    """Nobody runs the cell."""


def is_running():
    """Whether somebody runs the cell now: then the lock is held."""
    try:
        with open(LOCK, encoding="utf-8") as lock:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except BlockingIOError:
        return True
    return False


def decode(stream, payload):
    """A message from its bytes: an object with the fields of its layout. What follows them is its `tail`: the pixels of a picture, the points of a stripe,
    all behind `sequence` where only the plugin knows the layout."""
    layout, record = STREAMS[stream][1:3]
    if len(payload) < ctypes.sizeof(layout):
        raise ValueError(f"a message of {stream} has {len(payload)} bytes; {layout.__name__} has {ctypes.sizeof(layout)}")
    message = layout.from_buffer_copy(payload)
    rest = payload[ctypes.sizeof(layout):]
    if record is None:
        message.tail = rest
    else:
        message.tail = list((record * message.count).from_buffer_copy(rest))
    return message


class Reader:
    """The messages of one stream as they come, until the run ends. What was sent before it was opened is left out.

        with Reader("arm/joints") as reader:
            for message in reader: ...
    """

    def __init__(self, stream, wait_s=60.0):
        """Waits so long for a run of the cell to begin."""
        if stream not in STREAMS:
            raise KeyError(f"cell {CELL} has no stream '{stream}'; it has {', '.join(STREAMS)}")
        import importlib.metadata
        installed = importlib.metadata.version("iceoryx2")
        if installed != ICEORYX2:
            raise ImportError(f"iceoryx2 {installed} is installed; the cell's shared memory is that of {ICEORYX2}: pip install iceoryx2=={ICEORYX2}")
        import iceoryx2
        self.stream, self._iceoryx2 = stream, iceoryx2
        self._node = self._service = self._port = None
        self._last = {}                                # the number of the last message, by sender
        given_up = time.monotonic() + wait_s
        while not self._open():
            if time.monotonic() >= given_up:
                self.close()
                raise NotRunning(f"nobody runs {CELL_FILE}, or {stream} is not there yet: start it with `plumb run`")
            time.sleep(0.1)

    def _open(self):
        if not is_running() or not os.path.isdir(ROOT):
            return False
        bus = self._iceoryx2
        bus.set_log_level(bus.LogLevel.Fatal)          # a stream that is not there yet is no mistake
        if self._node is None:
            config = bus.config.default()
            config.global_cfg.prefix, config.global_cfg.root_path = bus.FileName.new(PREFIX), bus.Path.new(ROOT)
            node = bus.NodeBuilder.new().name(bus.NodeName.new("python")).config(config)
            self._node = node.signal_handling_mode(bus.SignalHandlingMode.Disabled).create(bus.ServiceType.Ipc)
        service, message = STREAMS[self.stream][0], STREAMS[self.stream][3]
        layout = bus.AttributeVerifier.new().require(bus.AttributeKey.new("message"), bus.AttributeValue.new(message))
        builder = self._node.service_builder(bus.ServiceName.new(service)).publish_subscribe(bus.Slice[ctypes.c_uint64])
        try:
            self._service = builder.open_with_attributes(layout)
        except bus.PublishSubscribeOpenError as error:
            if "DoesNotExist" in str(error):
                return False
            raise
        self._port = self._service.subscriber_builder().history_request(0).create()
        return True

    def next(self, within_s=None):
        """The next message; None when none comes in time, or the run has ended."""
        given_up = None if within_s is None else time.monotonic() + within_s
        looked = time.monotonic()
        while True:
            sample = self._port.receive()
            if sample is not None:
                words = sample.payload()
                payload = ctypes.string_at(words.as_ptr(), 8 * words.len())
                sender = str(sample.header.publisher_id)
                sample.delete()                        # one is lent at a time
                return self._counted(decode(self.stream, payload), sender)
            now = time.monotonic()
            if given_up is not None and now >= given_up:
                return None
            if now - looked > 0.1:
                looked = now
                if not is_running():
                    return None
            time.sleep(0.001)

    def _counted(self, message, sender):
        before = self._last.get(sender)
        self._last[sender] = message.sequence
        lost = 0 if before is None else message.sequence - before - 1
        if lost:
            raise Lost(f"{lost} messages of {self.stream} were lost")
        return message

    def __iter__(self):
        while (message := self.next()) is not None:
            yield message

    def close(self):
        """Leaves the cell's shared memory. The last to leave after a run removes it."""
        if self._port is not None:
            self._port.delete()
        config = self._node.config if self._node is not None else None
        self._port = self._service = self._node = None   # nothing else holds on to them: now this process has left
        if config is not None and not is_running():
            _tidy(self._iceoryx2, config)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def _tidy(bus, config):
    """Removes what the run left to the last that used it, unless another process still does, or the cell is run again."""
    with open(LOCK, "a", encoding="utf-8") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return
        nodes = bus.Node.list(bus.ServiceType.Ipc, config)
        if not any(isinstance(node, bus.NodeState.Alive) for node in nodes):
            for name in os.listdir("/dev/shm"):
                if name.startswith(PREFIX):
                    os.remove(os.path.join("/dev/shm", name))
            shutil.rmtree(ROOT, ignore_errors=True)
        os.remove(LOCK)


def main():
    if len(sys.argv) != 2:
        print(f"python3 {sys.argv[0]} STREAM, one of:\n  " + "\n  ".join(STREAMS))
        return 2
    try:
        with Reader(sys.argv[1]) as reader:
            for message in reader:
                fields = {name: getattr(message, name) for name, *_ in message._fields_ if name != "reserved"}
                print(json.dumps({name: list(value) if isinstance(value, JointVector) else value for name, value in fields.items()}), flush=True)
    except (KeyError, ImportError, NotRunning, Lost) as error:
        print(error.args[0], file=sys.stderr)
        return 1
    except (KeyboardInterrupt, BrokenPipeError):
        pass
    return 0


if __name__ == "__main__":
    sys.exit(main())
