"""What the labels and conditions of PNP mean, and what is told of those that PNP passes over."""

import pytest

from smachpy.pnp.conditions import ConditionError, parse
from smachpy.pnp.labels import place_label, transition_label


@pytest.mark.parametrize(
    ("text", "true", "expected"),
    [
        ("c", {"c"}, True),
        ("not c", {"c"}, False),
        ("(not c)", set(), True),
        ("and a b", {"a"}, False),
        ("and a (not b) c", {"a", "c"}, True),
        ("OR a (AND b c)", {"b", "c"}, True),
        ("And", {"And"}, True),
        ("goto_kitchen.finished", {"goto_kitchen.finished"}, True),
        ("r#at_@place", {"r#at_@place"}, True),
    ],
)
def test_conditions(text, true, expected):
    condition = parse(text)
    assert condition.holds(true.__contains__) is expected
    assert parse(str(condition)) == condition


@pytest.mark.parametrize(
    ("text", "at"),
    [("a and b", 2), ("not not a", 4), ("and a", 5), ("!a", 0), ("T=1", 1), ("(a", 2), ("", 0),
     ("a.b", 0), ("(" * 60 + "a" + ")" * 60, 51), ("a b", 2), ("or", 2), (")", 0)],
)  # fmt: skip
def test_wrong_conditions(text, at):
    with pytest.raises(ConditionError) as caught:
        parse(text)
    assert caught.value.text == text
    assert caught.value.at == at
    assert "expected" in str(caught.value)


def test_all_atoms_are_asked_though_the_answer_is_known():
    asked = []
    parse("and a b").holds(lambda name: asked.append(name) or False)
    assert asked == ["a", "b"]


@pytest.mark.parametrize(
    ("label", "action", "goal", "fail", "rules"),
    [
        ("goto_kitchen.exec", "goto_kitchen", None, None, []),
        ("ex.say_hello", "say_hello", None, None, []),
        ("goto_1.5_2.ex", "goto_1.5_2", None, None, []),
        ("A.exec goal", "A", 1, None, []),
        ("goal(2)", "", 2, None, []),
        ("fail(0)", "", None, 0, []),
        ("Goal", "", None, None, ["comment"]),
        ("goalkeeper", "", None, None, ["comment"]),
        ("fail_x.exec", "fail_x", None, None, []),
        ("A.exec1", "", None, None, ["comment"]),
        ("A.sexec", "", None, None, ["comment"]),
        ("A.start", "", None, None, ["comment"]),
        ("A.exec B.exec", "A", None, None, ["label"]),
        ("init", "", None, None, []),
        (" ", "", None, None, []),
    ],
)
def test_places(label, action, goal, fail, rules):
    found = place_label(label)
    assert (found.action, found.goal, found.fail) == (action, goal, fail)
    assert [fault.rule for fault in found.faults] == rules


@pytest.mark.parametrize(
    ("label", "calls", "condition", "rules"),
    [
        ("A.start B.start", (("A", "start"), ("B", "start")), None, []),
        ("[c] A.end", (("A", "end"),), "c", []),
        ("A.end [and a (not b)]", (("A", "end"),), "and a (not b)", []),
        ("A.interr", (("A", "interrupt"),), None, []),
        ("end", (("", "end"),), None, []),
        ("Fork", (), None, []),
        ("A.end []", (("A", "end"),), None, []),
        ("A.end[c]", (), None, ["lost-guard"]),
        ("A.stop [c]", (), None, ["lost-guard"]),
        ("A.stop", (), None, ["label"]),
        ("A.end [a and b]", (("A", "end"),), None, ["condition"]),
        ("A.end [c", (("A", "end"),), None, ["condition"]),
        ("[a] [b]", (), "a", ["label"]),
        ("[ (and a b) ]", (), "and a b", ["condition"]),
        ("[@place_known]", (), "@place_known", ["condition"]),
    ],
)
def test_transitions(label, calls, condition, rules):
    found = transition_label(label)
    assert found.calls == calls
    assert (None if found.condition is None else str(found.condition)) == condition
    assert [fault.rule for fault in found.faults] == rules
