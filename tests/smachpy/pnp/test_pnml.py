"""PNML files: both dialects, and everything that can be wrong with one."""

from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

import viz
from smachpy.checks import check
from smachpy.exceptions import InvalidStateError
from smachpy.pnp import (
    Arc,
    Net,
    Place,
    PlanError,
    Transition,
    explore,
    load_plan,
    parse_pnml,
    pnml_text,
    read_pnml,
    understand,
    write_pnml,
)

JARP = """<?xml version="1.0" encoding="ISO-8859-1"?>
<pnml>
  <net id="n1" type="PTNet">
    <toolspecific tool="JARP" version="1.2"><FrameColor><value>5</value></FrameColor></toolspecific>
    <place id="p1">
      <graphics><position x="1" y="2"/></graphics>
      <name><value>init</value></name>
      <initialMarking><value>Default,1</value></initialMarking>
    </place>
    <place id="p2"><name><value>say_caf\u00e9.exec</value></name></place>
    <place id="p3"><name><value>goal</value></name></place>
    <transition id="t1"><name><value>say_caf\u00e9.start</value></name></transition>
    <transition id="t2"><name><value>say_caf\u00e9.end</value></name></transition>
    <arc id="a1" source="p1" target="t1"><inscription><value>1</value></inscription></arc>
    <arc id="a2" source="t1" target="p2"/>
    <arc id="a3" source="p2" target="t2"/>
    <arc id="a4" source="t2" target="p3"/>
  </net>
</pnml>
"""

ISO = """<pnml xmlns="http://www.pnml.org/version-2009/grammar/pnml">
  <net id="n" type="http://www.pnml.org/version-2009/grammar/ptnet">
    <name><text>visit</text></name>
    <page id="top">
      <arc id="a1" source="p" target="t"><inscription><text>2</text></inscription></arc>
      <place id="p"><name><text>init</text></name><initialMarking><text>2</text></initialMarking></place>
      <page id="inner">
        <place id="q"><name><text>goal</text></name></place>
        <transition id="t"><name><text>go</text></name></transition>
        <referencePlace id="r" ref="q"/>
      </page>
      <arc id="a2" source="t" target="r"/>
    </page>
  </net>
</pnml>"""


def test_jarps_dialect():
    net, problems = parse_pnml(JARP.encode("iso-8859-1"), name="greet")
    assert net.name == "greet"
    assert [(p.id, p.name, p.tokens) for p in net.places] == [
        ("p1", "init", 1), ("p2", "say_caf\u00e9.exec", 0), ("p3", "goal", 0),
    ]  # fmt: skip
    assert net.places[0].line == 5
    assert net.arcs[0] == Arc("p1", "t1")
    assert problems == ()
    assert len(explore(net).came) == 3


def test_2009():
    net, problems = parse_pnml(ISO)
    assert (net.name, problems) == ("visit", ())
    assert net.arcs == (Arc("p", "t", 2), Arc("t", "q"))
    assert net.initial == (0, 0)
    assert net.fire(net.initial, 0) == (1,)


def test_a_comment_names_the_plan():
    text = JARP.replace(
        "<place", "<comment><text><value>PLAN NAME: hello</value></text></comment><place", 1
    )
    assert parse_pnml(text)[0].name == "hello"


def test_an_arc_above_its_end_is_dropped_as_there_with_a_warning():
    arc = '<arc id="early" source="p1" target="t2"/>'
    net, problems = parse_pnml(JARP.replace("<place", f"{arc}<place", 1))
    assert Arc("p1", "t2") not in net.arcs
    assert [(p.rule, p.severity, p.line) for p in problems] == [("arc", "warning", 5)]
    assert "early" in problems[0].element


def test_an_arc_between_two_places_is_dropped_in_pnps_dialect_only():
    net, problems = parse_pnml(JARP.replace('source="p2" target="t2"', 'source="p2" target="p3"'))
    assert len(net.arcs) == 3
    assert [(p.rule, p.severity, p.line) for p in problems] == [("arc", "warning", 16)]
    with pytest.raises(PlanError):
        parse_pnml(ISO.replace('source="t" target="r"', 'source="p" target="r"'))


@pytest.mark.parametrize(
    ("old", "new", "rule", "line"),
    [
        ('<place id="p2">', "<place>", "id", 10),
        ('<place id="p3">', '<place id="p2">', "id", 11),
        ('source="p2" target="t2"', 'source="p9" target="t2"', "arc", 16),
        ('source="p2" target="t2"', 'source="p2"', "arc", 16),
        ("Default,1", "one", "number", 5),
        ("Default,1", "-1", "number", 5),
        ("Default,1", "999999999", "number", 5),
        ('id="a2" source="t1" target="p2"/>', 'id="a2" source="t1" target="p2"><type value="inhibitor"/></arc>', "arc", 15),
        ('type="PTNet"', 'type="http://www.pnml.org/version-2009/grammar/highlevelnet"', "xml", 3),
        ("</net>", "</net><net/>", "xml", 2),
        ("</pnml>", "", "xml", 20),
        ("<pnml>", '<!DOCTYPE x [<!ENTITY a "b">]><pnml>', "xml", 2),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_with_its_line(old, new, rule, line):
    assert old in JARP
    with pytest.raises(PlanError) as caught:
        parse_pnml(JARP.replace(old, new, 1), file="x.pnml")
    first = caught.value.found[0]
    assert (first.rule, first.severity, first.line) == (rule, "error", line)
    assert str(first).startswith(f"x.pnml:{line}: ")


@pytest.mark.parametrize("data", [b"", b"\x00\xff", b"<a/>", b"<pnml/>",
                                  b'<?xml version="1.0" encoding="nonsense"?><pnml/>', b"\xff\xfe<"])  # fmt: skip
def test_hostile_bytes(data):
    with pytest.raises(PlanError):
        parse_pnml(data)


@given(st.binary(max_size=200))
def test_any_bytes(data):
    with pytest.raises(PlanError):
        parse_pnml(data)


def test_no_file(tmp_path):
    with pytest.raises(PlanError, match="No such file"):
        read_pnml(tmp_path / "none.pnml")


def test_all_problems_at_once():
    text = JARP.replace('<place id="p2">', "<place>").replace("Default,1", "one")
    with pytest.raises(PlanError) as caught:
        parse_pnml(text)
    assert {p.rule for p in caught.value.found} == {"id", "number"}
    assert len(caught.value.problems) == 2


NAMES = st.text(st.characters(min_codepoint=32, max_codepoint=0x2000), min_size=1, max_size=8)


@st.composite
def nets(draw):
    count = draw(st.integers(1, 4)), draw(st.integers(0, 4))
    places = tuple(Place(f"p{n}", draw(NAMES), draw(st.integers(0, 2))) for n in range(count[0]))
    transitions = tuple(Transition(f"t{n}", draw(NAMES)) for n in range(count[1]))
    arcs = [
        Arc(*pair, weight)
        for p in places
        for t in transitions
        for pair in ((p.id, t.id), (t.id, p.id))
        if (weight := draw(st.integers(0, 2)))
    ]
    return Net("drawn", places, transitions, tuple(arcs))


@given(nets(), st.sampled_from(["pnp", "2009"]))
def test_round_trip(net, dialect):
    back, problems = parse_pnml(pnml_text(net, dialect=dialect))
    assert [p for p in problems if p.severity != "note"] == []
    assert [(p.id, p.name, p.tokens) for p in back.places] == [
        (p.id, p.name, p.tokens) for p in net.places
    ]
    assert [(t.id, t.name) for t in back.transitions] == [(t.id, t.name) for t in net.transitions]
    assert back.arcs == net.arcs
    assert back.name == net.name
    understand(back)


@pytest.mark.parametrize("name", ["a\x01b", "\ud800", "\ufffe"])
def test_a_name_that_xml_cannot_hold_is_not_written(name):
    with pytest.raises(InvalidStateError, match=r"got '.*' in it"):
        pnml_text(Net("plan", (Place("p", name),), (), ()))


def test_the_2009_form_has_its_namespace(tmp_path):
    net, _ = parse_pnml(JARP)
    root = ET.parse(write_pnml(net, tmp_path / "x.pnml", dialect="2009")).getroot()
    assert root.tag == "{http://www.pnml.org/version-2009/grammar/pnml}pnml"


def test_a_net_without_places_is_checked_and_drawn_and_does_not_run(tmp_path):
    file = tmp_path / "empty.pnml"
    file.write_text('<pnml><net id="n1" type="PTNet"></net></pnml>')
    plan = load_plan(file, to_run=False)
    assert any("got no places; expected a plan" in each.message for each in check(plan).problems)
    assert explore(plan.plan.net).came == {(): None}
    assert b"empty" in viz.picture(plan, "svg")
    with pytest.raises(PlanError, match="got no places"):
        load_plan(file)
