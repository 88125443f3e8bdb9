"""What is said of a robot by its tokens."""

from __future__ import annotations

import pytest

from actionlib_core.interfaces import ros2
from actionlib_core.wire.ros2.diagnosis import (
    Level,
    diagnose_actions,
    diagnose_answers,
    diagnose_clock,
    diagnose_nodes,
    diagnose_qos,
    diagnose_types,
    explain_absence,
)
from actionlib_core.wire.ros2.names import (
    DEFAULT,
    HASH_NOT_SUPPORTED,
    LATCHED,
    Kind,
    Qos,
    Token,
    action_names,
)


def end(kind, name, type_name, type_hash="", *, node="nav", session="a1", qos=DEFAULT, domain=0):
    return Token(domain, session, 0, 1, kind, "", "", node, name, type_name, type_hash, qos)


def action(name="go", distro="jazzy", **more):
    """The tokens of a server of NavigateToPose."""
    parts = ("SendGoal", "CancelGoal", "GetResult", "FeedbackMessage", "GoalStatusArray")
    types = [f"nav2_msgs/action/NavigateToPose_{part}" for part in parts]
    types[1], types[4] = "action_msgs/srv/CancelGoal", "action_msgs/msg/GoalStatusArray"
    kinds = (Kind.SERVICE,) * 3 + (Kind.PUBLISHER,) * 2
    return [
        end(kind, full, type_name, ros2.hash_of(type_name, distro), **more)
        for kind, full, type_name in zip(kinds, action_names(name), types, strict=True)
    ]


def levels(findings):
    return [finding.level for finding in findings]


def test_nodes_of_another_domain_are_named():
    assert diagnose_nodes(action(), 0).level is Level.OK
    found = diagnose_nodes(action(domain=7), 0)
    assert (found.level, found.way_out) == (Level.PROBLEM, "Try --domain 7.")
    assert "rmw_zenoh" in diagnose_nodes([], 0).way_out


def test_the_distribution_that_fits_is_named():
    assert levels(diagnose_types(action(), "jazzy")) == [Level.OK]
    assert levels(diagnose_types(action(), "kilted")) == [Level.OK]
    (found,) = diagnose_types(action(distro="rolling"), "jazzy")
    assert found.level is Level.PROBLEM
    assert "lyrical" in found.way_out or "rolling" in found.way_out
    (found,) = diagnose_types(action(distro="humble"), "jazzy")
    assert found.way_out == "Try --distro humble."
    assert levels(diagnose_types(action(distro="humble"), "humble")) == [Level.NOTE]
    assert diagnose_types([], "jazzy") == []


def test_own_types_that_differ_or_are_unknown_here():
    tokens = [
        *action(),
        end(Kind.PUBLISHER, "odom", "nav_msgs/msg/Odometry", "RIHS01_" + "1" * 64),
        end(Kind.PUBLISHER, "own", "own_msgs/msg/Own", "RIHS01_" + "2" * 64),
    ]
    wrong, unknown = diagnose_types(tokens, "jazzy")
    assert (wrong.level, unknown.level) == (Level.PROBLEM, Level.NOTE)
    assert "nav_msgs/msg/Odometry" in wrong.text
    assert "SMACHPY_INTERFACE_PATH" in wrong.way_out
    assert "own_msgs/msg/Own" in unknown.text


@pytest.mark.parametrize("name", [
    "plain", "a/b", "std_msgs/msg/", "/msg/String", "a::b/msg/C", "../srv/..%..%etc",
    f"{'a' * 5000}/msg/String", f"std_msgs/msg/{'A' * 5000}", "std_msgs/foo/String", "std_srvs/srv/Nope", "a/action/B_FeedbackMessage", "Std/msg/Event",
])  # fmt: skip
def test_any_text_may_stand_for_a_type(name):
    tokens = [*action(), end(Kind.SERVICE, "odd", name, "RIHS01_" + "3" * 64)]
    ok, unknown = diagnose_types(tokens, "jazzy")
    assert (ok.level, unknown.level) == (Level.OK, Level.NOTE)
    assert name in unknown.text


def test_no_similar_names_are_looked_for_which_takes_long_with_many_types(monkeypatch):
    monkeypatch.setattr("actionlib_core.interfaces._ros2.did_you_mean", pytest.fail)
    names = ("own_msgs/msg/Own", "nav2_msgs/srv/Own", "nav2_msgs/action/Own_SendGoal")
    tokens = [end(Kind.SERVICE, "own", name, "RIHS01_" + "2" * 64) for name in names]
    _, unknown = diagnose_types([*action(), *tokens], "jazzy")
    assert unknown.text.startswith("3 are not defined here")


def test_servers_that_are_not_whole_or_two():
    assert levels(diagnose_actions(action())) == [Level.OK]
    assert levels(diagnose_actions(action()[:4])) == [Level.PROBLEM]
    (found,) = diagnose_actions([*action(), *action(session="b2", node="nav2")])
    assert "2 servers" in found.text
    assert levels(diagnose_actions([])) == [Level.NOTE]


def test_latched_and_lossy_topics_are_named():
    found = diagnose_qos(
        [
            end(Kind.PUBLISHER, "map", "nav_msgs/msg/OccupancyGrid", qos=LATCHED),
            end(
                Kind.PUBLISHER,
                "scan",
                "sensor_msgs/msg/LaserScan",
                qos=Qos(reliable=False, depth=5),
            ),
            end(Kind.SUBSCRIPTION, "odom", "nav_msgs/msg/Odometry", qos=None),
            *action(),
        ]
    )
    assert ["/map" in found[0].text, "/scan" in found[1].text] == [True, True]
    assert len(found) == 2


@pytest.mark.parametrize(
    ("offset", "level"),
    [(0.01, Level.OK), (-0.05, Level.OK), (3.0, Level.PROBLEM), (-0.5, Level.PROBLEM)],
)
def test_clocks_that_differ(offset, level):
    clocks = {"nav": (0.0, 0.001), "amcl": (offset, 0.02)}
    found = diagnose_clock(clocks)
    assert found.level is level
    assert ("/amcl" in found.text) == (level is Level.PROBLEM)


def test_nodes_that_do_not_answer():
    silent = diagnose_answers({"nav": None, "amcl": 0.01})
    assert silent.level is Level.PROBLEM
    assert "/nav" in silent.text
    assert "/amcl" not in silent.text
    assert diagnose_answers({"nav": 0.0, "amcl": 0.01}).level is Level.OK
    slow = diagnose_answers({"nav": 2.0, "amcl": 0.01})
    assert slow.level is Level.NOTE
    assert "/nav, answers in 2000 ms" in slow.text


def test_humble_is_told_by_its_hashes():
    assert {token.type_hash for token in action(distro="humble")} == {HASH_NOT_SUPPORTED}


def test_absence_is_explained_by_what_is_there():
    there = [
        end(Kind.PUBLISHER, name, "a/msg/B", domain=3)
        for name in ("odom", "spin/_action/status", "dock/_action/status")
    ]
    router = "tcp/robot.local:7447"
    said = explain_absence("spinn", there, 3, router)
    assert said.startswith(f"looked at router {router} in domain 3: ")
    assert "/dock, /spin" in said
    assert "'/spin'?" in said
    assert "--domain 3" in explain_absence("spin", there, 0, router)
    assert "only a part" in explain_absence("spin", there, 3, router)
    assert "no action" in explain_absence("spin", there[:1], 3, "")
    assert "RMW_IMPLEMENTATION" in explain_absence("spin", [], 0, router)
