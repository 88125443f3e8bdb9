"""Where things stand: read from the geometry, for machines small and large."""

from __future__ import annotations

import html
import itertools
import math
from dataclasses import replace

import pytest

from smachpy import CBState, Concurrence, StateMachine
from smachpy.events.introspection import describe
from smachpy_viz.model.extract import extract
from smachpy_viz.model.machine import Diagram, Marks
from smachpy_viz.pictures import container_layout, curves, graphviz_process, layout, shapes
from smachpy_viz.pictures.theme import LIGHT

DOT = 4.5
ARROW = 9.0


class Picture:
    """Boxes and ends of arrows by name, in points."""

    def __init__(self, record, **options):
        self.root = shapes.shapes_of(Diagram(extract(record, **options)), LIGHT)
        self.geometry = graphviz_process.lay_out(lambda run: layout.compose(self.root, LIGHT, run))
        self.boxes = {box.name: self._box(box) for box in self._all(self.root)}

    def _all(self, box):
        yield box
        for child in box.boxes:
            yield from self._all(child)

    def _box(self, box):
        place = self.geometry[box.name]
        if "bb" in place:
            return tuple(map(float, place["bb"].split(",")))
        x, y = curves.point(place["pos"])
        return (x - 15, y - 12, x + 15, y + 12)  # no label is narrower

    def containers(self):
        return list(self.root.containers())

    def at(self, name):
        return curves.point(self.geometry[name]["pos"])

    def ends(self, arrow):
        """First and last point, the tip of the arrow included."""
        words = self.geometry[arrow.name]["pos"].split()
        points = [curves.point(word) for word in words if word[0] not in "es"]
        start, end = points[0], points[-1]
        for word in words:
            if word.startswith("s,"):
                start = curves.point(word[2:])
            if word.startswith("e,"):
                end = curves.point(word[2:])
        return (end, start) if arrow.back else (start, end)


@pytest.fixture(scope="module", params=["patrol", 60, 500])
def picture(request, patrol, large):
    return Picture(patrol if request.param == "patrol" else large(request.param), depth=99)


def inside(inner, outer):
    return (
        outer[0] <= inner[0]
        and outer[1] <= inner[1]
        and inner[2] <= outer[2]
        and inner[3] <= outer[3]
    )


def apart(one, two):
    return one[2] <= two[0] or two[2] <= one[0] or one[3] <= two[1] or two[3] <= one[1]


def test_every_state_stands_inside_its_container(picture):
    for container in picture.containers():
        for child in container.boxes:
            assert inside(picture.boxes[child.name], picture.boxes[container.name])


def test_no_state_stands_on_another(picture):
    for container in picture.containers():
        for one, two in itertools.combinations(container.boxes, 2):
            assert apart(picture.boxes[one.name], picture.boxes[two.name])


def test_entries_and_outcomes_stand_on_the_border(picture):
    for container in picture.containers():
        left, bottom, right, top = picture.boxes[container.name]
        x, y = picture.at(container.entry.name)
        assert y == pytest.approx(top, abs=1.5)
        assert left < x < right
        for pill in container.pills:
            x, y = picture.at(pill.name)
            assert y == pytest.approx(bottom, abs=1.5)
            assert left < x < right


def test_arrows_into_a_container_end_at_its_entry_or_its_side(picture):
    for container in picture.containers():
        for arrow in container.arrows:
            if not arrow.head.is_open or arrow.head.box == container.name:
                continue
            x, y = picture.ends(arrow)[1]
            left, bottom, right, top = picture.boxes[arrow.head.box]
            if arrow.head.part == "in":
                entry = picture.at(f"{arrow.head.box}_in")
                assert math.dist((x, y), entry) < 3 * DOT
            else:
                assert min(abs(x - left), abs(x - right)) < ARROW
                assert bottom - ARROW < y < top + ARROW


def test_arrows_out_of_a_container_begin_at_its_outcome(picture):
    for container in picture.containers():
        for arrow in container.arrows:
            if arrow.tail.is_open and arrow.tail.part.startswith("o"):
                x, y = picture.ends(arrow)[0]
                pill_x, pill_y = picture.at(f"{arrow.tail.box}_{arrow.tail.part}")
                assert y == pytest.approx(pill_y - 7.5, abs=4)
                assert abs(x - pill_x) < 130


def test_everything_is_on_the_canvas(picture):
    width, height = layout.canvas_size(picture.geometry)
    canvas = (
        -layout.PAD - 1,
        -layout.PAD - 1,
        width - layout.PAD + 1,
        height - layout.PAD + 1,
    )
    assert inside(picture.boxes[picture.root.name], canvas)


def test_no_arrow_leaves_the_outermost_box_sideways(picture):
    left, _, right, _ = picture.boxes[picture.root.name]
    for container in picture.containers():
        for arrow in container.arrows:
            xs = [x for x, _ in curves.trace(picture.geometry[arrow.name]["pos"])]
            assert left <= min(xs)
            assert max(xs) <= right


def test_the_reading_direction_is_down(patrol):
    picture = Picture(patrol)
    names = {box.attributes["id"]: box.name for box in picture._all(picture.root)}
    drive = "/PATROL/WATCHED_DRIVE/DRIVE"
    order = [f"{drive}/NEXT_WAYPOINT", f"{drive}/GO_THERE", f"{drive}/RECOVER"]
    tops = [picture.boxes[names[path]][3] for path in order]
    assert tops == sorted(tops, reverse=True)


def test_a_picture_is_the_same_every_time(patrol):
    assert Picture(patrol).geometry == Picture(patrol).geometry


def test_titles_do_not_lie_on_the_line_from_the_entry(picture):
    for container in picture.containers():
        words = container.attributes["label"].split("<b>")[1].split("</b>")[0]
        centre, _ = curves.point(picture.geometry[container.name]["lp"])
        entry, _ = picture.at(container.entry.name)
        assert abs(centre - entry) > len(words) * 2.2


@pytest.fixture(scope="module")
def looping(build):
    """A container inside, both outcomes of which lead back into it."""
    inner = build.machine("INNER", [build.leaf("A"), build.leaf("B")], {})
    back = {"succeeded": "INNER", "aborted": "INNER", "preempted": "DONE"}
    done = build.leaf("DONE")
    return build.rooted(build.machine("M", [inner, done], {"INNER": back}))


def test_arrows_back_into_their_container_go_round_it(looping):
    picture = Picture(looping)
    root = picture.root
    inner, done = root.boxes
    loops = [a for a in root.arrows if a.tail.box == a.head.box == inner.name]
    assert len(loops) == 2
    left, bottom, right, top = picture.boxes[inner.name]
    for arrow in loops:
        line = curves.trace(picture.geometry[arrow.name]["pos"], 8)
        assert not any(left < x < right and bottom < y < top for x, y in line)
        assert all(apart((x, y, x, y), picture.boxes[done.name]) for x, y in line)
        assert picture.ends(arrow)[1] == (pytest.approx(right), pytest.approx(top, abs=60))


def test_a_page_that_makes_dot_crash_is_laid_out_simpler(looping):
    root = shapes.shapes_of(Diagram(extract(looping)), LIGHT)

    def work(run):
        def fragile(texts):
            return [
                None if "splines=true" in text.splitlines()[2] else run([text])[0] for text in texts
            ]

        return layout.compose(root, LIGHT, fragile)

    assert graphviz_process.lay_out(work)[root.name]["bb"]


def test_a_page_that_always_crashes_is_told(looping):
    root = shapes.shapes_of(Diagram(extract(looping)), LIGHT)
    with pytest.raises(layout.LayoutError, match="/M/INNER"):
        layout.compose(root, LIGHT, lambda texts: [None for _ in texts])


def test_a_long_chain_is_folded(build):
    states = [build.leaf(f"STEP_{i}") for i in range(53)]
    onwards = {f"STEP_{i}": {"succeeded": f"STEP_{i + 1}"} for i in range(52)}
    picture = Picture(build.rooted(build.machine("CHAIN", states, onwards)))
    width, height = layout.canvas_size(picture.geometry)
    assert height < 53 * 30  # one below the other they need more than their own heights
    assert width < 2 * height
    tops = {round(box[3]) for name, box in picture.boxes.items() if name != picture.root.name}
    assert len(tops) < 30
    for one, two in itertools.combinations(picture.root.boxes, 2):
        assert apart(picture.boxes[one.name], picture.boxes[two.name])


def test_regions_side_by_side_become_a_grid(build):
    steps = [build.leaf(f"STEP_{i}") for i in range(4)]
    onwards = {f"STEP_{i}": {"succeeded": f"STEP_{i + 1}"} for i in range(3)}
    regions = [build.machine(f"ROBOT_{i}", steps, onwards) for i in range(20)]
    picture = Picture(build.rooted(build.concurrence("FLEET", regions, [])), depth=2)
    rows = {round(picture.boxes[box.name][3]) for box in picture.root.boxes}
    assert 2 <= len(rows) <= 10
    for one, two in itertools.combinations(picture.root.boxes, 2):
        assert apart(picture.boxes[one.name], picture.boxes[two.name])


@pytest.mark.parametrize("pieces", [2, 3, 7])
def test_the_pieces_of_a_fold_follow_the_arrows(build, pieces):
    names = [f"S{i}" for i in (3, 0, 2, 1)]
    onwards = {"S0": {"succeeded": "S1"}, "S1": {"succeeded": "S2"}, "S2": {"succeeded": "S3"}}
    record = build.machine("M", [build.leaf(name) for name in names], onwards)
    root = shapes.shapes_of(Diagram(extract(build.rooted(replace(record, initial=("S0",))))), LIGHT)
    labels = {box.name: box.attributes["id"].rpartition("/")[2] for box in root.boxes}
    dealt = {
        labels[name]: piece for name, piece in container_layout.pieces_of(root, pieces).items()
    }
    assert [dealt[f"S{i}"] for i in range(4)] == [i * pieces // 4 for i in range(4)]


def labels(root):
    return [html.unescape(pill.attributes["label"][1:-1]) for pill in root.pills]


def test_equal_arrows_of_many_states_are_told_at_the_outcome():
    sm = StateMachine(["done", "failed"], name="FLAT")
    step = CBState(lambda _: "ok", outcomes=["ok", "failed"])
    with sm:
        for i in range(7):
            StateMachine.add(f"S{i}", step, {"ok": f"S{i + 1}" if i < 6 else "done"})
    root = shapes.shapes_of(Diagram(extract(describe(sm), show_implicit=True)), LIGHT)
    assert labels(root) == ["done", "failed, from 7"]
    assert len(root.arrows) == 1 + 7  # the start, and each `ok`
    failed = Marks(visits={"/FLAT": 1}, taken={("/FLAT/S3", "failed"): 1})
    root = shapes.shapes_of(Diagram(extract(describe(sm), show_implicit=True), failed), LIGHT)
    assert labels(root) == ["done", "failed, from 6"]
    assert len(root.arrows) == 1 + 7 + 1  # and the one that the run took


@pytest.mark.parametrize(("branches", "arrows"), [(6, 2 * 6 + 1), (7, 0), (30, 0)])
def test_many_branches_are_a_grid_whose_rules_are_told_at_the_outcomes(branches, arrows):
    names = [f"BRANCH_{i:02}" for i in range(branches)]
    sm = Concurrence(
        ["all", "first", "failed"],
        default_outcome="failed",
        outcome_map={"all": dict.fromkeys(names, "ok"), "first": {names[0]: "late"}},
        name="WIDE",
    )
    with sm:
        for name in names:
            Concurrence.add(name, CBState(lambda _: "ok", outcomes=["ok", "late"]))
    found = Picture(describe(sm))
    if arrows:
        assert len(found.root.arrows) == arrows + 1
        return
    assert found.root.arrows == ()
    told = [f"all, all {branches}", "first, BRANCH_00: late"]
    assert labels(found.root)[:2] == told
    places = [found.at(box.name) for box in found.root.boxes]
    assert places == sorted(places, key=lambda at: (-at[1], at[0]))  # in the order of the machine
