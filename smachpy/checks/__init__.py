"""Static checks of a machine: what is certainly wrong with it, found without running it.

    report = smachpy.check(machine, properties=[never("ABORT"), before("UNDOCK", "DRIVE")])
    assert report.ok, report

A check takes milliseconds. Rules have ids (`RULES`), and are switched off with a reason: by
`ignore(state, rule, reason)`, by a comment `# smachpy: ignore[rule] reason` in the state's class or
function, by the argument `ignores`, or in pyproject.toml under [tool.smachpy.check].
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from smachpy.checks import facts
from smachpy.checks._core import graph as runs
from smachpy.checks._core import properties as properties_core
from smachpy.checks._core import structure, userdata
from smachpy.checks._core.model import Place as Place
from smachpy.checks._core.model import Problem as Problem
from smachpy.checks._core.model import Subject
from smachpy.checks._core.properties import Property as Property
from smachpy.checks._core.properties import PropertyError as PropertyError
from smachpy.checks._core.properties import after_preempt as after_preempt
from smachpy.checks._core.properties import always_reaches as always_reaches
from smachpy.checks._core.properties import before as before
from smachpy.checks._core.properties import never as never
from smachpy.checks._core.rules import RULES as RULES
from smachpy.checks.report import Report as Report
from smachpy.checks.suppression import Ignore as Ignore
from smachpy.checks.suppression import IgnoreError as IgnoreError
from smachpy.checks.suppression import ignore as ignore
from smachpy.container import Container
from smachpy.introspection import describe

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from smachpy.introspection import StateRecord

__all__ = [
    "RULES",
    "Ignore",
    "IgnoreError",
    "Place",
    "Problem",
    "Property",
    "PropertyError",
    "Report",
    "after_preempt",
    "always_reaches",
    "before",
    "check",
    "ignore",
    "never",
]


def check(
    machine: Container,
    *,
    properties: Iterable[Property | str] = (),
    ignores: Iterable[Ignore] = (),
    name: str | None = None,
) -> Report:
    """Look for everything that is certainly wrong with `machine`.

    Args:
        machine: Any container; it is not run.
        properties: What must hold for every run; as objects or texts ("never(/PATROL/ABORT)").
        ignores: Rules that are off, with reasons.
        name: Name of the machine in paths; default: its own.

    Raises:
        PropertyError: a property names a state or outcome that is not there.
        IgnoreError: a comment switches off a rule that is not there, or gives no reason.
    """
    begun = time.perf_counter()  # wall time of the check itself, no mission's time
    record = describe(machine, name=name)
    subject = Subject(record, facts.collect(machine, record))
    wanted = [properties_core.parse(p) if isinstance(p, str) else p for p in properties]
    problems = list(_consistency(machine, record))
    if not problems:
        graph = runs.build(subject)
        problems += structure.find(subject, graph)
        problems += userdata.find(subject, graph)
        found = (properties_core.find(subject, graph, one) for one in wanted)
        problems += [problem for problem in found if problem is not None]
    kept, off = _sort_out(problems, subject, tuple(ignores))
    return Report(record, kept, off, time.perf_counter() - begun)


def _consistency(machine: Container, record: StateRecord) -> Iterator[Problem]:
    for path, container in _containers(machine, record.path):
        for text in container.find_problems(path):
            rule = "unmapped-outcome" if "outcome has no transition" in text else "inconsistent"
            yield Problem(rule, RULES[rule].severity, text.partition(": ")[0], text)


def _containers(machine: Container, path: str) -> Iterator[tuple[str, Container]]:
    yield path, machine
    for label, child in machine.get_children().items():
        if isinstance(child, Container):
            yield from _containers(child, f"{path}/{label}")


def _sort_out(
    problems: list[Problem], subject: Subject, ignores: tuple[Ignore, ...]
) -> tuple[tuple[Problem, ...], tuple[tuple[Problem, str], ...]]:
    """Part what is switched off from the rest."""
    kept: list[Problem] = []
    off: list[tuple[Problem, str]] = []
    for problem in problems:
        known = subject.facts.get(problem.path)
        reason = None if known is None else known.ignored.get(problem.rule)
        reasons = [reason] if reason else [i.reason for i in ignores if i.covers(problem)]
        if reasons:
            off.append((problem, reasons[0]))
        else:
            kept.append(problem)
    return tuple(kept), tuple(off)
