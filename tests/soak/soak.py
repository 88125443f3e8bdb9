"""The long campaign: what is promised is attacked until the goals are sent, and its figures printed.

python tests/soak/soak.py [--goals 20000] [--seconds 150] [--seed 1] [--keep DIRECTORY]
"""

from __future__ import annotations

import argparse
import signal
import sys
from pathlib import Path

import goals
import machines


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--goals", type=int, default=20_000, help="sent between processes, about")
    parser.add_argument("--seconds", type=float, default=150.0, help="for random machines")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="where the journals of the processes go")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended by SIGTERM"))
    print(f"goals between processes, seed {options.seed}:")
    judge = goals.main(options.goals, options.seed, keep=options.keep)
    goals.print_figures(judge)
    figures = machines.main(options.seconds, options.seed)
    return 1 if judge.problems or figures.problems else 0


if __name__ == "__main__":
    sys.exit(main())
