"""Machines written as files: Python -> YAML -> Python, the schema, and what cannot be written."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, TypedDict

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import smachpy
from smachpy import Concurrence, Iterator, Sequence, State, StateMachine, any_of, when
from smachpy.files import NotWrittenError, load, schema, write
from smachpy.states import Wait
from tests.smachpy.files import own_states
from tests.smachpy.files.own_states import Limited, Up
from tests.smachpy.files.test_reading import GOOD

LEAVES = st.sampled_from(["up", "down", "wait"])
TREES = st.recursive(
    LEAVES,
    lambda below: st.tuples(
        st.sampled_from(["machine", "sequence", "concurrence", "iterator"]),
        st.lists(below, min_size=1, max_size=3),
        st.booleans(),
    ),
    max_leaves=6,
)
KEYS: dict[str, Any] = {"input_keys": ["count"], "output_keys": ["count"]}


def build(tree: Any) -> State:
    if tree == "up":
        return Up()
    if tree == "down":
        return own_states.down
    if tree == "wait":
        return Up()
    kind, below, extra = tree
    children = [build(child) for child in below]
    outcomes = ["a", "b"]
    if kind == "iterator":
        iterator = Iterator(outcomes, it=[1, 2], it_label="number", exhausted_outcome="a", **KEYS)
        loop = ["a"] if extra else []
        iterator.set_contained_state("EACH", children[0], loop, ["b"] if extra else [])
        if extra:
            iterator.add_cleanup("TIDY", Up())
        return iterator
    if kind == "concurrence":
        concurrence = Concurrence(
            outcomes,
            "b",
            outcome_map={"a": any_of({"S0": "a"})} if extra else {"a": {"S0": "a"}},
            **KEYS,
        )
        concurrence.add("S0", children[0])
        return concurrence
    machine: Any = (
        StateMachine(
            outcomes,
            reenter="last" if extra else "first",
            resource=("base", "preempt") if extra else None,
            **KEYS,
        )
        if kind == "machine"
        else Sequence(outcomes, "a", **KEYS)
    )
    last = len(children) - 1
    for number, child in enumerate(children):
        target = "a" if number == last else f"S{number + 1}"
        to: Any = [when("count > 40", "b"), target] if extra else target
        remapping = {"count": "count"} if extra else {}
        machine.add(f"S{number}", child, {"a": to, "b": target}, remapping)
    if extra:
        machine.add_cleanup("TIDY", Up())
    return machine


def root_of(tree: Any) -> StateMachine:
    root = StateMachine(["a", "b"], name="ROOT", userdata={"count": 0})
    root.add("TOP", build(tree), {"a": "a", "b": "b"})
    return root


def facts(record: Any) -> Any:
    """What must be the same: all but the classes of leaves that were not imported yet."""
    return (
        record.path,
        record.kind if record.is_container else "leaf",
        set(record.outcomes),
        record.remapping,
        record.initial,
        record.transitions,
        record.rules,
        record.default_outcome,
        record.cleanup,
        [pair for pair in record.details if pair[0] in {"reenter", "resource"}],
        [facts(child) for child in record.children],
    )


@settings(max_examples=30, deadline=None)
@given(TREES)
def test_python_to_yaml_to_python_is_the_same_machine(tmp_path_factory, tree):
    path = tmp_path_factory.mktemp("files") / "machine.yaml"
    first = root_of(tree)
    text = write(first, path)
    second = load(path, allow=["tests"])
    assert facts(smachpy.describe(second)) == facts(smachpy.describe(first))
    stories = []
    for machine in (first, second):
        story: list[tuple[str, str]] = []
        machine.subscribe(
            lambda event, story=story: (
                type(event).__name__ in {"Left", "Entered"}
                and story.append((type(event).__name__, event.path, getattr(event, "outcome", "")))
            )
        )
        outcome = machine.execute()
        stories.append((outcome, machine.userdata["count"], story))
    assert stories[0] == stories[1]
    assert write(load(path, allow=["tests"])) == text


def test_comments_stay_on_rewriting(tmp_path):
    path = tmp_path / "mission.yaml"
    path.write_text(GOOD.replace("  COUNT:\n", "  COUNT:  # counts\n", 1) + "# the end\n")
    machine = load(path)
    machine["BOTH"]["B"]
    write(machine, path)
    text = path.read_text()
    assert "# counts" in text
    assert "seconds: ${seconds}" in text.replace('"', "").replace("'", "")
    assert "unit: s" in text
    load(path)


def of_waits(folder: Path, *waits: tuple[str, float], kind: str = "machine") -> StateMachine:
    """A machine, or a sequence in one, of states that wait."""
    follows = [*(label for label, _ in waits[1:]), "done"]
    states = [
        f"{label}: {{state: wait, with: {{seconds: {seconds}}}, on: {{done: {to}}}}}"
        for (label, seconds), to in zip(waits, follows, strict=True)
    ]
    text = "name: M\noutcomes: [done, preempted]\nstates:\n"
    inside = ", ".join(states)
    if kind == "sequence":
        inside = inside.replace(", on: {done: done}", "").replace(
            f", on: {{done: {follows[0]}}}", ""
        )
        inside = f"S: {{sequence: {{connector: done, outcomes: [done, preempted], states: {{{inside}}}}}, on: {{done: done}}}}"
    path = folder / "source.yaml"
    path.write_text(f"{text}  {{{inside}}}\n")
    return load(path)


@pytest.mark.parametrize("kind", ["machine", "sequence"])
def test_the_order_of_states_is_that_of_the_machine_over_an_older_file_too(tmp_path, kind):
    """The old order stayed: another state was first, or the sequence was another one."""
    path = tmp_path / "m.yaml"
    write(of_waits(tmp_path, ("UNDOCK", 1.0), ("DRIVE", 2.0), kind=kind), path)
    path.write_text(path.read_text().replace("UNDOCK:", "UNDOCK:  # leave", 1))
    machine = of_waits(tmp_path, ("DRIVE", 2.0), ("UNDOCK", 1.0), kind=kind)
    write(machine, path)
    again = load(path)
    assert facts(smachpy.describe(again)) == facts(smachpy.describe(machine))
    inside: Any = again if kind == "machine" else again["S"]
    assert [*inside.get_children()] == ["DRIVE", "UNDOCK"]
    assert "# leave" in path.read_text()


PARAMETER = """name: M
outcomes: [done, preempted]
parameters: {pause: {type: number, default: 5.0}}
states:
  A: {state: wait, with: {seconds: "${pause}"}, on: {done: done}}
"""


@pytest.mark.parametrize(("seconds", "stays"), [(5.0, True), (99.0, False)])
def test_a_parameter_of_the_older_file_stays_if_its_default_is_the_value(tmp_path, seconds, stays):
    """It stayed whatever the machine had: the written file waited for another time."""
    path = tmp_path / "m.yaml"
    path.write_text(PARAMETER)
    write(of_waits(tmp_path, ("A", seconds)), path)
    assert ("pause" in path.read_text()) is stays
    (state,) = smachpy.describe(load(path)).children
    assert dict(state.details)["waits"] == f"{seconds:g} s"


def test_an_older_file_that_cannot_have_the_values_is_replaced(tmp_path):
    """An anchor gave two states the value of the second one."""
    path = tmp_path / "m.yaml"
    path.write_text(
        "name: M\noutcomes: [done, preempted]\nstates:\n"
        "  A: {state: wait, with: &pause {seconds: 1.0}, on: {done: B}}\n"
        "  B: {state: wait, with: *pause, on: {done: done}}\n"
    )
    write(of_waits(tmp_path, ("A", 3.0), ("B", 4.0)), path)
    written = smachpy.describe(load(path))
    assert [dict(child.details)["waits"] for child in written.children] == ["3 s", "4 s"]


OLD = """\
# about the file

name: M
outcomes: [done, preempted]
states:
  # about A
  # and more
  A: {state: wait, with: {seconds: 1}, on: {done: B}}   # behind A
  # about B
  B:
    # in B
    state: wait
    with: {seconds: 2}
    on: {done: C}

  # about C
  C: {state: wait, with: {seconds: 3}, on: {done: done}}
# about the clean-up
cleanup:
  D: {state: wait}
"""
NEW = """\
# about the file

name: M
outcomes: [done, preempted]
states:

  # about C
  C: {state: wait, with: {seconds: 3}, on: {done: X}}
  X:
    state: wait
    with:
      seconds: 4
    on:
      done: B
  # about B
  B:
    # in B
    state: wait
    with: {seconds: 2}
    on: {done: done}
# about the clean-up
cleanup:
  D: {state: wait}
"""


@pytest.mark.parametrize(("first", "second"), [(OLD, NEW), (NEW, NEW), (OLD, OLD)])
def test_comments_stay_with_the_labels_that_they_are_about(tmp_path, first, second):
    """After another order they stood above others, and with a label its successor's went."""
    wanted, path = tmp_path / "wanted.yaml", tmp_path / "m.yaml"
    wanted.write_text(second)
    path.write_text(first)
    write(load(wanted), path)
    assert path.read_text() == second


def test_options_that_were_set_after_loading_are_written(tmp_path):
    """The file had those of before."""
    path = tmp_path / "m.yaml"
    path.write_text(
        "name: M\noutcomes: [done, preempted]\nparameters: {n: {type: whole, default: 3}}\nstates:\n"
        '  A: {state: wait, with: {seconds: 1}, retry: {attempts: "${n}", on: [done]}, on: {done: B}}\n'
        "  B: {state: wait, with: {seconds: 1}, idempotent: true, on: {done: done}}\n"
    )
    machine = load(path)
    smachpy.set_options(machine["A"], timeout=7.0, timeout_outcome="preempted")
    smachpy.set_options(machine["B"], idempotent=False)
    text = write(machine)
    assert "${n}" in text
    path.write_text(text)
    again = load(path)
    for label in ("A", "B"):
        assert smachpy.get_options(again[label]) == smachpy.get_options(machine[label])
    smachpy.set_options(machine["A"], on_exit=print)
    with pytest.raises(NotWrittenError, match="on_exit: got code"):
        write(machine)


def with_state(state: State, **options: Any) -> StateMachine:
    sm = StateMachine(["a", "b"], name="M", **options)
    sm.add("A", state)
    return sm


@pytest.mark.parametrize("where", ["machine", "state"])
def test_which_outcomes_are_good_is_written(tmp_path, where):
    """It was left out, and a mission that had failed counted as done."""
    sm, path = with_state(Up()), tmp_path / "m.yaml"
    smachpy.set_options(sm if where == "machine" else sm["A"], success=["b"])
    write(sm, path)
    again = smachpy.files.resolve(load(path, allow=["tests"]))
    for one, other in ((sm, again), (sm["A"], again["A"])):
        assert smachpy.get_options(other).success == smachpy.get_options(one).success


def test_options_of_a_class_are_written_where_the_program_has_set_others(tmp_path):
    path = tmp_path / "m.yaml"
    for timeout in (5.0, 7.0):
        sm = with_state(Limited())
        smachpy.set_options(sm["A"], timeout=timeout)
        assert ("timeout: 7.0" in write(sm, path)) is (timeout == 7.0)
        again = smachpy.files.resolve(load(path, allow=["tests"]))
        assert smachpy.get_options(again["A"]) == smachpy.get_options(sm["A"])


@pytest.mark.parametrize("labels", [["any"], ["need", "of"]])
def test_a_rule_about_states_with_the_words_of_rules_is_written(tmp_path, labels):
    """The file meant another rule, and could not be loaded."""
    rule = dict.fromkeys(labels, "a")
    concurrence = Concurrence(["a", "b"], "b", outcome_map={"a": rule})
    for label in labels:
        concurrence.add(label, Up())
    path = tmp_path / "m.yaml"
    write(with_state(concurrence), path)
    ((_, rule),) = load(path, allow=["tests"])["A"]._smachpy.rules
    assert rule == concurrence._smachpy.rules[0][1]


def test_options_that_are_set_for_a_function_itself_are_written():
    sm, before = with_state(own_states.down), smachpy.get_options(own_states.down)
    assert sm["A"] is own_states.down
    try:
        smachpy.set_options(sm["A"], timeout=7.0, timeout_outcome="b")
        assert "timeout: 7.0" in write(sm)
    finally:
        smachpy.set_options(own_states.down, timeout=None, timeout_outcome=before.timeout_outcome)


class Fields(TypedDict):
    count: int


def limited_no_more() -> State:
    state = Limited()
    smachpy.set_options(state, timeout=None)
    return state


def with_another_key() -> State:
    state = Up()
    state.register_input_keys(["more"])
    return state


def for_ever() -> Iterator:
    iterator = Iterator(["a", "b"], it=range(10**20), exhausted_outcome="a", **KEYS)
    iterator.set_contained_state("S", Up())
    return iterator


def without_default() -> Concurrence:
    concurrence = Concurrence(["a", "b"], "", outcome_map={"a": {"S": "a"}})
    concurrence.add("S", Up())
    return concurrence


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda: with_state(limited_no_more()), "/M/A: timeout: got none; expected that of tests"),
        (lambda: with_state(with_another_key()), "/M/A: got a Up made by code"),
        (lambda: with_state(without_default()), "/M/A: default_outcome: got none; expected one"),
        (
            lambda: with_state(for_ever()),
            "/M/A: items: got range(0, 100000000000000000000); expected at",
        ),
        (lambda: with_state(Up(), userdata_type=Fields), "/M: userdata_type: got types"),
        (
            lambda: with_state(Up(), userdata={"t": ["${x}"]}),
            "/M: userdata t: got '${x}'; expected",
        ),
    ],
)
def test_what_a_file_would_lose_is_told(make, problem):
    """It was left out, or the file could not be loaded."""
    with pytest.raises(NotWrittenError, match=re.escape(problem)):
        write(make())


def test_what_cannot_be_written_is_told_all_at_once(tmp_path):
    sm = StateMachine(["done", "preempted"], name="M", userdata={"where": Path("x")})
    sm.add("A", Wait(3.0))
    sm.add(
        "B",
        smachpy.CBState(lambda userdata: "done", outcomes=["done"]),
        {"done": [when(bool, "A"), "A"]},
    )
    sm.register_start_cb(lambda *_: None)
    path = tmp_path / "m.yaml"
    with pytest.raises(NotWrittenError) as caught:
        write(sm, path)
    assert len(caught.value.problems) == 5
    assert all(problem.startswith("/M") for problem in caught.value.problems)
    assert not path.exists()


def test_the_shipped_schema_is_the_one_of_the_code():
    shipped = Path(smachpy.__file__).parent / "files" / "mission.schema.json"
    assert json.loads(shipped.read_text()) == schema()


def test_the_schema_takes_a_good_file_and_refuses_a_bad_one():
    validator = pytest.importorskip("jsonschema").Draft202012Validator(schema())
    from actionlib_core.inputs.yaml_text import load_yaml

    assert list(validator.iter_errors(load_yaml(GOOD))) == []
    assert list(validator.iter_errors(load_yaml(GOOD.replace("outcomes", "outcome", 1))))
    assert list(
        validator.iter_errors({"outcomes": ["a"], "states": {"A": {"state": "x", "plan": "y"}}})
    )


def test_transitions_with_confirm_are_written_and_read_again():
    machine = StateMachine(["done", "failed", "preempted"], name="M")
    with machine:
        machine.add("A", Up(), {"a": smachpy.states.confirm("B"), "b": "done"})
        ask = smachpy.states.confirm("done", 3, otherwise="failed", question="Done?")
        machine.add("B", Up(), {"a": ask, "b": "A"})
    text = write(machine)
    assert "CONFIRM" not in text
    assert "confirm: 3\n        otherwise: failed\n        question: Done?" in text
    ask = smachpy.states.confirm("done", patience=5.0)
    other = StateMachine(["done", "preempted"], name="M")
    other.add("A", Up(), {"a": ask, "b": "done"})
    with pytest.raises(NotWrittenError, match="/M/A: got a `confirm` with `patience`"):
        write(other)
