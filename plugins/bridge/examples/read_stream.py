"""Reads a stream of a cell that runs, live: python3 read_stream.py cell.yaml arm/joints

    for fields in messages("cell.yaml", "arm/joints"):
        print(fields["time_ns"], fields["joints"])

It goes through `plumb streams --json`, which knows where the cell's shared memory is and how each message is laid out.
"""
import json
import subprocess
import sys

def messages(cell, stream, wait_s=60):
    """The fields of each message as it comes, until the run ends. Messages lost on the way are an error."""
    command = ["plumb", "streams", cell, stream, "--json", "--wait", str(wait_s)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        try:
            for line in program.stdout:
                message = json.loads(line)
                if "lost" in message:
                    raise RuntimeError(f"{message['lost']} messages of {stream} were lost")
                yield message["fields"]
        finally:
            program.terminate()
    if program.returncode not in (0, -15):
        raise RuntimeError(f"plumb streams ended with {program.returncode}")

if __name__ == "__main__":
    for fields in messages(*sys.argv[1:3]):
        print(fields["time_ns"], fields.get("joints"), flush=True)
