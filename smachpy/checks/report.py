"""The result of a check, as text, JSON, GitHub annotations or SARIF."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from smachpy.checks.model import RULES
from smachpy.events.pictures import draw_moments

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from smachpy.checks.model import Problem
    from smachpy.events.introspection import StateRecord

_LEVELS = {"error": "error", "warning": "warning", "note": "notice"}


@dataclass(frozen=True, slots=True)
class Report:
    """The result of a check.

    It is true if it is `ok`; iteration and `len` go over its problems, including notes.

    Attributes:
        record: The machine.
        problems: The problems.
        ignored: The problems whose rules are switched off, with the reasons.
        seconds: How long the check took.
    """

    record: StateRecord
    problems: tuple[Problem, ...]
    ignored: tuple[tuple[Problem, str], ...] = ()
    seconds: float = 0.0

    @property
    def ok(self) -> bool:
        """Whether there are no errors and no warnings."""
        return not any(problem.severity != "note" for problem in self.problems)

    def __bool__(self) -> bool:
        return self.ok

    def __iter__(self) -> Iterator[Problem]:
        return iter(self.problems)

    def __len__(self) -> int:
        return len(self.problems)

    def __str__(self) -> str:
        return as_text([self])

    def assert_ok(self) -> None:
        """Fail with all problems unless the report is `ok`.

        Raises:
            AssertionError: there are errors or warnings.
        """
        __tracebackhide__ = True
        if not self.ok:
            raise AssertionError(str(self))

    def draw(self, folder: Path | str) -> list[Path]:
        """Draw the machine for each problem with a run, and mark that run.

        Returns:
            The files; none if no drawing package is installed.
        """
        files = []
        for number, problem in enumerate(self.problems, 1):
            if problem.moments:
                name = f"{self.record.label}-{number}-{problem.rule}.svg"
                file = draw_moments(self.record, problem.moments, Path(folder) / name)
                files += [] if file is None else [file]
        return files


def as_text(reports: Iterable[Report]) -> str:
    """Return reports for a terminal."""
    lines: list[str] = []
    for report in reports:
        for problem in report.problems:
            where = ":".join(map(str, _where(problem)))
            lines.append(
                f"{where and where + ': '}{problem.severity}: {problem.message} [{problem.rule}]"
            )
            if problem.steps:
                lines.append("    run: " + " ".join(problem.steps))
            if problem.firings:
                lines.append("    fired: " + ", ".join(problem.firings))
            if problem.hint:
                lines.append(f"    {problem.hint}")
        lines += [f"ignored: {p.path}: {p.rule}: {reason}" for p, reason in report.ignored]
        count = sum(problem.severity != "note" for problem in report.problems)
        lines.append(
            f"{report.record.path}: {count or 'no'} problem{'' if count == 1 else 's'} "
            f"({report.seconds * 1e3:.1f} ms)"
        )
    return "\n".join(lines)


def as_json(reports: Iterable[Report]) -> str:
    """Return reports as JSON: a list of machines with their problems."""
    return json.dumps(
        [
            {
                "machine": report.record.path,
                "ok": report.ok,
                "seconds": report.seconds,
                "problems": [_plain(problem) for problem in report.problems],
                "ignored": [{**_plain(p), "reason": reason} for p, reason in report.ignored],
            }
            for report in reports
        ],
        indent=2,
    )


def as_github(reports: Iterable[Report]) -> str:
    """Return reports as GitHub workflow commands."""
    lines = []
    for problem in (problem for report in reports for problem in report.problems):
        where = _where(problem)
        names = ("file", "line")[: len(where)]
        values = [_escaped(str(one)).replace(":", "%3A").replace(",", "%2C") for one in where]
        fields = [f"{name}={value}," for name, value in zip(names, values, strict=True)]
        text = _escaped(" ".join([problem.message, problem.hint, *problem.steps]).strip())
        lines.append(f"::{_LEVELS[problem.severity]} {''.join(fields)}title={problem.rule}::{text}")
    return "\n".join(lines)


def _escaped(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def as_sarif(reports: Iterable[Report]) -> str:
    """Return reports as SARIF 2.1.0.

    Source: OASIS, Static Analysis Results Interchange Format 2.1.0.
    """
    rules = [
        {"id": rule.name, "shortDescription": {"text": rule.summary}} for rule in RULES.values()
    ]
    home = "https://pypi.org/project/smachpy"
    tool = {"driver": {"name": "smachpy", "informationUri": home, "rules": rules}}
    results = [_result(problem) for report in reports for problem in report.problems]
    return json.dumps(
        {
            "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
            "version": "2.1.0",
            "runs": [{"tool": tool, "results": results}],
        },
        indent=2,
    )


def _result(problem: Problem) -> dict[str, Any]:
    location: dict[str, Any] = {"logicalLocations": [{"fullyQualifiedName": problem.path}]}
    where = _where(problem)
    if where:
        location["physicalLocation"] = {
            "artifactLocation": {"uri": quote(where[0])},
            "region": {"startLine": max(1, where[1])},
        }
    result: dict[str, Any] = {
        "ruleId": problem.rule,
        "level": problem.severity,
        "message": {"text": f"{problem.message} {problem.hint}".strip()},
        "locations": [location],
    }
    if problem.steps:
        steps = [{"location": {"message": {"text": step}}} for step in problem.steps]
        result["codeFlows"] = [{"threadFlows": [{"locations": steps}]}]
    return result


def _plain(problem: Problem) -> dict[str, Any]:
    plain = {**asdict(problem), "steps": problem.steps}
    return plain if _where(problem) else {**plain, "place": None}


def _where(problem: Problem) -> tuple[()] | tuple[str, int]:
    """Return the file, relative to this folder if it is below it, and the line; () if unknown."""
    place = problem.place
    if place is None or not place.file:
        return ()
    file = Path(place.file)
    if file.is_relative_to(Path.cwd()):
        file = file.relative_to(Path.cwd())
    return file.as_posix(), place.line


FORMATS = {"text": as_text, "json": as_json, "github": as_github, "sarif": as_sarif}
