"""Would the tests notice? Change the meaning of one line at a time and run the tests that run it.

    python tests/tools/mutants.py [ROOM ...] [--sample 20] [--seed 1] [--most-tests 40]

A ROOM is a folder or a file, as `smachpy/engine`. Its candidates are comparisons, conditions, constants, removed
statements and removed locks; the seed chooses among them, so a sample can be repeated. Which test runs which line is
noted once for all rooms (with coverage's contexts, in `build/mutants`) and anew when a source has changed.

What survived is printed with its line; so is a line that no test runs. A change that means the same is no gap: it is
listed with its reason in `equivalent_mutants.toml`, and does not count. The exit code is 1 if the score of a room is
below `--goal`.
"""

from __future__ import annotations

import argparse
import ast
import copy
import hashlib
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from coverage.numbits import numbits_to_nums

ROOT = Path(__file__).resolve().parents[2]
WORK = ROOT / "build" / "mutants"
SOURCES = ("actionlib_core", "smachpy", "viz", "missions", "tests", "docs")
ROOMS = (
    "actionlib_core/goal",
    "actionlib_core/action",
    "smachpy/machines",
    "smachpy/engine",
    "smachpy/events",
    "smachpy/durable",
    "smachpy/testing/exploring",
)
QUICK = "not slow and not browser and not ros1 and not rclpy and not postgres"
TEST_S = 120.0
"""Time for the tests of one change [s]: a change that makes a loop endless is noticed by it."""

OPPOSITES: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE,
    ast.GtE: ast.Gt, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """One change of meaning: the text from `begin` to `end` (offsets in the file) becomes `new`."""

    path: str
    line: int
    begin: int
    end: int
    old: str
    new: str

    @property
    def key(self) -> str:
        """What names it in the list of equivalents: lines move, texts stay."""
        return f"{self.path}: {' '.join(self.old.split())} -> {' '.join(self.new.split())}"


def mutants_of(path: str) -> list[Mutant]:
    """Return all candidates of a file, in the order of the text."""
    text = (ROOT / path).read_text(encoding="utf-8")
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line.encode()))
    data = text.encode()

    def mutant(node: ast.expr | ast.stmt, new: str) -> Mutant:
        begin = starts[node.lineno - 1] + node.col_offset
        end = starts[(node.end_lineno or node.lineno) - 1] + (node.end_col_offset or 0)
        return Mutant(path, node.lineno, begin, end, data[begin:end].decode(), new)

    found = []
    for node in _meaningful(ast.parse(text)):
        found += [mutant(where, ast.unparse(new)) for where, new in _changes(node)]
    return sorted(found, key=lambda each: (each.begin, each.new))


def _meaningful(tree: ast.AST) -> Iterator[ast.AST]:
    """All nodes but docstrings, annotations and what only type checkers read."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            continue
        if isinstance(node, ast.arguments | ast.Import | ast.ImportFrom):
            continue
        yield node
        if isinstance(node, ast.AnnAssign):
            if node.value is not None:
                yield node.value
            continue
        yield from _meaningful(node)


def _changes(node: ast.AST) -> Iterator[tuple[ast.expr | ast.stmt, ast.AST]]:
    """Yield the nodes to replace within `node`, each with what stands there instead."""
    match node:
        case ast.Compare(ops=[op], left=left, comparators=[right]) if type(op) in OPPOSITES:
            yield node, ast.Compare(left, [OPPOSITES[type(op)]()], [right])
        case ast.BoolOp(op=op, values=values):
            yield node, ast.BoolOp(ast.Or() if isinstance(op, ast.And) else ast.And(), values)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield node, operand
        case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
            yield test, ast.UnaryOp(ast.Not(), test)
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() as op, right=right):
            yield node, ast.BinOp(left, ast.Sub() if isinstance(op, ast.Add) else ast.Add(), right)
        case ast.Return(value=ast.Constant(value=bool(value))):
            yield node, ast.Return(ast.Constant(not value))
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            yield node, ast.Constant(value + 1)
        case (
            ast.Raise()
            | ast.Expr(value=ast.Call())
            | ast.AugAssign()
            | ast.Delete()
            | ast.Assign(targets=[ast.Attribute() | ast.Subscript()])
        ):
            yield node, ast.Pass()
        case ast.With(items=items):
            for item in items:
                if "lock" in ast.unparse(item.context_expr):
                    free = ast.parse("__import__('contextlib').nullcontext()", mode="eval").body
                    yield item.context_expr, copy.deepcopy(free)
        case ast.Try(finalbody=[first, *_]):
            yield first, ast.Pass()


def tests_of_lines(packages: list[str]) -> sqlite3.Connection:
    """Run the default tests once, with the test's name as coverage's context; return its data."""
    state = hashlib.sha256()
    for folder in SOURCES:
        for path in sorted((ROOT / folder).rglob("*.py")):
            state.update(f"{path}".encode() + path.read_bytes())
    data = WORK / f"lines-{state.hexdigest()[:16]}"
    if not data.exists():
        WORK.mkdir(parents=True, exist_ok=True)
        for old in WORK.glob("lines-*"):
            old.unlink()
        print("which test runs which line: one run of the default tests ...", flush=True)
        covered = [f"--cov={package}" for package in packages]
        subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-n", "3", "--dist", "worksteal", "-m", QUICK,
             "--ignore=tests/docs", "--timeout", "600", "--cov-context=test", "--cov-report=", *covered],
            cwd=ROOT, env=os.environ | {"COVERAGE_FILE": str(data), "COVERAGE_CORE": "ctrace"},
            check=False,  # a test that fails under the tracer is no test of this line
        )  # fmt: skip
    return sqlite3.connect(data)


def tests_of(mutant: Mutant, lines: sqlite3.Connection, most: int) -> list[str]:
    """Return the tests that run the line of a change, those of its own room first."""
    rows = lines.execute(
        "select context.context, line_bits.numbits from line_bits"
        " join file on file.id = line_bits.file_id"
        " join context on context.id = line_bits.context_id where file.path = ?",
        (str(ROOT / mutant.path),),
    )
    tests = {
        context.partition("|")[0]
        for context, numbits in rows
        if context and mutant.line in numbits_to_nums(numbits)
    }
    words = set(Path(mutant.path).with_suffix("").parts)

    def near(test: str) -> tuple[int, str]:
        path = test.partition("::")[0]
        return -sum(word in path for word in words), hashlib.sha256(test.encode()).hexdigest()

    return sorted(tests, key=near)[:most]


def is_noticed(mutant: Mutant, tests: list[str]) -> bool:
    """Run the tests in a copy of the tree that has the change."""
    tree = WORK / "tree"
    file = tree / mutant.path
    original = (ROOT / mutant.path).read_bytes()
    file.write_bytes(original[: mutant.begin] + mutant.new.encode() + original[mutant.end :])
    paths = os.pathsep.join(str(tree / each) for each in (".", "viz", "missions"))
    command = [sys.executable, "-m", "pytest", "-q", "-x", "--timeout", "60", *tests]
    done = subprocess.Popen(
        command, cwd=tree, env=os.environ | {"PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"},
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    try:
        return done.wait(TEST_S) != 0
    except subprocess.TimeoutExpired:
        return True
    finally:
        if done.poll() is None:
            os.killpg(done.pid, signal.SIGKILL)
            done.wait()
        file.write_bytes(original)


def main() -> int:
    """Measure each room; return 1 if one is below the goal."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("rooms", nargs="*", metavar="ROOM", default=list(ROOMS))
    parser.add_argument("--sample", type=int, default=20, help="changes per room (20)")
    parser.add_argument("--seed", type=int, default=1, help="chooses the changes (1)")
    parser.add_argument("--most-tests", type=int, default=40, help="tests run per change (40)")
    parser.add_argument("--goal", type=float, default=95.0, help="score of each room [%%] (95)")
    options = parser.parse_args()
    same = tomllib.loads(
        (Path(__file__).parent / "equivalent_mutants.toml").read_text(encoding="utf-8")
    )
    lines = tests_of_lines(sorted({Path(room).parts[0] for room in ROOMS}))
    shutil.rmtree(WORK / "tree", ignore_errors=True)
    for folder in SOURCES:
        shutil.copytree(ROOT / folder, WORK / "tree" / folder, symlinks=True)
    for file in ("pyproject.toml", "README.md"):
        shutil.copy(ROOT / file, WORK / "tree" / file)
    below = False
    for room in options.rooms:
        place = ROOT / room
        files = [place] if place.is_file() else sorted(place.rglob("*.py"))
        all_ = [each for file in files for each in mutants_of(str(file.relative_to(ROOT)))]
        chosen = random.Random(f"{options.seed} {room}").sample(
            all_, min(options.sample, len(all_))
        )
        noticed, left, equal = 0, 0, 0
        for mutant in sorted(chosen, key=lambda each: (each.path, each.begin)):
            if mutant.key in same:
                equal += 1
                continue
            tests = tests_of(mutant, lines, options.most_tests)
            if tests and is_noticed(mutant, tests):
                noticed += 1
                continue
            left += 1
            why = f"{len(tests)} tests pass" if tests else "no test runs it"
            print(
                f"  {mutant.path}:{mutant.line}: {why}\n    {mutant.key.partition(': ')[2]}",
                flush=True,
            )
        score = 100.0 * noticed / max(1, noticed + left)
        below = below or score < options.goal
        print(
            f"{room}: {score:.0f} % noticed ({noticed} of {noticed + left}; {equal} equivalent; {len(all_)} candidates)",
            flush=True,
        )
    return 1 if below else 0


if __name__ == "__main__":
    sys.exit(main())
