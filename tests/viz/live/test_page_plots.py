"""Plots below the timeline: of topics, goals, userdata and feedback, at the instant shown."""

from __future__ import annotations

import pytest

from tests.browser import wait_for

pytestmark = pytest.mark.browser


def pose(x):
    return {"$object": "Pose2D", "fields": {"x": x, "y": 2.0}}


def feedback(x, at, left):
    message = {
        "$msg": "nav/Feedback",
        "fields": {"place": {"$msg": "nav/Place", "fields": {"x": x}}},
    }
    facts = {"action": "go", "goal_id": "1", "feedback": message}
    progress = {"fraction": None, "distance": left, "text": ""}
    return ("GoalFeedback", "/JOB/A", {**facts, "progress": progress, "at": at})


def run():
    return [
        ("Started", "/JOB", {"at": 0.0}),
        ("Entered", "/JOB/A", {"at": 0.0}),
        ("UserdataWritten", "/JOB/A", {"key": "pose", "value": pose(1.5), "at": 1.0}),
        ("GoalSent", "/JOB/A", {"action": "go", "goal_id": "1", "goal": None, "at": 2.0}),
        feedback(10, 3.0, 6.0),
        feedback(20, 5.0, 4.0),
        feedback(30, 7.0, 2.0),
        ("UserdataWritten", "/JOB/A", {"key": "pose", "value": pose(4.5), "at": 8.0}),
        ("Left", "/JOB/A", {"outcome": "ok", "at": 9.0}),
        ("Finished", "/JOB", {"outcome": "done", "at": 10.0}),
    ]


def battery(served):
    return [
        {"kind": "Observed", "path": "", "n": n, "stamp_ns": served.began + int(n * 1e9),
         "what": "value", "robot": "", "name": "battery", "value": 90.0 - n, "unit": "%"}
        for n in range(1, 10)
    ]  # fmt: skip


@pytest.fixture
def page(served, look):
    served.add("one", events=run(), labels="A", observed=battery(served))
    page = look(served.start())
    page.wait_for_function("() => document.querySelectorAll('.plot').length === 2")
    return page


def seek(page, seconds):
    page.evaluate(
        "(s) => smachpy.store.playback.seek(smachpy.store.data.run.first() + 1000 * s)", seconds
    )


def values(page):
    return dict(page.evaluate(
        """() => [...document.querySelectorAll('.plot-names li:has(output)')].map((li) =>
          [li.querySelector('.plot-name').textContent, li.querySelector('output').textContent])"""
    ))  # fmt: skip


def wait_for_values(page, expected):
    page.wait_for_function(
        """(expected) => expected.every((text) =>
          [...document.querySelectorAll('.plot-names output')].some((o) => o.textContent === text))""",
        arg=expected,
    )


def test_the_usual_plots_tell_the_values_of_the_instant_shown(page):
    seek(page, 5.5)
    wait_for_values(page, ["85 %", "4 m"])
    assert values(page) == {"battery": "85 %", "distance left": "4 m"}
    seek(page, 0.5)
    wait_for_values(page, ["\u2013"])


def test_a_plot_draws_its_line_and_a_click_in_it_goes_to_the_instant(page):
    page.evaluate("() => { smachpy.page.timeline.window.fitAll(); smachpy.page.timeline.draw(); }")
    painted = page.evaluate(
        """() => { const [plot] = smachpy.page.plots; const { ctx, bbox } = plot.chart;
          const { data } = ctx.getImageData(bbox.left, bbox.top, bbox.width, bbox.height);
          const line = getComputedStyle(document.documentElement).getPropertyValue('--s1').trim();
          const [r, g, b] = [1, 3, 5].map((i) => parseInt(line.slice(i, i + 2), 16));
          let count = 0;
          for (let i = 0; i < data.length; i += 4)
            if (data[i] === r && data[i + 1] === g && data[i + 2] === b) count += 1;
          return count; }"""
    )
    assert painted > 50
    x = page.evaluate(
        """() => { const { scale } = smachpy.page.timeline; const [plot] = smachpy.page.plots;
          const first = smachpy.store.data.run.first();
          const { left, width } = plot.chart.over.getBoundingClientRect(); const { from, to } = plot.range;
          const canvas = smachpy.page.timeline.canvas.getBoundingClientRect();
          return [left + (first + 5000 - from) / (to - from) * width, canvas.left + scale.x(first + 5000)]; }"""
    )
    assert x[0] == pytest.approx(x[1], abs=1.5)  # the plot stands on the timeline's axis
    box = page.locator(".plot-area").first.bounding_box()
    page.mouse.click(x[0], box["y"] + 30)
    shown = page.evaluate("() => smachpy.store.playback.nowMs() - smachpy.store.data.run.first()")
    assert shown == pytest.approx(5000, abs=40)


def test_any_number_is_plotted_and_the_choice_is_kept_and_linked(page):
    page.hover("[aria-label='plot a number of the run']")
    page.wait_for_selector(
        "[aria-label='plot a number of the run'] optgroup[label='feedback']", state="attached"
    )
    page.select_option("[aria-label='plot a number of the run']", "userdata,%2FJOB,pose,x")
    page.wait_for_function("() => document.querySelectorAll('.plot').length === 3")
    add = page.locator("[aria-label='add a line to this plot']").nth(2)
    add.hover()
    page.wait_for_function(
        "() => document.querySelectorAll('.plot:nth-child(3) option').length > 2"
    )
    add.select_option("feedback,go,place,x")
    page.click("[aria-label='remove battery from the plots']")
    seek(page, 8.5)
    wait_for_values(page, ["4.5", "30"])
    assert values(page) == {"distance left": "2 m", "pose.x": "4.5", "place.x": "30"}
    chosen = [["progress,go,distance"], ["userdata,%2FJOB,pose,x", "feedback,go,place,x"]]
    address = page.evaluate("() => smachpy.page.address.text")
    page.wait_for_function("() => location.hash === new URL(smachpy.page.address.text).hash")
    page.reload()
    wait_for(page, "smachpy.store.panels.plotsChosen.value")  # other plots are there before
    assert page.evaluate("() => smachpy.store.panels.plotsChosen.value") == chosen
    page.evaluate("() => { localStorage.clear(); }")
    page.goto("about:blank")
    page.goto(address)
    wait_for(page, "smachpy.store.panels.plotsChosen.value")  # other plots are there before
    assert page.evaluate("() => smachpy.store.panels.plotsChosen.value") == chosen


def test_a_plot_of_hostile_names_is_text(served, look):
    events = [
        ("Started", "/JOB"),
        ("Entered", "/JOB/A"),
        ("UserdataWritten", "/JOB/A", {"key": "<img src=x onerror=alert(1)>", "value": 1}),
        ("UserdataWritten", "/JOB/A", {"key": "__proto__", "value": 2}),
    ]
    served.add("one", events=events, labels="A")
    page = look(served.start())
    page.hover("[aria-label='plot a number of the run']")
    page.wait_for_selector("optgroup[label='userdata']", state="attached")
    for id_ in (
        "userdata,%2FJOB,%3Cimg%20src%3Dx%20onerror%3Dalert(1)%3E",
        "userdata,%2FJOB,__proto__",
    ):
        page.select_option("[aria-label='plot a number of the run']", id_)
        page.hover(".plot")
        page.hover("[aria-label='plot a number of the run']")
    wait_for_values(page, ["1", "2"])
    assert page.query_selector(".plot img") is None


def test_more_plots_than_there_is_room_for_are_refused_with_the_reason(page):
    page.evaluate(
        "() => smachpy.store.panels.setPlots(Array.from({ length: 6 }, (_, i) => [`topic,t${i}`]))"
    )
    page.hover("[aria-label='plot a number of the run']")
    page.wait_for_selector("optgroup[label='topics']", state="attached")
    page.select_option("[aria-label='plot a number of the run']", "topic,battery")
    page.wait_for_selector(".notice.error:has-text('6 plots')")
    assert page.evaluate("() => smachpy.store.panels.plotsShown.value.length") == 6
