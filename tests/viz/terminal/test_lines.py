from __future__ import annotations

import colorsys
from types import SimpleNamespace as Message

import pytest

from smachpy import events as ev
from smachpy_viz.model.history import History
from smachpy_viz.pictures.theme import THEMES
from smachpy_viz.terminal.lines import RUNNING, STYLES, WAITING, EventLines

GO = "/PATROL/WATCHED_DRIVE/DRIVE/GO_THERE"


@pytest.fixture
def tell(patrol):
    """`tell(event, …)` folds all events and returns the lines."""
    history = History()
    lines_of = EventLines(patrol, history, panel=False)

    def told(*events):
        lines = []
        for event in events:
            line = lines_of.line(event)
            history.on_event(event)
            lines += [] if line is None else [line.plain]
        return lines

    told(ev.Started("/PATROL", 100.0, 0), ev.Entered(GO, 100.0, 0))
    return told


@pytest.mark.parametrize(
    ("event", "words"),
    [
        (ev.Left(GO, 102.0, 0, "succeeded"), "succeeded \u2192 NEXT_WAYPOINT  2.0 s"),
        (ev.Left(GO, 102.0, 0, "preempted"), "preempted  2.0 s"),
        (ev.Failed(GO, 102.0, 0, "ValueError: no map"), "ValueError: no map  2.0 s"),
        (ev.PreemptRequested(GO, 102.0, 0, "signal", "SIGINT"), "asked to stop by signal SIGINT"),
        (ev.TimedOut(GO, 102.0, 0, 1.5), "timeout of 1.5 s"),
        (ev.Retried(GO, 102.0, 0, 1, "aborted"), "again, attempt 1 ended with aborted"),
        (ev.Abandoned(GO, 102.0, 0, 2.0, "File …"), "left behind: it ignored its preempt for 2 s"),
        (ev.CallbackFailed(GO, 102.0, 0, "start", "KeyError: x"), "callback start: KeyError: x"),
        (ev.Paused(GO, 102.0, 0, "breakpoint"), "paused (breakpoint)"),
        (ev.Resumed(GO, 102.0, 0), "resumed"),
        (
            ev.GoalDone(GO, 102.0, 0, "move_base", "g", "ABORTED", "goal in wall"),
            "move_base ABORTED: goal in wall",
        ),
    ],
)
def test_every_event_worth_telling_has_its_line(tell, event, words):
    assert tell(event) == [f"    2.00  WATCHED_DRIVE/DRIVE/GO_THERE  {words}"]


@pytest.mark.parametrize(
    "event",
    [
        ev.Entered(GO, 102.0, 0),
        ev.UserdataWritten(GO, 102.0, 0, "key", 1),
        ev.GoalDone(GO, 102.0, 0, "move_base", "g", "SUCCEEDED", "arrived"),
        ev.GoalFeedback(GO, 102.0, 0, "move_base", "unknown", None),
    ],
)
def test_the_rest_is_silent(tell, event):
    assert tell(event) == []


def test_feedback_gets_a_line_every_few_seconds(tell):
    tell(ev.GoalSent(GO, 100.0, 0, "move_base", "g", None))
    lines = tell(
        *(
            ev.GoalFeedback(GO, 100.0 + i / 10, 0, "move_base", "g", Message(percent=float(i)))
            for i in range(110)
        )
    )
    assert [line.split("  ")[-2] for line in lines] == ["0%", "50%", "100%"]


def test_the_end_of_the_run_is_told(tell):
    assert tell(ev.Finished("/PATROL", 105.0, 0, None)) == [
        "    5.00  PATROL  ended: exception  5.0 s"
    ]


def test_goals_side_by_side_have_a_line_each(tell):
    for goal in ("g", "h"):
        tell(ev.GoalSent(GO, 100.0, 0, "move_base", goal, None))
    lines = tell(
        *(
            ev.GoalFeedback(GO, 100.0 + i / 10, 0, "move_base", goal, Message(percent=float(i)))
            for i in range(40)
            for goal in ("g", "h")
        )
    )
    assert len(lines) == 2


def test_narrow_lines_name_the_state_without_its_containers(patrol):
    history = History()
    lines_of = EventLines(patrol, history, panel=False, narrow=True)
    history.on_event(ev.Started("/PATROL", 100.0, 0))
    line = lines_of.line(ev.Left(GO, 102.0, 0, "succeeded"))
    assert line.plain == "   2.0 GO_THERE succeeded \u2192 NEXT_WAYPOINT"


def luminance(colour):
    """WCAG 2.1, relative luminance."""
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    r, g, b = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


SWATCHES = {
    **{(theme.name, name): (style, getattr(theme, name).stroke)
       for theme in THEMES.values()
       for name, style in {**STYLES, "active": RUNNING, "waiting": WAITING}.items()},
}  # fmt: skip


@pytest.mark.parametrize("key", SWATCHES, ids="-".join)
def test_the_terminals_colours_are_those_of_the_page(key):
    ours, pages = SWATCHES[key]
    hues = [colorsys.rgb_to_hls(*(int(c[i : i + 2], 16) / 255 for i in (1, 3, 5)))[0]
            for c in (ours, pages)]  # fmt: skip
    assert min(abs(hues[0] - hues[1]), 1 - abs(hues[0] - hues[1])) < 0.06
    background = luminance(THEMES[key[0]].background)
    light, dark = sorted((luminance(ours), background), reverse=True)
    assert (light + 0.05) / (dark + 0.05) >= 3
