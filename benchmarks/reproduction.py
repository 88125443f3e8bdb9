"""What it costs to run a recorded hour of patrol again.

The patrol is recorded with the simulated robot in virtual time. Then it is reproduced as a user
does it: `smachpy runs reproduce` in a process of its own, with its start and the reading of the
file. All is in CPU time.

    python benchmarks/reproduction.py [--rounds 45] [--json]
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from smachpy.events.recording import read_recording

# Users have cached bytecode, also where the environment says to write none.
ENVIRONMENT = {name: v for name, v in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def smachpy(*words):
    """Run a command to its end; return its CPU time [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", "smachpy", *words]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=ENVIRONMENT)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=45, help="of the patrol: 45 are an hour")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        file = str(Path(folder, "hour.jsonl"))
        run = ["run", "patrol", "--time", "virtual", "--plain", "--out", folder, "--record", file]
        smachpy(*run, "--input", f"rounds={args.rounds}")
        again = min(smachpy("runs", "reproduce", file) for _ in range(2))
        events = read_recording(file, plots=False).events
        hours = (events[-1]["t"] - events[0]["t"]) / 3600.0
        size = Path(file).stat().st_size / 1e6
    figures = {"patrol: CPU s per h": again / hours, "patrol: MB per h": size / hours}
    if args.json:
        print(json.dumps(figures, indent=2))
    else:
        for name, value in figures.items():
            print(f"{name:30} {value:10.4g}")


if __name__ == "__main__":
    main()
