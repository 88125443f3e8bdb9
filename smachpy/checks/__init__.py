"""Static checks of a machine: they find definite mistakes without running it.

    report = smachpy.check(machine, properties=[never("ABORT"), before("UNDOCK", "DRIVE")])
    report.assert_ok()

A check takes milliseconds. Rules have ids (`RULES`); a few are off unless the argument `enable`
names them. A rule is switched off, with a reason, by `ignore(state, rule, reason)`, by a comment
`# smachpy: ignore[rule] reason` in the state's class or function, by the argument `ignores`, or in
pyproject.toml under [tool.smachpy.check].
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from smachpy.base.problems import Problems
from smachpy.checks import facts, graph, structure, userdata
from smachpy.checks import properties as properties_of_runs
from smachpy.checks.model import RULES as RULES
from smachpy.checks.model import Place as Place
from smachpy.checks.model import Problem as Problem
from smachpy.checks.properties import Property as Property
from smachpy.checks.properties import PropertyError as PropertyError
from smachpy.checks.properties import after_any_end as after_any_end
from smachpy.checks.properties import after_preempt as after_preempt
from smachpy.checks.properties import always_reaches as always_reaches
from smachpy.checks.properties import before as before
from smachpy.checks.properties import never as never
from smachpy.checks.report import Report as Report
from smachpy.checks.suppression import Ignore as Ignore
from smachpy.checks.suppression import IgnoreError as IgnoreError
from smachpy.checks.suppression import check_rule
from smachpy.checks.suppression import ignore as ignore
from smachpy.events.introspection import describe
from smachpy.machines.container import allow_depth

if TYPE_CHECKING:
    from collections.abc import Iterable

    from smachpy.machines.container import Container

__all__ = [
    "RULES",
    "Ignore",
    "IgnoreError",
    "Place",
    "Problem",
    "Property",
    "PropertyError",
    "Report",
    "after_any_end",
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
    enable: Iterable[str] = (),
    name: str | None = None,
) -> Report:
    """Check a machine for definite mistakes.

    Args:
        machine: Any container; it is not run.
        properties: Properties of every run, as objects or texts ("never(/PATROL/ABORT)").
        ignores: Rules to switch off, with reasons.
        enable: Rules to switch on that are off by default ("no-timeout").
        name: Name of the machine in paths; default: its own.

    Raises:
        InvalidStateError: one of the lists is none.
        InconsistentMachineError: its containers are nested too deeply to be run.
        PropertyError: a property names a state or outcome that does not exist.
        IgnoreError: a comment switches off a rule that does not exist, or gives no reason; or
            `enable` names one that does not exist.
    """
    begun = time.perf_counter()  # the duration of the check itself, whatever the current clock is
    arguments = Problems("check")
    properties = arguments.values("properties", properties)
    ignores, enable = arguments.values("ignores", ignores), arguments.values("enable", enable)
    arguments.raise_all()
    on = {rule.name for rule in RULES.values() if rule.is_on}
    for rule in enable:
        check_rule("check: enable", rule)
        on.add(rule)
    allow_depth(machine)
    record = describe(machine, name=name)
    subject = facts.collect(machine, record)
    wanted = [properties_of_runs.parse(p) if isinstance(p, str) else p for p in properties]
    problems = list(facts.find_problems(machine, record.path))
    # The graph of an inconsistent machine would have edges to nowhere: report only what keeps it
    # from running.
    if not any(problem.rule in facts.PREVENTS_RUN for problem in problems):
        moments = graph.build(subject)
        problems += structure.find(subject, moments)
        problems += userdata.find(subject, moments)
        problems += properties_of_runs.find(subject, moments, wanted)
    kept: list[Problem] = []
    ignored: list[tuple[Problem, str]] = []
    for problem in problems:
        known = subject.facts.get(problem.path)
        own = known.ignored.get(problem.rule) if known is not None else None
        reasons = [own] if own else [i.reason for i in ignores if i.covers(problem)]
        if problem.rule in on:
            if reasons:
                ignored.append((problem, reasons[0]))
            else:
                kept.append(problem)
    return Report(record, tuple(kept), tuple(ignored), time.perf_counter() - begun)
