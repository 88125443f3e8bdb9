from __future__ import annotations

import itertools

import pytest

from smachpy_viz.model.labels import shorten
from smachpy_viz.model.machine import Diagram, Marks, Node
from smachpy_viz.pictures import style
from smachpy_viz.pictures.theme import DARK, LIGHT, THEMES

STATE = Node("/M/A", "A", "action", details=(("action", "move_base"),), doc="Drives.")


def luminance(colour):
    def linear(value):
        value /= 255
        return value / 12.92 if value <= 0.03928 else ((value + 0.055) / 1.055) ** 2.4

    red, green, blue = (linear(int(colour[i : i + 2], 16)) for i in (1, 3, 5))
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one, two):
    bright, dark = sorted((luminance(one), luminance(two)), reverse=True)
    return (bright + 0.05) / (dark + 0.05)


def swatches(theme):
    return [theme.active, theme.success, theme.failure, theme.preempted, theme.other]


@pytest.mark.parametrize("theme", THEMES.values(), ids=THEMES)
def test_text_can_be_read_on_every_fill(theme):
    for swatch in [*swatches(theme), theme.inactive]:
        assert contrast(swatch.text, swatch.fill) >= 7
    for ground in (theme.background, *theme.containers):
        assert contrast(theme.ink, ground) >= 7
        assert contrast(theme.muted, ground) >= 5.1


@pytest.mark.parametrize("theme", THEMES.values(), ids=THEMES)
def test_strokes_stand_out_from_every_ground(theme):
    for ground, swatch in itertools.product((theme.background, *theme.containers), swatches(theme)):
        assert contrast(swatch.stroke, ground) >= 3


def test_deep_containers_alternate_between_the_last_two_tones():
    tones = [LIGHT.container(depth) for depth in range(8)]
    assert tones[:4] == list(LIGHT.containers)
    assert tones[4:] == [tones[2], tones[3], tones[2], tones[3]]


@pytest.mark.parametrize(
    "text", ["<script>", 'a"b', "a&b", "\\N\\G", "\x00\x1b[31m", "x" * 10_000, "", "\ud800"]
)
def test_no_text_gets_into_markup_as_markup(text):
    safe = style.markup(text)
    assert not set(safe) & set('<>"\n\x00\x1b\\')
    assert safe
    assert len(shorten(text)) <= 40


@pytest.mark.parametrize(
    "text", ["\u0645\u06cc\u200c\u062e\u0648\u0627\u0647\u0645", "\U0001f469\u200d\U0001f680"]
)
def test_joiners_inside_words_and_emoji_are_kept(text):
    assert shorten(text) == text


def test_values_that_look_like_markup_stay_text():
    import graphviz

    dot = graphviz.Digraph()
    dot.node("a", tooltip=style.plain("<b>x</b>"))
    assert 'tooltip="<b>x</b>"' in dot.source


def test_a_running_state_is_blue_and_bold():
    diagram = Diagram(STATE, Marks(active=frozenset({"/M/A"})))
    look = style.state(STATE, diagram, LIGHT)
    assert look["color"] == LIGHT.active.stroke
    assert "<b>A</b>" in look["label"]


@pytest.mark.parametrize(
    ("outcome", "swatch"),
    [
        ("succeeded", DARK.success),
        ("aborted", DARK.failure),
        ("preempted", DARK.preempted),
        ("other", DARK.other),
    ],
)
def test_a_state_that_ended_shows_how(outcome, swatch):
    diagram = Diagram(STATE, Marks(visits={"/M/A": 3}, last={"/M/A": outcome}))
    look = style.state(STATE, diagram, DARK)
    assert look["fillcolor"] == swatch.fill
    assert "\u00d73" in look["label"]


def test_what_a_monitor_finds_is_drawn_as_no_failure():
    state = Node("/M/A", "A", "monitor")
    marks = Marks(visits={"/M/A": 1}, last={"/M/A": "invalid"})
    assert style.state(state, Diagram(state, marks), DARK)["fillcolor"] == DARK.other.fill
    args = {"counts": {}, "labelled": True, "implicit": False}
    arrows = {
        kind: style.transition(["invalid"], Node("/M/A", "A", kind), LIGHT, Marks(), **args)
        for kind in ("monitor", "action")
    }
    assert arrows["monitor"]["color"] == LIGHT.edge
    assert LIGHT.failure.text not in arrows["monitor"]["label"]
    assert arrows["action"]["color"] == LIGHT.failure.stroke


def test_what_a_run_never_touched_stands_back():
    diagram = Diagram(STATE, Marks(visits={"/M": 1}))
    assert style.state(STATE, diagram, LIGHT)["color"] == LIGHT.faint


def test_tooltips_tell_path_kind_details_and_doc():
    tooltip = style.state(STATE, Diagram(STATE), LIGHT)["tooltip"]
    assert tooltip == "/M/A\\naction\\naction: move_base\\nDrives."


def test_taken_arrows_are_thick_and_counted():
    marks = Marks(visits={"/M": 1})
    args = {"labelled": True, "implicit": False}
    taken = style.transition(["a", "b"], STATE, LIGHT, marks, counts={"a": 2}, **args)
    spare = style.transition(["a"], STATE, LIGHT, marks, counts={}, **args)
    assert float(taken["penwidth"]) > 2
    assert "a&#160;\u00d72" in taken["label"]
    assert spare["color"] != taken["color"]


@pytest.mark.parametrize("taken", [0, 1, 3])
@pytest.mark.parametrize("labelled", [True, False])
def test_an_arrow_with_a_condition_has_no_empty_font(taken, labelled):
    """Graphviz 2.43 drew no picture: a syntax error."""
    look = style.transition(
        ["done", "failed"],
        STATE,
        LIGHT,
        Marks(),
        counts={"done": taken},
        labelled=labelled,
        implicit=False,
        remark="x above 1",
    )
    assert "></font>" not in look["label"]
    assert "x above 1" in look["label"]
