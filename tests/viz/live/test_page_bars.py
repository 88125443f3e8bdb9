"""What the timeline's bars say, and that no failure is hidden among them."""

from __future__ import annotations

import pytest

from tests.browser import wait_for

pytestmark = pytest.mark.browser

KITCHEN = {"$object": "Waypoint", "fields": {"name": "kitchen", "x": 3.0, "y": 2.0}}
GOAL = {"$msg": "move_base_msgs/MoveBaseGoal", "fields": {"target_pose": {
    "position": {"x": 3.0, "y": 2.0}, "orientation": {"w": 1.0}}}}  # fmt: skip
# Texts and colours that the timeline draws, in order.
WATCH = """() => {
    const proto = CanvasRenderingContext2D.prototype, fill = proto.fillText, stroke = proto.stroke;
    const said = [], strokes = [];
    const canvas = smachpy.page.timeline.canvas;
    proto.fillText = function (text, ...at) {
        if (this.canvas === canvas) said.push(text);
        return fill.call(this, text, ...at);
    };
    proto.stroke = function (...what) {
        if (this.canvas === canvas) strokes.push(this.strokeStyle);
        return stroke.apply(this, what);
    };
    smachpy.page.timeline.window.fitAll(); smachpy.page.timeline.draw();
    Object.assign(proto, { fillText: fill, stroke });
    return { said, strokes };
}"""


def test_bars_say_where_a_goal_leads_and_why_nothing_runs(served, look):
    asked = {"text": "Go on?", "answers": ["yes"], "words": [""], "default": "yes", "patience": 60.0,
             "service": "q", "has_picture": False}  # fmt: skip
    events = [
        ("Started", "/JOB", {"at": 0}),
        ("UserdataWritten", "/JOB/A", {"key": "place", "value": KITCHEN, "at": 0}),
        ("Entered", "/JOB/A", {"at": 0}),
        ("GoalSent", "/JOB/A", {"action": "r1/move_base", "goal_id": "1", "goal": GOAL, "at": 0}),
        ("Left", "/JOB/A", {"outcome": "ok", "at": 20}),
        ("Paused", "/JOB/B", {"reason": "pause", "at": 20}),
        ("Resumed", "/JOB/B", {"at": 40}),
        ("Entered", "/JOB/B", {"at": 40}),
        ("QuestionAsked", "/JOB/B", {**asked, "at": 40}),
        ("QuestionAnswered", "/JOB/B", {"service": "q", "answer": "yes", "by": "ann", "at": 60}),
        ("Left", "/JOB/B", {"outcome": "ok", "at": 60}),
        ("Finished", "/JOB", {"outcome": "done", "at": 60}),
    ]
    served.add("one", events=events, recorded=True)
    page = look(served.start())
    said = page.evaluate(WATCH)["said"]
    for text in ("A \u2192 kitchen 20 s", "paused 20 s", "B ? 20 s"):
        assert text in said


def test_a_failure_among_thousands_of_visits_is_drawn_last_and_wide_enough(served, look):
    events = [("Started", "/JOB", {"at": 0})]
    for n in range(3000):
        outcome = "aborted" if n == 1500 else "ok"
        events += [
            ("Entered", "/JOB/A", {"at": 6 * n}),
            ("Left", "/JOB/A", {"outcome": outcome, "at": 6 * n + 1}),
        ]
    machine = served.add("one", events=events)
    machine.recorded = True
    page = look(served.start())
    wait_for(page, "smachpy.store.data.run.spans.length > 3000")
    strokes = page.evaluate(WATCH)["strokes"]
    colour = page.evaluate(
        "() => getComputedStyle(document.documentElement).getPropertyValue('--failure').trim().toLowerCase()"
    )
    assert strokes.count(colour) == 1
    success = [i for i, one in enumerate(strokes) if one != colour and i > 30]
    assert strokes.index(colour) >= max(success) - 2
    (wide,) = page.evaluate(
        "() => smachpy.page.timeline.bars.hits.filter((h) => h.span.outcome === 'aborted').map((h) => h.right - h.left)"
    )
    assert wide >= 3


@pytest.mark.parametrize(
    ("outcome", "kind"),
    [("aborted", "failure"), ("done", "success"), ("preempted", "preempted"), ("odd", "other")],
)
def test_the_badge_of_an_ended_run_has_the_colour_of_its_outcome(served, look, outcome, kind):
    served.add("one", events=[("Started", "/JOB"), ("Finished", "/JOB", {"outcome": outcome})])
    page = look(served.start())
    page.wait_for_selector(f".status.{kind}:has-text('ended: {outcome}')")


def test_follow_opens_what_runs_also_in_the_past(served, look):
    from smachpy import CBState, StateMachine

    inner = StateMachine(outcomes=["ok"])
    with inner:
        StateMachine.add("DRIVE", CBState(lambda _: "ok", outcomes=["ok"]), {"ok": "ok"})
    top = StateMachine(outcomes=["done"], name="JOB")
    with top:
        StateMachine.add("VISIT", inner, {"ok": "done"})
    events = [
        ("Started", "/JOB", {"at": 0}),
        ("Entered", "/JOB/VISIT", {"at": 0}),
        ("Entered", "/JOB/VISIT/DRIVE", {"at": 1}),
        ("Left", "/JOB/VISIT/DRIVE", {"outcome": "ok", "at": 20}),
        ("Left", "/JOB/VISIT", {"outcome": "ok", "at": 20}),
        ("Finished", "/JOB", {"outcome": "done", "at": 20}),
    ]
    served.add("one", sm=top, events=events)
    page = look(served.start())
    page.keyboard.press("1")
    page.wait_for_selector('g[data-path="/JOB/VISIT/DRIVE"]', state="detached")
    page.evaluate("() => smachpy.store.playback.seek(smachpy.store.data.run.first() + 10000)")
    page.keyboard.press("o")
    page.wait_for_selector('g.active[data-path="/JOB/VISIT/DRIVE"]')
