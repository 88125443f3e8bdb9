"""Reports many runs of one machine as one page that opens without a server."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from smachpy.events.run_state import RAISED
from smachpy_viz.model.labels import end_class, html_text
from smachpy_viz.pictures.drawing import picture
from smachpy_viz.pictures.theme import DARK, LIGHT
from smachpy_viz.runs import charts
from smachpy_viz.runs import concluding_charts as concluding
from smachpy_viz.runs.compare import ComparedRun, unite
from smachpy_viz.runs.conclusion import RunEnd, bounds, by_cause, end_of, headline
from smachpy_viz.runs.statistics import Statistics, marks_of, quantile

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from smachpy.events.introspection import StateRecord
    from smachpy.events.recording import Recording

STYLE = f"""
body {{ background: {LIGHT.background}; color: {LIGHT.ink}; margin: 24px auto;
  font: 13px/20px Inter, system-ui, sans-serif; max-width: 960px; padding: 0 16px; }}
h1 {{ font-size: 20px; }} h2 {{ font-size: 15px; margin-top: 32px; }}
table {{ border-collapse: collapse; }} th, td {{ padding: 2px 16px 2px 0; text-align: left; }}
td.n, th.n {{ text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }}
.success {{ color: {LIGHT.success.text}; }} .failure {{ color: {LIGHT.failure.text}; }}
.preempted {{ color: {LIGHT.preempted.text}; }} .muted {{ color: {LIGHT.muted}; }}
.chart {{ width: 100%; font-size: 11px; }} .bars {{ fill: {LIGHT.active.stroke}; }}
.ribbons path {{ fill: {LIGHT.edge}; opacity: .25; }} .ribbons path:hover {{ opacity: .6; }}
.headline {{ font-size: 20px; line-height: 28px; font-weight: 660; margin: 8px 0; }}
.dots circle {{ fill: {LIGHT.success.stroke}; }} .dots text {{ fill: {LIGHT.failure.stroke};
  font-weight: 700; font-size: 14px; text-anchor: middle; dominant-baseline: middle; }}
.dots text.axis {{ fill: {LIGHT.muted}; font-weight: 400; font-size: 11px; }}
.dots line {{ stroke: {LIGHT.border}; opacity: .5; }} .dots .bound {{ fill: {LIGHT.failure.fill}; }}
a {{ color: inherit; }} :target {{ background: {LIGHT.preempted.fill}; }}
@media (prefers-color-scheme: dark) {{ body {{ background: {DARK.background}; color: {DARK.ink}; }}
  .muted {{ color: {DARK.muted}; }} .success {{ color: {DARK.success.text}; }}
  .failure {{ color: {DARK.failure.text}; }} .preempted {{ color: {DARK.preempted.text}; }}
  .chart:not(.dots), .machine {{ background: {LIGHT.background}; color: {LIGHT.ink}; }}
  .dots circle {{ fill: {DARK.success.stroke}; }} .dots text {{ fill: {DARK.failure.stroke}; }}
  .dots text.axis {{ fill: {DARK.muted}; }} .dots .bound {{ fill: {DARK.failure.fill}; }} }}
.machine svg {{ max-width: 100%; height: auto; }} .wide {{ overflow-x: auto; }}
"""


MOST_LINKS = 12
"""Runs of a cause that are named."""


@dataclass(slots=True)
class MachineRuns:
    """The runs of one machine, as a report needs them.

    Attributes:
        record: The machine as it was in the last run.
        statistics: Statistics of all runs.
        ways: For each run the visited children of the root in order, and the outcome.
        files: For each run the file, the outcome and the duration [s], None if it has not ended.
        ends: For each run how it ended.
    """

    record: StateRecord
    statistics: Statistics = field(default_factory=Statistics)
    ways: list[tuple[list[str], str]] = field(default_factory=list)
    files: list[tuple[str, str, float | None]] = field(default_factory=list)
    ends: list[RunEnd] = field(default_factory=list)


def collect(recordings: Iterable[Recording]) -> dict[str, MachineRuns]:
    """Return the runs of each machine, by its label."""
    found: dict[str, MachineRuns] = {}
    for recording in recordings:
        runs = found.setdefault(recording.record.label, MachineRuns(recording.record))
        runs.record = recording.record
        runs.statistics.add(recording.events, recording.record)
        way = list(_way(recording))
        outcome, seconds = "not finished", None
        for event in recording.events:  # the last end counts, if a file has several runs
            if event["kind"] == "Finished":
                outcome = event.get("outcome") or RAISED
                seconds = (event["stamp_ns"] - recording.events[0]["stamp_ns"]) / 1e9
        runs.ways.append((way, outcome))
        runs.ends.append(end_of(recording.record, recording.events))
        runs.files.append((str(recording.path), outcome, seconds))
    return found


def _way(recording: Recording) -> Iterator[str]:
    labels = {child.path: child.label for child in recording.record.children}
    for event in recording.events:
        if event["kind"] == "Entered" and event["path"] in labels:
            yield labels[event["path"]]


def report(
    runs: MachineRuns,
    *,
    before: MachineRuns | None = None,
    values: Mapping[str, Mapping[str, object]] | None = None,
) -> str:
    """Return the page.

    Args:
        runs: The runs.
        before: Earlier runs to compare with.
        values: The varied values of each run, by its file.

    Raises:
        EngineError, PictureError: the machine cannot be drawn.

    Blocks: while `dot` runs.
    """
    # The picture of the machine, then one section after the other; empty ones are left out.
    marks = marks_of(runs.statistics, runs.record)
    ends = ", ".join(f"{outcome} \u00d7{n}" for outcome, n in runs.statistics.outcomes.items())
    legend = (("", f"{runs.statistics.runs} runs: {ends or 'none has ended'}"),
              ("heat", "the warmer, the longer in all"))  # fmt: skip
    drawn = picture(runs.record, "svg", run=marks, legend=legend).decode()
    seconds = {path: sum(s.durations) for path, s in runs.statistics.states.items()}
    numbers = _numbers(runs, values or {})
    sections = [
        ("Failures by first cause", _causes(runs)),
        ("What decides", _scatter(runs, numbers)),
        ("Where they ended", concluding.places(runs.ends)),
        ("Outcomes", _outcomes(runs)),
        *([("What varied", _varied(runs, values))] if values else []),
        ("Ways taken", charts.ways(runs.ways)),
        ("The machine", f'<div class="machine wide">{drawn[drawn.index("<svg") :]}</div>'),
        ("Time by state", charts.flame(runs.record, seconds)),
        ("States", _states(runs)),
        *([("Compared with earlier runs", _differences(before, runs))] if before else []),
        ("Runs", _files(runs, values or {})),
    ]
    body = "".join(f"<h2>{title}</h2>{content}" for title, content in sections if content)
    name = html_text(runs.record.label)
    # Names in a recording are not trusted: besides escaping, the policy forbids every script.
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width">'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
        "style-src 'unsafe-inline'\">"
        f"<title>{name}: {runs.statistics.runs} runs</title><style>{STYLE}</style></head>"
        f"<body><h1>{name}: {runs.statistics.runs} runs</h1>{_head(runs, numbers)}{body}"
        "</body></html>\n"
    )


def _numbers(
    runs: MachineRuns, values: Mapping[str, Mapping[str, object]]
) -> list[dict[str, float]]:
    """Return the varied numbers of each run."""
    return [
        {
            key: float(value)
            for key, value in values.get(file, {}).items()
            if isinstance(value, int | float) and not isinstance(value, bool)
        }
        for file, _, _ in runs.files
    ]


def _head(runs: MachineRuns, numbers: list[dict[str, float]]) -> str:
    if not runs.ends:
        return ""
    good, shared = (html_text(text) for text in headline(runs.ends, numbers))
    sentence = f'<p class="headline"><b class="success">{good}</b> {shared}</p>'
    return sentence + concluding.squares(runs.ends)


def _causes(runs: MachineRuns) -> str:
    rows = []
    for end, failed in by_cause(runs.ends):
        links = [
            f'<a href="#run-{number}">{number + 1}</a> {runs.ends[number].at:.1f} s'
            for number in failed[:MOST_LINKS]
        ]
        more = f" and {len(failed) - MOST_LINKS} more" if len(failed) > MOST_LINKS else ""
        cause = html_text(end.cause or "unknown")
        place = (
            f'<span title="{html_text(end.path)}">{html_text(end.path.rpartition("/")[2])}</span>'
        )
        rows.append([str(len(failed)), cause, place, ", ".join(links) + more])
    if not rows:
        return ""
    return (
        f'<div class="wide">{_table(["runs", "first cause", "state", "run, and when"], rows)}</div>'
    )


def _scatter(runs: MachineRuns, numbers: list[dict[str, float]]) -> str:
    """The two varied values that part good runs and failures best, else the first two."""
    kinds = by_cause(runs.ends)
    if not kinds:
        return ""  # no failure: nothing decides
    shared = bounds(runs.ends, kinds[0][1], numbers)
    keys = list(dict.fromkeys([*(one.key for one in shared), *(k for n in numbers for k in n)]))
    there = [key for key in keys if all(key in one for one in numbers)][:2]
    return concluding.scatter(runs.ends, numbers, there, shared) if there else ""


def _outcomes(runs: MachineRuns) -> str:
    ended = sum(runs.statistics.outcomes.values())
    rows = []
    for outcome, n in sorted(runs.statistics.outcomes.items(), key=lambda item: -item[1]):
        times = [s for _, end, s in runs.files if end == outcome and s is not None]
        rows.append([_coloured(outcome, runs.record), str(n), f"{n / ended:.0%}", *_times(times)])
    return _table(["outcome", "runs", "share", "median", "95 %"], rows)


def _varied(runs: MachineRuns, values: Mapping[str, Mapping[str, object]]) -> str:
    """The outcomes by quarters of each varied value."""
    rows = []
    for key in dict.fromkeys(key for one in values.values() for key in one):
        for words, ends in by_quarter(runs, values, key):
            outcomes = ", ".join(
                f"{_coloured(o, runs.record)} \u00d7{n}" for o, n in ends.most_common()
            )
            rows.append([html_text(key), html_text(words), str(sum(ends.values())), outcomes])
    return _table(["value", "range", "runs", "outcomes"], rows)


def by_quarter(
    runs: MachineRuns, values: Mapping[str, Mapping[str, object]], key: str
) -> list[tuple[str, Counter[str]]]:
    """Return the outcomes by quarters of a varied number, or by each value if it is no number."""
    pairs = [(values[file][key], end) for file, end, _ in runs.files if key in values.get(file, {})]
    numbers = sorted((v, end) for v, end in pairs if isinstance(v, int | float))
    if len(numbers) < len(pairs):  # some are texts: no order, so no quarters
        ends: dict[str, Counter[str]] = {}
        for value, end in pairs:
            ends.setdefault(str(value), Counter())[end] += 1
        return list(ends.items())
    size = -(-len(numbers) // 4)  # rounded up: at most four parts
    quarters = [numbers[i : i + size] for i in range(0, len(numbers), size or 1)]
    return [(_span(part[0][0], part[-1][0]), Counter(end for _, end in part)) for part in quarters]


def _span(low: float, high: float) -> str:
    return f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"


def _states(runs: MachineRuns) -> str:
    rows = []
    for state in runs.record.walk():
        one = runs.statistics.states.get(state.path)
        if one is None:
            continue
        # Each histogram has its own axis, as durations of states can differ greatly.
        bars = ""
        if one.durations and max(one.durations) > 0:
            low, high = min(one.durations), max(one.durations)
            span = f"{low:.1f} to {high:.1f} s"
            bars = f'{charts.histogram(one.durations, low, high)} <span class="muted">{span}</span>'
        ends = ", ".join(f"{_coloured(o, state)} \u00d7{n}" for o, n in one.outcomes.items())
        cells = [html_text(state.path), str(one.visits), *_times(one.durations)]
        rows.append([*cells, f"{one.failures():.0%}", bars, ends])
    head = ["state", "visits", "median", "95 %", "failed", "durations", "outcomes"]
    return f'<div class="wide">{_table(head, rows)}</div>'


def _differences(before: MachineRuns, runs: MachineRuns) -> str:
    old = ComparedRun("before", before.record, before.statistics)
    new = ComparedRun("now", runs.record, runs.statistics)
    rows = [
        [html_text(one["change"]), html_text(one["path"]), html_text(one["text"])]
        for one in unite(old, new).listed()
    ]
    return _table(["change", "state", "what"], rows) if rows else "no notable difference"


def _files(runs: MachineRuns, values: Mapping[str, Mapping[str, object]]) -> str:
    rows = []
    # Names are relative to the folder that all files share: whole paths would fill the table.
    places = [Path(file).absolute() for file, _, _ in runs.files]
    common = os.path.commonpath([place.parent for place in places]) if places else ""
    for number, (place, one) in enumerate(zip(places, runs.files, strict=True)):
        file, outcome, seconds = one
        name = str(place.relative_to(common))
        chosen = ", ".join(f"{key} {_short(v)}" for key, v in values.get(file, {}).items())
        took = "" if seconds is None else f"{seconds:.1f} s"
        here = f'<span id="run-{number}">{number + 1}</span>'
        rows.append(
            [here, html_text(name), _coloured(outcome, runs.record), took, html_text(chosen)]
        )
    return _table(["run", "file", "outcome", "time", *(["values"] if values else [])], rows)


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _times(durations: list[float]) -> list[str]:
    found = [quantile(durations, share) for share in (0.5, 0.95)]
    return ["" if value is None else f"{value:.2f} s" for value in found]


def _coloured(outcome: str, state: StateRecord) -> str:
    kind = end_class(state.kind, outcome, state.success)
    return f'<span class="{kind}">{html_text(outcome)}</span>'


NUMBERS = {"runs", "share", "median", "95 %", "visits", "failed", "time"}
"""Columns that are aligned to the right."""


def _table(head: list[str], rows: list[list[str]]) -> str:
    kinds = ['class="n"' if title in NUMBERS else "" for title in head]
    top = "".join(f"<th {k}>{title}</th>" for k, title in zip(kinds, head, strict=True))
    body = "".join(
        f"<tr>{''.join(f'<td {k}>{c}</td>' for k, c in zip(kinds, row, strict=False))}</tr>"
        for row in rows
    )
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
