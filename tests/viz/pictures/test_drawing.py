"""From a machine to a file, with a real `dot`."""

from __future__ import annotations

import json
import re
import subprocess
from xml.etree import ElementTree as ET

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import smachpy
from smachpy import events as ev
from smachpy import pnp, viz
from smachpy.events.introspection import RuleRecord, StateRecord, TransitionRecord, describe
from smachpy_viz.pictures import drawing, graphviz_process, text_widths

SVG = "{http://www.w3.org/2000/svg}"
HOSTILE = [
    "<script>alert(1)</script>",
    '"quoted" \\N \\G \\',
    "a&b;&lt;&#38;",
    "x" * 10_000,
    "日本語 ünï 🤖",
    "new\nline\ttab",
    "}",
    "// end of graph",
    "\x00\x07\x1b[31m",
    "a:b:c",
    "--> x; y",
    "\ud800",
    "",
    "]]>",
    "<<TABLE>>",
]


def states_of(svg):
    """Ids of everything drawn as a state or a container, in the order of drawing."""
    tree = ET.fromstring(svg)
    groups = tree.iter(f"{SVG}g")
    return [g.get("id") for g in groups if g.get("id", "").startswith("/")]


def texts_of(svg):
    return [t.text for t in ET.fromstring(svg).iter(f"{SVG}text")]


def test_every_state_is_in_the_picture_under_its_path(patrol):
    svg = viz.picture(patrol, "svg")
    assert sorted(states_of(svg)) == sorted(state.path for state in patrol.walk())


def test_outcomes_stand_beside_arrows_and_on_borders(patrol):
    texts = texts_of(viz.picture(patrol, "svg"))
    assert "battery_low" in texts
    assert "round_done" in texts
    assert texts.count("preempted") == 1  # of the whole machine; defaults are hidden


@pytest.mark.parametrize("form", ["svg", "png", "pdf", "dot", "gv", "json", "mmd", "txt"])
def test_the_ending_names_the_format(patrol, tmp_path, form):
    file = viz.render(patrol, tmp_path / "new" / f"m.{form}")
    assert file.read_bytes() == viz.picture(patrol, form) or form == "pdf"
    assert [p.name for p in file.parent.iterdir()] == [f"m.{form}"]


def test_an_unknown_format_names_the_known_ones(patrol, tmp_path):
    with pytest.raises(viz.PictureError, match=r"got 'bmp'; expected one of dot, gv, json"):
        viz.render(patrol, tmp_path / "m.bmp")


def test_an_unknown_theme_names_the_known_ones(patrol):
    with pytest.raises(viz.PictureError, match=r"\['dark', 'light'\]"):
        viz.picture(patrol, "svg", theme="pink")


def test_a_place_that_cannot_be_written_is_told(patrol, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(viz.PictureError, match="cannot be written"):
        viz.render(patrol, tmp_path / "file" / "m.txt")


def test_themes_differ_in_colours_only(patrol):
    light = viz.picture(patrol, "svg").decode()
    dark = viz.picture(patrol, "svg", theme="dark").decode()
    colour = re.compile("#[0-9a-f]{6}")
    assert colour.sub("", light) == colour.sub("", dark)
    assert light != dark


def test_json_comes_back_as_the_same_record(patrol):
    assert StateRecord.from_json(viz.picture(patrol, "json").decode()) == patrol


def test_dot_text_can_be_laid_out_by_any_dot(patrol, tmp_path):
    file = viz.render(patrol, tmp_path / "m.dot")
    done = subprocess.run(
        [*graphviz_process.find_dot(), "-Tsvg", file], capture_output=True, check=True
    )
    assert sorted(states_of(done.stdout)) == sorted(state.path for state in patrol.walk())
    assert b"is inside" not in done.stderr


def test_path_draws_a_part(patrol):
    svg = viz.picture(patrol, "svg", path="/PATROL/CHARGE")
    assert states_of(svg) == [
        "/PATROL/CHARGE",
        "/PATROL/CHARGE/DOCK",
        "/PATROL/CHARGE/WAIT_FULL",
    ]


def test_a_plain_state_is_a_picture_too(patrol):
    assert states_of(viz.picture(patrol, "svg", path="CHARGE/DOCK")) == ["/PATROL/CHARGE/DOCK"]


def test_active_marks_a_state_and_what_contains_it(patrol):
    svg = viz.picture(patrol, "svg", active=["CHARGE/DOCK"]).decode()
    plain = viz.picture(patrol, "svg").decode()
    assert svg.count('stroke="#0082d4"') - plain.count('stroke="#0082d4"') == 3


def test_active_names_a_state_that_must_exist(patrol):
    with pytest.raises(viz.UnknownPathError, match="CHARGE/DOCK"):
        viz.picture(patrol, "svg", active=["/PATROL/CHARGE/DUCK"])


def test_a_run_marks_what_was_visited_and_taken(patrol):
    run = [
        ev.Started("/PATROL", 0.0, 0),
        ev.Entered("/PATROL/CHARGE", 0.0, 0),
        ev.Entered("/PATROL/CHARGE/DOCK", 0.0, 0),
        ev.Left("/PATROL/CHARGE/DOCK", 1.0, 0, "succeeded"),
        ev.Entered("/PATROL/CHARGE/DOCK", 1.0, 0),
        ev.Left("/PATROL/CHARGE/DOCK", 2.0, 0, "succeeded"),
        ev.Entered("/PATROL/CHARGE/WAIT_FULL", 2.0, 0),
    ]
    texts = texts_of(viz.picture(patrol, "svg", run=run))
    assert any("\u00d72" in text for text in texts)
    assert any("\u221a" in text for text in texts)


@pytest.mark.parametrize("form", ["svg", "dot", "mmd", "txt", "json", "png"])
def test_hostile_names_are_harmless(build, form):
    children = [
        build.leaf(
            name, outcomes=(name or "none", "aborted"), doc=f"{name}\n}}", details=((name, name),)
        )
        for name in HOSTILE
    ]
    inner = build.machine("<b>in", [build.leaf('"x"'), build.leaf("\\N")], {})
    transitions = {
        here.label: {here.outcomes[0]: there.label}
        for here, there in zip(children, [*children[1:], inner], strict=True)
    }
    outcomes = ("aborted", "succeeded", "preempted", '<o>"&')
    record = build.rooted(build.machine('R"<i>&', [*children, inner], transitions, outcomes))
    data = viz.picture(record, form, depth=3, show_implicit=True)
    if form == "svg":
        assert len(states_of(data)) == sum(1 for _ in record.walk())
        texts = texts_of(data)
        assert "<script>alert(1)</script>" in texts
        assert any(text.startswith("x" * 39) and len(text) == 40 for text in texts)
        assert any("\\\u200bN" in text for text in texts)
        assert b"<script" not in data
    if form == "dot":
        done = subprocess.run(
            [*graphviz_process.find_dot(), "-Tsvg"], input=data, capture_output=True, check=True
        )
        assert len(states_of(done.stdout)) == sum(1 for _ in record.walk())


names = st.text(max_size=12) | st.sampled_from(["A", "B", "C", *HOSTILE])


@st.composite
def records(draw, depth=2):
    kind = draw(st.sampled_from(["action", "callback", "service", "monitor", "condition"]))
    outcomes = tuple(draw(st.lists(names, min_size=1, max_size=3, unique=True)))
    label = draw(names)
    if depth == 0 or draw(st.booleans()):
        return StateRecord("", label, kind, "S", outcomes)
    children = draw(
        st.lists(records(depth - 1), min_size=1, max_size=4, unique_by=lambda c: c.label)
    )
    labels = [child.label for child in children]
    pairs = [(child.label, outcome) for child in children for outcome in child.outcomes]
    edges = []
    for source, outcome in pairs:
        inside = draw(st.booleans())
        target = draw(st.sampled_from(labels if inside else list(outcomes)))
        edges.append(TransitionRecord(source, outcome, target, not inside, draw(st.booleans())))
    rules = draw(
        st.lists(
            st.builds(
                RuleRecord,
                st.sampled_from(outcomes),
                st.lists(st.sampled_from(pairs), max_size=3).map(tuple),
                st.sampled_from(["any of x", "2 of x", "all of x", ""]) | names,
            ),
            max_size=3,
        )
    )
    return StateRecord(
        "", label, draw(st.sampled_from(["machine", "concurrence", "iterator", "sequence"])), "C",
        outcomes, children=tuple(children),
        initial=tuple(draw(st.lists(st.sampled_from(labels), unique=True))),
        transitions=tuple(edges), rules=tuple(rules),
    )  # fmt: skip


@pytest.mark.slow
@settings(max_examples=20, deadline=None, suppress_health_check=list(HealthCheck))
@given(record=records(), show_implicit=st.booleans(), depth=st.integers(1, 3) | st.none())
def test_whatever_the_machine_it_is_drawn(build, record, show_implicit, depth):
    whole = build.rooted(record)
    options = {"show_implicit": show_implicit, "depth": depth}
    ET.fromstring(viz.picture(whole, "svg", **options))
    for form in ("dot", "mmd", "txt"):
        viz.picture(whole, form, **options).decode("utf-8")


def test_inconsistent_records_are_drawn_as_far_as_they_go(build):
    record = StateRecord(
        "/M", "M", "machine", "StateMachine", ("done",),
        children=(build.leaf("A"),), initial=("GONE",),
        transitions=(
            TransitionRecord("A", "succeeded", "NOWHERE"),
            TransitionRecord("B", "succeeded", "A"),
            TransitionRecord("A", "aborted", "no_outcome", target_is_outcome=True),
        ),
        rules=(RuleRecord("nothing", (("A", "x"),)), RuleRecord("done", (("Z", "x"),))),
    )  # fmt: skip
    for form in ("svg", "dot", "mmd", "txt"):
        assert viz.picture(build.rooted(record), form)


def test_the_atlas_has_a_page_per_container_and_links_them(patrol, tmp_path):
    index = viz.atlas(patrol, tmp_path / "atlas")
    assert index.name == "index.svg"
    pages = {page.name: page.read_bytes() for page in index.parent.iterdir()}
    assert len(pages) == sum(1 for state in patrol.walk() if state.children)
    links = {
        a.get("{http://www.w3.org/1999/xlink}href")
        for page in pages.values()
        for a in ET.fromstring(page).iter(f"{SVG}a")
    } - {None}
    assert links == set(pages)


def test_the_atlas_of_a_plain_state_is_its_one_page(build, tmp_path):
    viz.atlas(build.rooted(build.leaf("A")), tmp_path)
    assert [page.name for page in tmp_path.iterdir()] == ["index.svg"]


def test_a_real_machine_is_drawn_before_and_after_its_run():
    class Step(smachpy.State):
        def __init__(self):
            super().__init__(outcomes=["succeeded", "aborted"])

        def execute(self, userdata):
            return "succeeded"

    machine = smachpy.StateMachine(outcomes=["succeeded", "aborted"])
    with machine:
        smachpy.StateMachine.add("ONE", Step(), transitions={"succeeded": "BOTH"})
        both = smachpy.Concurrence(
            outcomes=["succeeded", "aborted"],
            default_outcome="aborted",
            outcome_map={"succeeded": {"LEFT": "succeeded", "RIGHT": "succeeded"}},
        )
        with both:
            smachpy.Concurrence.add("LEFT", Step())
            smachpy.Concurrence.add("RIGHT", Step())
        smachpy.StateMachine.add("BOTH", both)
    assert "ONE" in viz.svg(machine)
    history = viz.History()
    machine.subscribe(history.on_event)
    assert machine.execute() == "succeeded"
    text = viz.picture(machine, "txt", run=history).decode()
    assert "BOTH (concurrent) [succeeded]" in text
    assert "\u221a" in "".join(texts_of(viz.picture(machine, "svg", run=history)))
    assert json.loads(viz.picture(machine, "json")) == json.loads(describe(machine).to_json())


def test_the_resolution_of_a_png_has_a_limit():
    def resolution(width, height):
        return drawing._resolution({"canvas": {"viewport": f"{width},{height},1,0,0"}})

    assert resolution(500, 900) == 144
    assert resolution(500, 72_000) == 16


def test_a_notebook_shows_the_machine():
    machine = smachpy.StateMachine(outcomes=["done"], name="SHOWN")
    with machine:
        smachpy.StateMachine.add("ONLY", smachpy.State(outcomes=["done"]))
    assert states_of(machine._repr_svg_()) == ["/SHOWN", "/SHOWN/ONLY"]


def test_a_picture_that_nobody_can_look_at_is_refused_with_the_way_out(build, monkeypatch):
    monkeypatch.setattr(drawing, "LARGEST", 500)
    record = build.rooted(build.machine("M", [build.leaf(f"S{i}") for i in range(20)], {}))
    with pytest.raises(drawing.TooLargeError, match="--atlas") as caught:
        viz.picture(record, "svg")
    assert caught.value.path == "/M"
    assert caught.value.states == 21
    assert max(caught.value.size) > 500
    assert viz.picture(record, "txt")


def test_a_container_with_too_many_states_is_refused_at_once(build, tmp_path):
    record = build.rooted(build.machine("M", [build.leaf(f"S{i}") for i in range(5000)], {}))
    for draw in (lambda: viz.picture(record, "png"), lambda: viz.atlas(record, tmp_path / "pages")):
        with pytest.raises(drawing.TooLargeError, match=r"FILE\.txt") as caught:
            draw()
        assert (caught.value.path, caught.value.states) == ("/M", 5000)


@pytest.mark.slow
def test_a_net_in_which_each_place_leads_to_many_others_is_drawn():
    """As planners write policies: `dot` is not done with it in minutes."""
    places = 40
    net = pnp.Net(
        "policy",
        tuple(pnp.Place(f"p{i}", f"at_{i}", int(i == 0)) for i in range(places)),
        tuple(
            pnp.Transition(f"t{i}_{j}", f"[seen_{j}]")
            for i in range(places)
            for j in range(places)
            if (i - j) % 3 == 1
        ),
        tuple(
            arc
            for i in range(places)
            for j in range(places)
            if (i - j) % 3 == 1
            for arc in (
                pnp.Arc(f"p{i}", f"t{i}_{j}"),
                pnp.Arc(f"t{i}_{j}", f"p{j}"),
            )
        ),
    )
    plan = pnp.PetriNetPlan(net)
    content = viz.picture(plan, "svg").decode()
    states = states_of(content)
    assert len(states) == len(set(states)) == 1 + len(net.places) + len(net.transitions) > 500
    paths = [e for e in ET.fromstring(content).iter(f"{SVG}g") if e.get("class") == "edge"]
    assert len(paths) >= len(net.arcs)


@pytest.mark.slow
def test_a_thousand_nested_states_are_one_picture_of_a_size_that_opens(build):
    def nested(label, levels):
        children = [
            nested(f"{label}{i}", levels - 1) if levels else build.leaf(f"{label}{i}")
            for i in range(10)
        ]
        onwards = {children[i].label: {"succeeded": children[i + 1].label} for i in range(9)}
        return build.machine(label, children, onwards)

    svg = ET.fromstring(viz.picture(build.rooted(nested("S", 2)), "svg", depth=20))
    assert max(map(float, svg.get("viewBox").split())) <= drawing.LARGEST


@pytest.mark.usefixtures("any_dot")
def test_every_text_of_an_svg_has_the_width_that_there_is_room_for(patrol, tmp_path):
    viz.atlas(patrol, tmp_path)
    pages = [viz.picture(patrol, "svg"), *(page.read_bytes() for page in tmp_path.iterdir())]
    for page in pages:
        texts = list(ET.fromstring(page).iter(f"{SVG}text"))
        assert texts
        for text in texts:
            width = float(text.get("textLength"))
            letters = len(text.text)
            assert text.get("lengthAdjust") == "spacingAndGlyphs"
            assert 2 <= width / letters <= float(text.get("font-size"))


@pytest.mark.parametrize(("align", "anchor"), [("l", "start"), ("c", "middle"), ("r", "end")])
def test_a_text_has_its_width_wherever_graphviz_anchors_it(align, anchor):
    svg = f'<svg><text text-anchor="{anchor}" x="27" y="-14.3" font-size="14.00">a</text></svg>'
    step = {"op": "T", "pt": [27, 14.3], "align": align, "width": 7.5, "text": "a"}
    drawn = {"objects": [{"_ldraw_": [step]}]}
    (text,) = ET.fromstring(text_widths.with_widths(svg.encode(), drawn))
    assert text.attrib["textLength"] == "7.5"
