"""The map beside the diagram: live, in recordings and in the one file; linked with the timeline."""

from __future__ import annotations

import json
import math

import pytest

from smachpy_viz.live import machines
from tests.places import DATA

pytestmark = pytest.mark.browser


def stamped(x, y):
    def message(kind, **fields):
        return {"$msg": kind, "fields": fields}

    turn = message("geometry_msgs/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
    pose = message(
        "geometry_msgs/Pose",
        position=message("geometry_msgs/Point", x=x, y=y, z=0.0),
        orientation=turn,
    )
    header = message("std_msgs/Header", frame_id="map")
    return message("geometry_msgs/PoseStamped", header=header, pose=pose)


def goal(n, path, x, at):
    facts = {"action": "move_base", "goal_id": str(n), "goal": {"target_pose": stamped(x, 1.0)}}
    return ("GoalSent", path, {**facts, "at": at})


def run():
    """A drives from (1, 1) to (3, 1) in 4 s, then B back."""
    return [
        ("Started", "/JOB", {"at": 0.0}),
        ("Entered", "/JOB/A", {"at": 1.0}),
        goal(1, "/JOB/A", 3.0, 1.0),
        ("GoalDone", "/JOB/A", {"action": "move_base", "goal_id": "1", "status": "SUCCEEDED",
                                "text": "arrived", "result": None, "at": 5.0}),
        ("Left", "/JOB/A", {"outcome": "ok", "at": 5.0}),
        ("Entered", "/JOB/B", {"at": 5.0}),
        goal(2, "/JOB/B", 1.0, 5.0),
        ("Left", "/JOB/B", {"outcome": "ok", "at": 9.0}),
        ("Finished", "/JOB", {"outcome": "done", "at": 9.0}),
    ]  # fmt: skip


def observed(served):
    """A map, and poses ten times a second, there and back on another line."""

    def record(n, seconds, what, **facts):
        stamp = served.began + int(seconds * 1e9)
        return {"kind": "Observed", "path": "", "n": n, "stamp_ns": stamp, "what": what,
                "robot": "", **facts}  # fmt: skip

    shared = json.loads((DATA / "observed.json").read_text(encoding="utf-8"))[0]
    floor = {name: shared[name] for name in ("width", "height", "cells", "origin")}
    told = [record(1, 0.0, "map", **{**floor, "resolution": 2.0, "origin": [0.0, 0.0, 0.0]})]
    for n in range(81):
        x = 1.0 + min(n, 40) / 20 - max(0, n - 40) / 20
        y = 1.0 + (0.8 if n > 40 else 0.0)
        told.append(record(n + 2, 1.0 + n / 10, "pose", at=[x, y, 0.0 if n < 40 else math.pi]))
    return told


@pytest.fixture
def office(served):
    served.add("one", events=run(), observed=observed(served))
    return served


AT = """([x, y]) => { smachpy.page.map.draw(); const b = document.querySelector('.map-view canvas').getBoundingClientRect();
  const [px, py] = smachpy.page.map.at({ x, y }); return [b.left + px, b.top + py]; }"""


def test_a_press_on_the_track_goes_to_its_instant(office, look):
    page = look(office.start())
    page.wait_for_selector(".map-view canvas")
    page.mouse.click(*page.evaluate(AT, [2.0, 1.0]))
    page.wait_for_selector(".banner.past")
    assert (
        page.evaluate("() => smachpy.store.clock.instantText(smachpy.store.playback.cursor.value)")
        == "00:03.0"
    )
    assert page.evaluate("() => smachpy.store.view.selected.value") == "/JOB/A"
    # What comes later has not been driven yet.
    page.mouse.move(*page.evaluate(AT, [2.0, 1.8]))
    assert page.evaluate("() => smachpy.store.pointer.hovered.value") is None


def test_two_fingers_zoom_the_map(office, look):
    page = look(office.start())
    page.wait_for_selector(".map-view canvas")
    pinch = """() => { const canvas = document.querySelector('.map-view canvas'), { map } = smachpy.page;
      const { left, top } = canvas.getBoundingClientRect(), before = map.at({ x: 2, y: 1 });
      const on = (type, id, [x, y], target = window) => target.dispatchEvent(new PointerEvent(type,
        { pointerId: id, clientX: left + x, clientY: top + y, bubbles: true, pointerType: 'touch' }));
      const [x, y] = before, far = map.at({ x: 3, y: 1 })[0] - x;
      on('pointerdown', 1, [x, y], canvas); on('pointerdown', 2, [x + 40, y], canvas);
      on('pointermove', 2, [x + 120, y]); on('pointerup', 2, [x + 120, y]); on('pointerup', 1, [x, y]);
      return [(map.at({ x: 3, y: 1 })[0] - map.at({ x: 2, y: 1 })[0]) / far, map.at({ x: 2, y: 1 })[0] - x]; }"""
    factor, moved = page.evaluate(pinch)
    assert factor == pytest.approx(3)
    assert moved == pytest.approx(0, abs=1)  # what is under a finger stays there
    assert page.evaluate("() => smachpy.store.playback.cursor.value") is None  # and was not tapped


def test_hovering_is_linked_both_ways(office, look):
    page = look(office.start())
    page.wait_for_selector(".map-view canvas")
    page.mouse.move(*page.evaluate(AT, [2.0, 1.8]))
    page.wait_for_selector(".map-view .tip")
    assert page.evaluate("() => smachpy.store.pointer.hovered.value.path") == "/JOB/B"
    assert "00:05.0 \u2013 00:09.0, 4.0 s" in page.text_content(".map-view .tip")
    page.wait_for_selector("g[data-path='/JOB/B'].linked")
    bar = """() => { const t = smachpy.page.timeline, b = t.canvas.getBoundingClientRect(),
      h = t.bars.hits.find((one) => one.span.path === '/JOB/A'); return [b.left + h.left + 5,
        b.top + (h.top + h.bottom) / 2]; }"""
    page.mouse.move(*page.evaluate(bar))
    page.wait_for_selector("g[data-path='/JOB/A'].linked")
    assert "ok 00:01.0 \u2013 00:05.0" in page.text_content(".map-view .tip")
    page.mouse.move(5, 5)
    page.wait_for_selector(".map-view .tip", state="detached")


def test_hovering_the_diagram_a_goal_or_the_log_lights_up_the_visit_everywhere(office, look):
    page = look(office.start())
    page.wait_for_selector(".map-view canvas")
    page.hover("g.leaf[data-path='/JOB/A']")
    page.wait_for_selector(".map-view .tip")
    assert "00:01.0 \u2013 00:05.0" in page.text_content(".map-view .tip")
    page.wait_for_selector(".log li.lit:has-text('goal to move_base')")
    page.wait_for_selector(".ended-goal.lit:has-text('arrived')")
    page.mouse.move(5, 5)
    page.wait_for_selector(".log li.lit", state="detached")
    page.hover(".ended-goal:has-text('arrived')")
    page.wait_for_selector("g[data-path='/JOB/A'].linked")
    page.hover(".log li:has-text('goal to move_base')")
    page.wait_for_selector("g[data-path='/JOB/B'].linked")
    page.mouse.move(5, 5)
    page.wait_for_selector("g.linked", state="detached")
    page.focus(".ended-goal .link")
    page.wait_for_selector("g[data-path='/JOB/A'].linked")


def test_the_floor_is_drawn_in_the_colours_of_the_theme(office, look):
    page = look(office.start())
    page.wait_for_selector(".map-view canvas")
    colour = """([x, y]) => { const { map } = smachpy.page; const [px, py] = map.at({ x, y }), r = devicePixelRatio;
      return [...map.context.getImageData(Math.round(px * r), Math.round(py * r), 1, 1).data].slice(0, 3); }"""
    page.wait_for_function(f"() => String(({colour})([3.0, 0.3])) === '59,71,84'")  # --wall
    assert page.evaluate(colour, [1.0, 0.3]) == [255, 255, 255]
    page.evaluate("() => smachpy.page.setTheme('dark')")
    page.wait_for_function(f"() => String(({colour})([3.0, 0.3])) === '147,161,176'")


def test_a_page_hears_of_the_robot_while_it_moves(office, look, monkeypatch):
    served = office
    served.add("two", events=run()[:3])
    page = look(f"{served.start()}?machine=two")
    assert page.query_selector(".map-panel")  # its goal is a place
    machine = served.machines.get("two")
    told = observed(served)
    for record in told:
        machine.observe([record])
    page.wait_for_function("() => smachpy.store.data.scene.robots.get('')?.poses.length === 81")
    monkeypatch.setattr(machines, "MAX_KEPT_OBSERVATIONS", 50)
    last = told[-1]
    machine.observe(
        [*told, *({**last, "n": last["n"] + n} for n in range(1, 33))]
    )  # most are known
    assert len(machine.observed()) == 51  # and the map
    late = look(f"{served.address}?machine=two")
    late.wait_for_function("() => smachpy.store.data.scene.robots.get('')?.poses.length > 5")
    assert late.evaluate("() => smachpy.store.data.scene.maps.length") == 1
    assert page.evaluate("() => smachpy.store.data.scene.robots.get('').poses.length") == 81


def test_a_machine_without_a_robot_has_no_map(served, look):
    served.add("one", events=[("Started", "/JOB"), ("Entered", "/JOB/A")])
    page = look(served.start())
    assert page.query_selector(".map-panel") is None


def test_values_that_are_no_map_hurt_nothing(served, look):
    record = observed(served)[0]
    bad = [
        {**record, "n": 1, "cells": "no base64!"},
        {**record, "n": 2, "cells": "AAAA"},
        {**record, "n": 3, "width": 7},
    ]
    served.add(
        "one",
        events=run(),
        observed=[*bad, *({**r, "n": r["n"] + 3} for r in observed(served)[1:])],
    )
    page = look(served.start())
    page.mouse.click(*page.evaluate(AT, [2.0, 1.0]))
    page.wait_for_selector(".banner.past")


def test_the_one_file_has_the_map(office, look, tmp_path):
    office.start()
    import urllib.request

    with urllib.request.urlopen(f"{office.address}api/export?machine=one&format=html") as answer:
        (tmp_path / "run.html").write_bytes(answer.read())
    page = look((tmp_path / "run.html").as_uri())
    page.wait_for_selector(".map-view canvas")
    page.mouse.click(*page.evaluate(AT, [2.0, 1.0]))
    page.wait_for_selector(".banner.past")
    with urllib.request.urlopen(f"{office.address}api/export?machine=one&format=jsonl") as answer:
        lines = [json.loads(line) for line in answer.read().splitlines()]
    assert sum(line.get("kind") == "Observed" for line in lines) == 82


def test_a_phone_shows_the_map(office, look):
    page = look(office.start())
    page.set_viewport_size({"width": 390, "height": 844})
    page.click(".parts button:has-text('Map')")
    page.wait_for_selector(".map-view canvas", state="visible")
    box = page.query_selector(".map-view canvas").bounding_box()
    assert box["width"] > 330
    assert box["height"] > 120


def test_a_floor_from_a_file_is_shown_until_a_topic_tells_one(served, look):
    shared = json.loads((DATA / "observed.json").read_text(encoding="utf-8"))[0]
    served.machines = machines.Machines({**shared, "stamp_ns": 0, "n": 0})
    machine = served.add("one", events=run())
    served.add("two", events=run(), observed=observed(served))
    page = look(f"{served.start()}?machine=one")
    page.wait_for_function("() => smachpy.store.data.scene.mapAt(Date.now())?.resolution === 0.5")
    machine.observe(observed(served)[:1])
    page.wait_for_function("() => smachpy.store.data.scene.mapAt(Date.now())?.resolution === 2")
    other = look(f"{served.address}?machine=two")
    other.wait_for_function("() => smachpy.store.data.scene.maps.length === 1")
