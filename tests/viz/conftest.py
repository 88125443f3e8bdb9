"""Machines to draw, as records."""

from __future__ import annotations

import random
from dataclasses import replace
from itertools import pairwise
from unittest.mock import patch

import pytest

from smachpy.events.introspection import RuleRecord, StateRecord, TransitionRecord
from smachpy_viz.pictures import graphviz_process

STANDARD = ("succeeded", "aborted", "preempted")


@pytest.fixture(scope="session", autouse=True)
def patient_drawing():
    """A busy computer is no failure; a test of the limit sets its own."""
    with patch.object(graphviz_process, "TIME_LIMIT", 120.0):
        yield


def leaf(label, kind="action", outcomes=STANDARD, **more):
    return StateRecord("", label, kind, f"{kind.title()}State", tuple(outcomes), **more)


def machine(label, children, transitions, outcomes=STANDARD, kind="machine"):
    """`transitions` maps a child's label to {outcome: target}; the rest falls through."""
    labels = {child.label for child in children}
    edges = []
    for child in children:
        written = transitions.get(child.label, {})
        for outcome in child.outcomes:
            target = written.get(outcome, outcome)
            edges.append(
                TransitionRecord(
                    child.label, outcome, target, target not in labels, outcome not in written
                )
            )
    return StateRecord(
        "", label, kind, "StateMachine", tuple(outcomes),
        children=tuple(children), initial=(children[0].label,), transitions=tuple(edges),
    )  # fmt: skip


def concurrence(label, children, rules, outcomes=STANDARD, default="aborted"):
    """`rules` are triples (outcome, pairs, words)."""
    return StateRecord(
        "", label, "concurrence", "Concurrence", tuple(outcomes),
        children=tuple(children), initial=tuple(child.label for child in children),
        rules=tuple(RuleRecord(outcome, tuple(pairs), words) for outcome, pairs, words in rules),
        default_outcome=default,
    )  # fmt: skip


def rooted(record, above=""):
    path = f"{above}/{record.label}"
    return replace(
        record, path=path, children=tuple(rooted(child, path) for child in record.children)
    )


def make_patrol():
    recover = machine(
        "RECOVER",
        [leaf("CLEAR_MAP", "service", ("succeeded", "aborted")), leaf("TURN"), leaf("BACK_UP")],
        {
            "CLEAR_MAP": {"succeeded": "TURN"},
            "TURN": {"succeeded": "succeeded", "aborted": "BACK_UP"},
        },
    )
    drive = machine(
        "DRIVE",
        [
            leaf("NEXT_WAYPOINT", "callback", ("drive", "round_done")),
            leaf(
                "GO_THERE",
                details=(("action", "move_base"), ("type", "move_base_msgs/MoveBaseAction")),
            ),
            recover,
        ],
        {
            "NEXT_WAYPOINT": {"drive": "GO_THERE", "round_done": "succeeded"},
            "GO_THERE": {"succeeded": "NEXT_WAYPOINT", "aborted": "RECOVER"},
            "RECOVER": {"succeeded": "GO_THERE"},
        },
    )
    watched = concurrence(
        "WATCHED_DRIVE",
        [drive, leaf("BATTERY", "monitor", ("valid", "invalid", "preempted"))],
        [
            ("battery_low", [("BATTERY", "invalid")], "BATTERY:invalid"),
            ("succeeded", [("DRIVE", "succeeded")], "DRIVE:succeeded"),
            ("aborted", [("DRIVE", "aborted")], "DRIVE:aborted"),
        ],
        ("succeeded", "battery_low", "aborted", "preempted"),
    )
    charge = machine(
        "CHARGE",
        [leaf("DOCK"), leaf("WAIT_FULL", "monitor", ("valid", "invalid", "preempted"))],
        {"DOCK": {"succeeded": "WAIT_FULL"},
         "WAIT_FULL": {"valid": "succeeded", "invalid": "succeeded"}},
    )  # fmt: skip
    return rooted(
        machine(
            "PATROL",
            [watched, charge],
            {
                "WATCHED_DRIVE": {"battery_low": "CHARGE"},
                "CHARGE": {"succeeded": "WATCHED_DRIVE"},
            },
        )
    )


def make_large(states, seed=1):
    """A machine of exactly `states` states with random containers inside."""
    rng = random.Random(seed)
    words = ["TURN", "LIFT", "GRASP", "SCAN", "MOVE", "DOCK", "ALIGN", "READ", "PLACE", "CHECK"]

    def name(i):
        return f"{rng.choice(words)}_{i}"

    def sizes(budget):
        """Numbers of states below 4 to 8 children; they sum up with the children to `budget`."""
        if budget <= 7:
            return [0] * budget
        inside = rng.randint(1, min(4, budget // 6))
        plain = rng.randint(2, 4)
        shares = [(budget - plain - inside) // inside] * inside
        shares[0] += budget - plain - inside - sum(shares)
        return rng.sample([0] * plain + shares, plain + inside)

    def container(label, budget):
        children = []
        for i, size in enumerate(sizes(budget)):
            if size:
                children.append(container(name(i), size))
            else:
                kind = rng.choice(["action", "action", "service", "callback", "condition"])
                children.append(leaf(name(i), kind))
        if rng.random() < 0.25:
            pair = [(child.label, "succeeded") for child in children[:2]]
            rules = [
                ("succeeded", pair, "all of them"),
                ("aborted", [(children[-1].label, "aborted")], "the last one"),
            ]
            return concurrence(label, children, rules)
        transitions = {}
        for here, after in pairwise(children):
            transitions[here.label] = {"succeeded": after.label}
            if rng.random() < 0.3:
                transitions[here.label]["aborted"] = rng.choice(children).label
        return machine(label, children, transitions)

    record = rooted(container("FACTORY", states - 1))
    assert sum(1 for _ in record.walk()) == states
    return record


@pytest.fixture(scope="session")
def patrol():
    return make_patrol()


@pytest.fixture(scope="session")
def large():
    """`large(states)` makes a machine of that many states."""
    return make_large


@pytest.fixture(scope="session")
def build():
    """The functions above, for tests that build their own machines."""

    class Build:
        pass

    for function in (leaf, machine, concurrence, rooted):
        setattr(Build, function.__name__, staticmethod(function))
    return Build


@pytest.fixture(params=["found", "bundled"])
def any_dot(request, monkeypatch, tmp_path):
    """The `dot` that is found here, and then the library of pygraphviz alone."""
    if request.param == "bundled":
        pytest.importorskip("pygraphviz", exc_type=ImportError)  # without its libraries, too
        monkeypatch.delenv(graphviz_process.DOT_VARIABLE, raising=False)
        monkeypatch.setenv("PATH", str(tmp_path))
        assert "bundled_dot.py" in graphviz_process.find_dot()[-1]
    else:
        graphviz_process.find_dot()
