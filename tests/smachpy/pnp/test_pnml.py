"""PNML files: both dialects, and everything that can be wrong with one."""

from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

from smachpy import viz
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


NODES = """<?xml version="1.0"?>
<pnml xmlns="http://www.pnml.org/version-2009/grammar/pnml"><net id="n" type="{kind}"><page id="pg">
<place id="p1"><name><text>start</text></name><initialMarking><text>1</text></initialMarking></place>
<place id="p2"{attributes}><name><text>goal</text></name>{place}</place>
<transition id="t1"{transition}</transition><transition id="t2"/>
<arc id="a1" source="p1" target="t1"/><arc id="a2" source="t1" target="p2"/>
{arc}
</page></net></pnml>
"""
PARTS = {
    "kind": "http://www.pnml.org/version-2009/grammar/ptnet",
    "attributes": "",
    "place": "",
    "transition": ">",
    "arc": "",
}
ARC = '<arc id="i" source="p2" target="t1"'


def of_another_tool(**parts):
    return parse_pnml(NODES.format(**PARTS | parts), file="x.pnml")


@pytest.mark.parametrize(
    ("part", "text"),
    [
        ("arc", f'{ARC}><type value="inhibitor"/></arc>'),
        ("arc", f"{ARC}><arctype><text>reset</text></arctype></arc>"),
        ("arc", f'{ARC} type="inhibitor"/>'),
        ("arc", f'{ARC} type="tapnInhibitor" inscription="[0,inf)" weight="1"/>'),
        ("arc", f'{ARC} type="transport" inscription="[0,inf):1"/>'),
        ("arc", f'{ARC} type="timed" inscription="[2,5]"/>'),
        ("arc", f'{ARC} kind="read"/>'),
        ("arc", '<inhibitorArc id="i" source="p2" target="t1"/>'),
        ("arc", '<resetArc id="i" source="p2" target="t1"/>'),
        ("arc", f'{ARC}><toolspecific tool="x"><inhibitor/></toolspecific></arc>'),
        ("arc", f'{ARC}><toolspecific tool="x"><arc type="test"/></toolspecific></arc>'),
        ("arc", f'{ARC}><toolspecific tool="x"><type>inhibitorArc</type></toolspecific></arc>'),
        ("arc", f'{ARC} weight="many"/>'),
        ("arc", f"{ARC}><inscription><text>x+1</text></inscription></arc>"),
        ("place", "<capacity><text>1</text></capacity>"),
        ("place", "<capacity><value>Default,3</value></capacity>"),
        ("attributes", ' capacity="2"'),
        ("attributes", ' invariant="&lt;= 5"'),
        ("place", "<initialMarking><text>red,1,blue,1</text></initialMarking>"),
        ("kind", "http://www.pnml.org/version-2009/grammar/symmetricnet"),
        ("kind", "http://www.pnml.org/version-2009/grammar/pt-hlpng"),
    ],
)
def test_what_a_plan_cannot_mean_is_refused_however_a_tool_writes_it(part, text):
    with pytest.raises(PlanError, match=r"x\.pnml:\d: .*expected"):
        of_another_tool(**{part: text})


@pytest.mark.parametrize(
    ("part", "text", "said"),
    [
        ("transition", "><timed><value>true</value></timed>", "timed"),
        ("transition", "><priority><value>2</value></priority>", "priority"),
        ("transition", "><guard><text>x &gt; 1</text></guard>", "<guard>"),
        ("place", "<type><text>INT</text></type>", "<type>"),
        ("arc", f"{ARC}><name><text>3</text></name></arc>", "no weight"),
        ("arc", "<colours/>", "<colours>"),
    ],
)
def test_what_is_not_read_is_told(part, text, said):
    _, problems = of_another_tool(**{part: text})
    assert [problem.severity for problem in problems] == ["warning"]
    assert said in problems[0].message


@pytest.mark.parametrize(
    ("text", "weight"),
    [
        (f'{ARC} weight="3"/>', 3),
        (f'{ARC} multiplicity="2"/>', 2),
        (f'{ARC} inscription="4"/>', 4),
        (f'{ARC} type="timed" inscription="[0,inf)" weight="2"/>', 2),
        (f"{ARC}><inscription><value>Default,2</value></inscription></arc>", 2),
        (
            f'{ARC}><type value="normal"/><arcpath id="0"/><tagged><value>false</value></tagged></arc>',
            1,
        ),
    ],
)
def test_a_weight_is_read_wherever_a_tool_writes_it(text, weight):
    net, problems = of_another_tool(arc=text)
    assert net.arcs[-1].weight == weight
    assert problems == ()


@pytest.mark.parametrize(
    "kind",
    [
        "",
        "P/T net",
        "PTNet",
        PARTS["kind"].replace("ptnet", "pnmlcoremodel"),
        "http://www.yasper.org/specs/epnml-1.1/ptNet",
    ],
)
def test_plain_nets_of_other_tools_load(kind):
    attributes = ' initialMarking="0" name="other" capacity="0" invariant="&lt; inf"'
    net, problems = of_another_tool(kind=kind, attributes=attributes)
    assert [(place.name, place.tokens) for place in net.places] == [("start", 1), ("goal", 0)]
    assert problems == ()


def test_one_kind_of_element_that_is_not_read_is_told_once():
    arcs = "".join(f'<arc id="i{n}" source="p2" target="t2"><odd/></arc>' for n in range(5))
    _, problems = of_another_tool(arc=arcs)
    assert len(problems) == 1


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
