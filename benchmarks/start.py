"""What it costs to start: `import smachpy` beside SMACH's import, `smachpy --help` beside Python's.

    python benchmarks/start.py [--json] [--quick]

Figures are CPU time of a child process less that of one that does nothing; the quickest of several,
as a busy computer only adds. The candidates take turns.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys

# Users have cached bytecode, also where the environment says to write none.
ENVIRONMENT = {name: v for name, v in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
CODES = {
    "nothing": "pass",
    "smachpy": "import smachpy",
    "smach": "import threading; threading.Thread.isAlive = threading.Thread.is_alive; import smach",
    "help": "import sys, smachpy_programs as p; sys.argv = ['smachpy', '--help']; p.smachpy()",
}


def cpu_ms(code: str) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-c", code]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=ENVIRONMENT)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) * 1e3


def figures(rounds: int) -> dict[str, float]:
    times: dict[str, list[float]] = {name: [] for name in CODES}
    for code in CODES.values():
        cpu_ms(code)  # once for the bytecode
    for _ in range(rounds):
        for name, code in CODES.items():
            times[name].append(cpu_ms(code))
    best = {name: min(values) for name, values in times.items()}
    nothing = best.pop("nothing")
    found = {f"{name}: CPU ms": value - nothing for name, value in best.items()}
    found["nothing: CPU ms"] = nothing
    found["import smachpy / import smach"] = found["smachpy: CPU ms"] / found["smach: CPU ms"]
    found["smachpy --help / python"] = best["help"] / nothing
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--quick", action="store_true")
    args = parser.parse_args()
    found = figures(5 if args.quick else 15)
    if args.json:
        print(json.dumps(found))
        return 0
    for name, value in found.items():
        print(f"{name:32} {value:8.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
