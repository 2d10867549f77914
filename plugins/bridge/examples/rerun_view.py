"""Shows what a cell's devices emit, live in the viewer of rerun: python3 rerun_view.py cell.yaml

    pip install rerun-sdk
    python3 rerun_view.py cell.yaml                     opens the viewer
    python3 rerun_view.py cell.yaml --save run.rrd      a file for it in place of a window

Every number of every message is a curve over the cell's time, under its stream's name: arm/joints/joints/0 is the first joint, rad (mm of a slide).
"""
import argparse
import json
import subprocess

import rerun

def numbers(name, value):
    """Each number in a message with its path."""
    if isinstance(value, bool) or isinstance(value, (int, float)):
        yield name, float(value)
    elif isinstance(value, list):
        for place, one in enumerate(value):
            yield from numbers(f"{name}/{place}", one)
    elif isinstance(value, dict):
        for key, one in value.items():
            if key not in ("time_ns", "sequence", "count"):
                yield from numbers(f"{name}/{key}", one)

def show(cell, wait_s):
    """Logs each message as it comes, until the run ends; how many there were, and how many came too fast to be shown."""
    shown, lost = 0, 0
    command = ["plumb", "streams", cell, "all", "--json", "--wait", str(wait_s)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        for line in program.stdout:
            message = json.loads(line)
            if "lost" in message:
                lost += message["lost"]
                continue
            rerun.set_time("cell", duration=message["fields"]["time_ns"] * 1e-9)
            for path, value in numbers(message["stream"], message["fields"]):
                rerun.log(path, rerun.Scalars(value))
            shown += 1
    if program.returncode != 0:
        raise SystemExit(f"plumb streams ended with {program.returncode}")
    return shown, lost

if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("cell")
    arguments.add_argument("--save", metavar="FILE.rrd")
    arguments.add_argument("--wait", metavar="SECONDS", type=float, default=60)
    given = arguments.parse_args()
    rerun.init("plumb", spawn=not given.save)
    if given.save:
        rerun.save(given.save)
    print("%d messages shown, %d came too fast" % show(given.cell, given.wait))
