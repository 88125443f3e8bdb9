"""A hundred seeds of every mission's tests, twice: is every verdict the same both times?

Takes the missions of the entry-point group `smachpy.missions`, as pyproject.toml has them, and the
files under tests/missions that import one of them. Tests without the `mission` fixture have no
seed and are left out; a test that took longer than `--longest` seconds of the processor runs with
no further seed, and is counted as such.

    python benchmarks/seeds.py [--seeds 100] [--longest 0.5] [--only patrol] [--json]
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import re
import sys
import time
import tomllib
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
GROUP = "smachpy.missions"
MODULE = re.compile(r"^\s*(?:from|import) (smachpy_missions[\w.]+)", re.MULTILINE)


class Verdicts:
    """Keeps the verdict of every test of a session; runs only what has a seed and is quick."""

    def __init__(self, longest):
        self.found = {}
        self.long = set()
        self._longest = longest

    def pytest_collection_modifyitems(self, config, items):
        del config
        items[:] = [item for item in items if "mission_seed" in item.fixturenames]

    def pytest_runtest_setup(self, item):
        if self._name(item.nodeid) in self.long:
            pytest.skip("takes too long to be repeated")

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item):
        begun = time.process_time()  # the computer may be busy with others
        try:
            return (yield)
        finally:
            if time.process_time() - begun > self._longest:
                self.long.add(self._name(item.nodeid))

    def pytest_runtest_logreport(self, report):
        if report.when == "call" or report.outcome == "failed":
            self.found[report.nodeid] = (report.outcome, self._reason(report))

    @staticmethod
    def _name(nodeid):
        return re.sub(r"seed\d+", "", nodeid)

    @staticmethod
    def _reason(report):
        """Return why it failed, without what differs between two runs of one program."""
        crash = getattr(report.longrepr, "reprcrash", None)
        return re.sub(r"0x[0-9a-f]+|/tmp/\S+", "...", crash.message if crash else "")


def missions():
    """Return name -> module of every mission."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        points = tomllib.load(file)["project"]["entry-points"][GROUP]
    return {name: value.partition(":")[0] for name, value in points.items()}


def test_files(modules):
    """Return test file -> the missions' modules that it imports."""
    found = {}
    for file in sorted((ROOT / "tests" / "missions").glob("test_*.py")):
        used = set(MODULE.findall(file.read_text("utf-8"))) & set(modules)
        if used:
            found[file] = used
    return found


def run(file, seeds, longest):
    """Run the tests of a file with many seeds; return the verdicts."""
    verdicts = Verdicts(longest)
    options = ["-q", "-p", "no:cacheprovider", "-n0", "--tb=short", f"--mission-seeds={seeds}"]
    with contextlib.redirect_stdout(io.StringIO()) as said:
        code = pytest.main([*options, str(file)], plugins=[verdicts])
    if code not in {pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED, 5}:
        raise RuntimeError(f"{file.name}: pytest ended with {code}:\n{said.getvalue()}")
    return verdicts


def compare(file, seeds, longest):
    """Run a file twice; return its row."""
    begun = time.perf_counter()
    first, second = run(file, seeds, longest), run(file, seeds, longest)
    both = first.found.keys() & second.found.keys()
    different = sorted(test for test in both if first.found[test] != second.found[test])
    count = Counter(outcome for outcome, _ in first.found.values())
    return {
        "runs": len(both),
        "tests": len({Verdicts._name(test) for test in both}),
        "first seed only": len(first.long | second.long),
        "different": different,
        "failed": sorted(test for test, verdict in first.found.items() if verdict[0] == "failed"),
        "skipped": count["skipped"],
        "seconds": time.perf_counter() - begun,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--longest", type=float, default=0.5, help="of a test that is repeated [s]")
    parser.add_argument("--only", action="append", help="a mission, or a part of its name")
    parser.add_argument("--json", action="store_true", help="print JSON")
    args = parser.parse_args()
    wanted = {
        name: module
        for name, module in missions().items()
        if not args.only or any(part in name for part in args.only)
    }
    files = test_files(wanted.values())
    rows, broken = {}, []
    for file in files:
        try:
            rows[file.name] = row = compare(file, args.seeds, args.longest)
        except RuntimeError as error:
            broken.append(file.name)
            print(error, file=sys.stderr)
            continue
        if not args.json:
            print(
                f"{file.name:28} {row['tests']:4} tests {row['runs']:6} runs  "
                f"{len(row['different'])} different  {len(row['failed'])} failed  "
                f"{row['first seed only']} with one seed  {row['seconds']:.0f} s",
                flush=True,
            )
            for test in (*row["different"], *row["failed"])[:10]:
                print(f"    {test}")
    covered = set().union(*files.values()) if files else set()
    without = sorted(name for name, module in wanted.items() if module not in covered)
    if args.json:
        print(json.dumps({"files": rows, "without tests": without}, indent=2))
    elif without:
        print(f"no test imports: {', '.join(without)}")
    different = any(row["different"] for row in rows.values())
    return 1 if without or broken or different else 0


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    sys.exit(main())
