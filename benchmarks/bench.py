"""Runs the benchmarks, beside their peers in the same runs, and judges them by budgets.toml.

    make bench          all of them, several rounds each; writes RESULTS.md and its picture
    make bench-check    a short form of each; fails if a figure stays beyond its budget
    python benchmarks/bench.py [--check] [--rounds N] [--only machines,actions] [--write FOLDER]

A figure is the median of the rounds, its spread from the lowest to the highest. The noise of the
computer is how much longer than its quickest time a fixed piece of work took, between the
benchmarks: figures mean little where that is large. Ratios stand it best: peers run in turns.
"""

from __future__ import annotations

import argparse
import html
import json
import math
import os
import platform
import statistics
import subprocess
import sys
import time
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
ROOT = HERE.parent
TIME_LIMIT_S = 1800.0


@dataclass(frozen=True)
class Benchmark:
    """A program here: its arguments, those of its short form, and what it needs."""

    name: str
    arguments: tuple[str, ...] = ()
    short: tuple[str, ...] | None = ()
    needs: str = ""

    def missing(self) -> bool:
        """Return whether what it needs is absent."""
        return bool(self.needs) and not Path(self.needs).exists()


BENCHMARKS = (
    Benchmark("counts"),
    Benchmark("start", short=("--quick",)),
    Benchmark("machines", short=("--quick",)),
    Benchmark("actions", short=("--quick",)),
    Benchmark("scale"),
    Benchmark("durable", short=("--steps", "500", "--rounds", "3")),
    Benchmark("message_codecs"),
    Benchmark("petri_net_plans"),
    Benchmark("ros2_actions", short=("--quick",)),
    Benchmark("simulation", short=None),
    Benchmark("virtual_time", ("--rounds", "2"), short=None),
    Benchmark("reproduction", short=None),
    Benchmark("ros1_bridge", short=None, needs="/usr/bin/rosmaster"),
    Benchmark("viewer", short=None, needs="/usr/bin/chromium"),
)


@dataclass
class Figure:
    """One figure in several rounds, and its budget."""

    benchmark: str
    name: str
    budget: dict[str, Any]
    values: list[float] = field(default_factory=list)

    @property
    def median(self) -> float:
        """The median of the rounds."""
        return statistics.median(self.values)

    def holds(self, room: float = 1.0) -> bool:
        """Return whether the median is within `room` times the budget."""
        lowest = self.budget.get("at_least", -math.inf) / room
        return bool(lowest <= self.median <= self.budget.get("at_most", math.inf) * room)

    def fails(self) -> bool:
        """Return whether it is beyond its budget on any computer, however busy.

        On a shared computer, times of a program and its peer that ran by turns were 1.7 times
        apart from one minute to the next. A mistake that a robot feels makes a figure several
        times larger.
        """
        if self.budget.get("machine"):
            return False
        return not self.holds(2.0 if self.budget.get("timed") else 1.0)

    def limit(self) -> str:
        """Return the budget, and the goal behind it."""
        for name, sign in (("at_most", "≤"), ("at_least", "≥")):
            if name in self.budget:
                goal = f" (goal {self.budget['goal']:g})" if "goal" in self.budget else ""
                return f"{sign} {self.budget[name]:g}{goal}"
        return ""


def flat(found: dict[str, Any], prefix: str = "") -> dict[str, float]:
    """Return the numbers of nested dictionaries by dotted names."""
    result: dict[str, float] = {}
    for name, value in found.items():
        if isinstance(value, dict):
            result |= flat(value, "" if name == "figures" else f"{prefix}{name}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            result[f"{prefix}{name}"] = float(value)
    return result


def run(benchmark: Benchmark, *, short: bool) -> dict[str, float]:
    """Run a benchmark once and return its figures.

    Raises:
        SystemExit: it failed; with what it printed.
    """
    arguments = benchmark.short if short else benchmark.arguments
    command = [sys.executable, str(HERE / f"{benchmark.name}.py"), "--json", *(arguments or ())]
    done = subprocess.run(
        command, check=False, cwd=ROOT, capture_output=True, text=True, timeout=TIME_LIMIT_S
    )
    try:
        # Some say what is missing before, or end with 1 where one of their own limits is missed.
        found = flat(json.loads(done.stdout[done.stdout.index("{") :]))
    except ValueError:
        sys.exit(f"{benchmark.name}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    if benchmark.name == "actions":
        found["feedback / raw"] = found["feedback.per_s"] / found["feedback.raw_per_s"]
    return found


def noise() -> list[float]:
    """Return the times of a fixed piece of work [s]."""
    times = []
    for _ in range(20):
        begun = time.perf_counter()
        sum(i * i for i in range(100_000))
        times.append(time.perf_counter() - begun)
    return times


def measure(
    chosen: list[Benchmark], rounds: int, *, short: bool
) -> tuple[list[Figure], float, list[str]]:
    """Return the figures, the noise (median over lowest, less 1) and what was left out."""
    budgets = tomllib.loads((HERE / "budgets.toml").read_text(encoding="utf-8"))
    figures: dict[tuple[str, str], Figure] = {}
    left_out: list[str] = []
    times = noise()
    for benchmark in chosen:
        if benchmark.missing():
            left_out.append(f"{benchmark.name}: needs {benchmark.needs}")
            continue
        known = budgets.get(benchmark.name, {})
        for _ in range(rounds):
            print(f"{benchmark.name} ...", file=sys.stderr, flush=True)
            found = run(benchmark, short=short)
            times += noise()
            for name, value in found.items():
                key = (benchmark.name, name)
                figure = figures.setdefault(key, Figure(*key, known.get(name, {})))
                figure.values.append(value)
        absent = [name for name in known if (benchmark.name, name) not in figures]
        left_out += [f"{benchmark.name}: {name} was not measured" for name in absent]
    return list(figures.values()), statistics.median(times) / min(times) - 1.0, left_out


def table(figures: list[Figure], *, budgets_only: bool) -> list[str]:
    """Return the lines of a table in Markdown."""
    lines = [
        "| benchmark | figure | median | spread | budget | |",
        "| --- | --- | --: | --- | --- | --- |",
    ]
    for one in figures:
        if budgets_only and not one.budget:
            continue
        spread = f"{min(one.values):.4g} to {max(one.values):.4g}"
        verdict = "" if not one.budget else "holds" if one.holds() else "**missed**"
        if one.budget.get("machine") and verdict:
            verdict += ", by computer"
        lines.append(
            f"| {one.benchmark} | {one.name} | {one.median:.4g} | {spread} | {one.limit()} | "
            f"{verdict} |"
        )
    return lines


def plot(figures: list[Figure]) -> str:
    """Return a picture of each ratio as a share of its budget, with its spread."""
    shown = [one for one in figures if one.budget and not one.budget.get("machine")]
    shown = [one for one in shown if one.budget.get("at_most", 0) or one.budget.get("at_least", 0)]
    row, left, width = 22, 330, 420
    height = row * len(shown) + 50
    lines = [
        (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {left + width + 130} {height}" '
            'font-family="sans-serif" font-size="12">'
        ),
        (
            "<style>text{fill:#333}.a{stroke:#888}@media (prefers-color-scheme:dark)"
            "{text{fill:#ddd}.a{stroke:#777}}</style>"
        ),
        f'<text x="{left}" y="16">share of the budget (line: the budget)</text>',
    ]
    scale = width / 1.5

    def share(one: Figure, value: float) -> float:
        if "at_most" in one.budget:
            return min(float(value / one.budget["at_most"]), 1.5)
        return min(float(one.budget["at_least"] / max(value, 1e-9)), 1.5)

    for number, one in enumerate(shown):
        y = 28 + row * number
        colour = "#2a7f62" if one.holds() else "#c0392b"
        low, high = sorted((share(one, min(one.values)), share(one, max(one.values))))
        lines += [
            (
                f'<text x="{left - 8}" y="{y + 12}" text-anchor="end">'
                f"{html.escape(one.benchmark)}: {html.escape(one.name)}</text>"
            ),
            (
                f'<rect x="{left}" y="{y}" width="{share(one, one.median) * scale:.1f}" '
                f'height="14" fill="{colour}" opacity="0.75"/>'
            ),
            (
                f'<line class="a" x1="{left + low * scale:.1f}" x2="{left + high * scale:.1f}" '
                f'y1="{y + 7}" y2="{y + 7}" stroke-width="2"/>'
            ),
            (
                f'<text x="{left + width + 8}" y="{y + 12}">'
                f"{one.median:.3g} {html.escape(one.limit())}</text>"
            ),
        ]
    lines.append(
        f'<line class="a" x1="{left + scale:.1f}" x2="{left + scale:.1f}" '
        f'y1="22" y2="{height - 18}" stroke-dasharray="3 3"/></svg>'
    )
    return "\n".join(lines) + "\n"


def computer() -> str:
    """Return what the figures were measured on."""
    model = ""
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        model = names[0].partition(": ")[2] + ", " if names else ""
    return f"{model}{os.cpu_count()} cores, Python {platform.python_version()}, {platform.system()}"


def page(figures: list[Figure], noisy: float, left_out: list[str], rounds: int) -> str:
    """Return the page of results."""
    return "\n".join(
        [
            "# Performance",
            "",
            "<!-- Written by `make bench`; changes are lost. -->",
            "",
            "What is fast where a robot feels it: round trips of goals, preemption, thousands of",
            "goals at once, hours of virtual time. Each figure stands beside a peer that ran in",
            "turns with it in the same run, or is a count.",
            "",
            f"Measured on {computer()}; {rounds} round(s). Noise: a fixed piece of work took",
            f"{noisy:.0%} longer than its quickest time, in the median. `make bench` repeats this;",
            "`make bench-check` is the short form that CI runs.",
            "",
            "![Each ratio as a share of its budget](results.svg)",
            "",
            "## Figures with a budget",
            "",
            *table(figures, budgets_only=True),
            "",
            "The budgets are in `benchmarks/budgets.toml`.",
            *(["", "Not measured: " + "; ".join(left_out) + "."] if left_out else []),
            "",
            "## All figures",
            "",
            *table(figures, budgets_only=False),
            "",
        ]
    )


def check(chosen: list[Benchmark]) -> int:
    """Run the short forms; return 1 if a figure fails in three measurements of three."""
    figures, noisy, left_out = measure(chosen, 1, short=True)
    failed = {(one.benchmark, one.name): one for one in figures if one.fails()}
    for _ in range(2):
        names = {benchmark for benchmark, _ in failed}
        again, _, _ = measure([one for one in chosen if one.name in names], 1, short=True)
        failed = {
            key: one
            for one in again
            if (key := (one.benchmark, one.name)) in failed and one.fails()
        }
    print("\n".join(table(figures, budgets_only=True)))
    print(f"noise {noisy:.0%}")
    for line in left_out:
        print(line)
    for one in failed.values():
        print(
            f"{one.benchmark}: {one.name}: got {one.median:.4g}, and too much twice before; "
            f"expected {one.limit()}{', or twice that' if one.budget.get('timed') else ''}."
        )
    return 1 if failed else 0


def main() -> int:
    """Measure, print and write; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--check", action="store_true", help="short forms, against the budgets")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", help="names of benchmarks, with commas between them")
    parser.add_argument("--write", type=Path, help="folder for RESULTS.md and its picture")
    args = parser.parse_args()
    wanted = args.only.split(",") if args.only else [one.name for one in BENCHMARKS]
    if unknown := set(wanted) - {one.name for one in BENCHMARKS}:
        names = ", ".join(one.name for one in BENCHMARKS)
        parser.error(f"--only: got {sorted(unknown)}; expected some of {names}.")
    chosen = [one for one in BENCHMARKS if one.name in wanted]
    if args.check:
        return check([one for one in chosen if one.short is not None])
    figures, noisy, left_out = measure(chosen, args.rounds, short=False)
    print("\n".join(table(figures, budgets_only=False)))
    print(f"noise {noisy:.0%}")
    for line in left_out:
        print(line)
    if args.write:
        args.write.mkdir(parents=True, exist_ok=True)
        text = page(figures, noisy, left_out, args.rounds)
        (args.write / "RESULTS.md").write_text(text, encoding="utf-8")
        (args.write / "results.svg").write_text(plot(figures), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
