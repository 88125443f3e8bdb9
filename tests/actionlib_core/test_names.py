"""ROS names: rules, resolving, and remapping from a command line."""

from __future__ import annotations

import re
import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.exceptions import InvalidNameError, NameSetupError
from actionlib_core.names import (
    check_base_name,
    check_name,
    clean_namespace,
    parse_arguments,
    resolve_name,
)


@pytest.mark.parametrize(
    "name", ["a", "move_base", "/a/b2/C", "~goal", "~/goal", "_action", "a/1b"]
)
def test_valid_names_pass(name):
    assert check_name(name) == name


@pytest.mark.parametrize(
    ("name", "reason", "index"),
    [
        ("", "it is empty", 0),
        ("robot//move", "'//' is not allowed", 5),
        ("robot move", "' ' is not allowed", 5),
        ("7up", "must not start with a digit", 0),
        ("a/~b", "'~' is allowed in front only", 2),
        ("goal/", "must not end with '/'", 4),
        ("/", "must not end with '/'", 0),
        ("~", "'~' alone names nothing", 0),
        ("größe", "'ö' is not allowed", 2),
        ("a$b c", r"'\$' is not allowed", 1),
    ],
)
def test_broken_rule_is_named_with_a_caret_below_the_place(name, reason, index):
    with pytest.raises(InvalidNameError, match=reason) as caught:
        check_name(name, "action name")
    error = caught.value
    assert (error.name, error.kind, error.index) == (name, "action name", index)
    first, shown, caret = str(error).splitlines()
    assert first.startswith("invalid action name: ")
    assert shown == f"  '{name}'"
    assert caret.index("^") == len("  '") + index


def test_text_is_the_documented_one():
    with pytest.raises(InvalidNameError) as caught:
        check_name("robot//move", "action name")
    assert str(caught.value) == (
        "invalid action name: '//' is not allowed:\n  'robot//move'\n        ^"
    )


@given(st.text(max_size=12))
def test_a_name_is_accepted_or_refused_with_a_place_in_it(name):
    valid = re.fullmatch(r"[~/]?/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z0-9_]+)*", name) or re.fullmatch(
        r"(~/?|/)[A-Za-z0-9_]+(/[A-Za-z0-9_]+)*", name
    )
    if valid and "//" not in name:
        assert check_name(name) == name
        return
    with pytest.raises(InvalidNameError) as caught:
        check_name(name)
    assert 0 <= caught.value.index <= max(len(name) - 1, 0)


WORD = st.text(string.ascii_lowercase + "_", min_size=1, max_size=5)


@given(st.lists(WORD, min_size=1, max_size=3).map("/".join), WORD, WORD)
def test_resolving_gives_full_names_that_resolve_to_themselves(name, namespace, node):
    names = {"namespace": namespace, "node": f"{namespace}/{node}"}
    assert resolve_name(name, **names) == f"{namespace}/{name}"
    assert resolve_name(f"/{name}", **names) == name
    assert resolve_name(f"~{name}", **names) == f"{namespace}/{node}/{name}"
    assert resolve_name(f"~/{name}", **names) == f"{namespace}/{node}/{name}"
    for form in (name, f"/{name}", f"~{name}"):
        full = resolve_name(form, **names)
        assert resolve_name(f"/{full}", **names) == full


@pytest.mark.parametrize(
    ("given_", "clean"), [("", ""), ("/", ""), ("/a", "a"), ("a/b/", "a/b"), ("/a/b", "a/b")]
)
def test_namespaces_lose_their_outer_slashes(given_, clean):
    assert clean_namespace(given_) == clean


@pytest.mark.parametrize("namespace", ["~a", "a//b", "//", "a b"])
def test_bad_namespaces_are_refused(namespace):
    with pytest.raises(InvalidNameError):
        clean_namespace(namespace)


@pytest.mark.parametrize("name", ["a/b", "/a", "~a", "", "a b"])
def test_node_names_are_one_word(name):
    with pytest.raises(InvalidNameError, match="node name"):
        check_base_name(name)


def resolved(argv, name="nav", namespace=""):
    arguments = parse_arguments(argv)
    own = arguments.node_name(name)
    given_ = arguments.namespace(name)
    space = clean_namespace(namespace if given_ is None else given_)
    full = f"{space}/{own}" if space else own
    return full, arguments.remappings(name, namespace=space, node=full), arguments.rest


def test_ros1_arguments():
    argv = ["prog", "goal:=/arm/goal", "__ns:=/robot_1", "__name:=patrol", "__log:=/tmp/x.log",
            "_speed:=1.5", "~x:=y", "--fast", "1"]  # fmt: skip
    full, remappings, rest = resolved(argv)
    assert full == "robot_1/patrol"
    assert remappings == {"robot_1/goal": "arm/goal", "robot_1/patrol/x": "robot_1/y"}
    assert rest == ("prog", "--fast", "1")


def test_ros2_arguments():
    argv = ["-v", "--ros-args", "-r", "a:=b", "--remap", "__ns:=/robot_1", "-r", "__node:=x",
            "-p", "speed:=1.5", "--log-level", "debug", "--params-file", "p.yaml", "--", "left"]  # fmt: skip
    full, remappings, rest = resolved(argv)
    assert full == "robot_1/x"
    assert remappings == {"robot_1/a": "robot_1/b"}
    assert rest == ("-v", "left")


def test_ros2_rule_for_one_node_leaves_others_alone():
    argv = ["--ros-args", "-r", "nav:a:=b", "-r", "other:__node:=x", "-r", "other:a:=c"]
    assert resolved(argv) == ("nav", {"a": "b"}, ())
    assert resolved(argv, "other") == ("x", {"a": "c"}, ())


def test_first_rule_of_a_name_wins_and_last_setting():
    argv = ["a:=b", "a:=c", "__ns:=x", "__ns:=y"]
    assert resolved(argv) == ("y/nav", {"y/a": "y/b"}, ())


def test_yaml_that_contains_the_sign_is_no_rule():
    argv = ["send_goal", "{text: 'a:=b'}", "text: a:=b", "--opt=a:=b"]
    assert parse_arguments(argv).rest == tuple(argv)


def test_all_problems_of_a_command_line_are_told_at_once():
    with pytest.raises(NameSetupError) as caught:
        parse_arguments(["a:=b//c", "__ns:=x y", "--ros-args", "-r", "nonsense", "-r"])
    assert len(caught.value.problems) == 4
    text = str(caught.value)
    for part in ("argument 'a:=b//c'", "argument '__ns:=x y'", "got 'nonsense'", "got ''"):
        assert part in text


def test_remapping_applies_once():
    names = {"a": "b", "b": "c"}
    assert resolve_name("a", remappings=names) == "b"
    assert resolve_name("~a", node="n", remappings=names) == "n/a"
