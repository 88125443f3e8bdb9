"""Reproductions in words: lines for the terminal, JUnit's XML for continuous integration; pure."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final
from xml.sax.saxutils import escape, quoteattr

from smachpy.events import span_text

if TYPE_CHECKING:
    from collections.abc import Iterable

    from smachpy.reproduce.compare import Difference
    from smachpy.reproduce.run import Reproduction

MOST_NOTES: Final = 8
"""Lines of what is lacking."""

LONGEST: Final = 200
"""Longest line of a step [characters]."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of one recording, in a form that a worker can send.

    Attributes:
        path: The file.
        kind: "same", "differs", or "failed": it could not be reproduced.
        lines: For people.
        same, total: Numbers of events.
        seconds: How long it took [s].
        difference: The first one; None if there is none.
        changed: What has changed in machine, constants and files, in words.
        notes: What was lacking, in words.
    """

    path: str
    kind: str
    lines: tuple[str, ...]
    same: int = 0
    total: int = 0
    seconds: float = 0.0
    difference: Difference | None = None
    changed: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return it for programs."""
        return {
            "file": self.path,
            "result": self.kind,
            "same": self.same,
            "events": self.total,
            "seconds": round(self.seconds, 3),
            "text": list(self.lines),
            "difference": None if self.difference is None else asdict(self.difference),
            "changed": list(self.changed),
            "notes": list(self.notes),
        }


def lines_of(found: Reproduction) -> tuple[str, ...]:
    """Return a reproduction in lines."""
    comparison, difference = found.comparison, found.comparison.difference
    notes = [f"  note: {note}" for note in found.notes[:MOST_NOTES]]
    if len(found.notes) > MOST_NOTES:
        notes.append(f"  note: and {len(found.notes) - MOST_NOTES} more")
    if difference is None:
        head = f"{found.name}: the same {comparison.same} of {comparison.total} events, "
        return (f"{head}{span_text(found.duration)} in {span_text(found.seconds)}", *notes)
    lines = [f"{found.name}: differs at {_clock(difference.at)}, event {difference.number}"]
    lines += [f"            {step}" for step in difference.before]
    lines.append(f"  recorded  {difference.recorded}")
    lines += [f"            {step}" for step in difference.recorded_next]
    lines.append(f"  now       {difference.now}")
    lines += [f"            {step}" for step in difference.now_next]
    lines += [f"  changed: {text}" for text in nearest(found.changed, difference.path)]
    return tuple(
        line if len(line) <= LONGEST else f"{line[:LONGEST]}…" for line in (*lines, *notes)
    )


def nearest(changed: Iterable[str], path: str) -> list[str]:
    """Return the changes, those of the state and of what it is in first."""
    return sorted(
        changed, key=lambda text: not (text.startswith("/") and path.startswith(text.split(":")[0]))
    )


def _clock(seconds: float) -> str:
    minutes, rest = divmod(max(0.0, seconds), 60.0)
    hours, minutes = divmod(int(minutes), 60)
    text = f"{minutes:02d}:{rest:04.1f}"
    return f"{hours}:{text}" if hours else text


def summary(verdicts: list[Verdict]) -> str:
    """Return one line about many."""
    counts = {
        kind: sum(one.kind == kind for one in verdicts) for kind in ("same", "differs", "failed")
    }
    text = f"{len(verdicts)} recordings: {counts['same']} the same, {counts['differs']} differ"
    if counts["failed"]:
        text += f", {counts['failed']} cannot be reproduced"
    return text


def junit(verdicts: list[Verdict]) -> str:
    """Return the verdicts as a report of JUnit: a test each."""
    failures = sum(one.kind == "differs" for one in verdicts)
    errors = sum(one.kind == "failed" for one in verdicts)
    seconds = sum(one.seconds for one in verdicts)
    counts = f'tests="{len(verdicts)}" failures="{failures}" errors="{errors}" skipped="0"'
    lines = [
        '<?xml version="1.0" encoding="utf-8"?>',
        f'<testsuite name="smachpy runs reproduce" {counts} time="{seconds:.3f}">',
    ]
    for one in verdicts:
        name, took = quoteattr(_clean(one.path)), f"{one.seconds:.3f}"
        head = f'  <testcase classname="recordings" name={name} time="{took}"'
        if one.kind == "same":
            lines.append(f"{head}/>")
            continue
        word = "failure" if one.kind == "differs" else "error"
        first, text = (
            (_clean(one.lines[0]), escape(_clean("\n".join(one.lines)))) if one.lines else ("", "")
        )
        lines.append(f"{head}>")
        lines.append(f"    <{word} message={quoteattr(first)}>{text}</{word}>")
        lines.append("  </testcase>")
    lines.append("</testsuite>")
    return "\n".join(lines) + "\n"


def _clean(text: str) -> str:
    """Replace the characters that XML does not have."""
    return "".join(
        c if c in "\n\t" or (c >= " " and not "\ud800" <= c <= "\udfff") else "?" for c in text
    )
