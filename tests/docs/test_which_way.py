"""The page that chooses between several ways, and the classes that it chooses from."""

from __future__ import annotations

from pathlib import Path

import pytest

import actionlib_core
import smachpy

PAGE = "docs/howto/which_way.md"
WAYS = {
    "SimpleActionState": smachpy.SimpleActionState,
    "ActionClient": actionlib_core.ActionClient,
    "SimpleActionClient": actionlib_core.SimpleActionClient,
    "@server": actionlib_core.server,
    "SimpleActionServer": actionlib_core.SimpleActionServer,
    "ActionServer": actionlib_core.ActionServer,
    "ActionServerWrapper": smachpy.ActionServerWrapper,
    "State": smachpy.State,
    "CBState": smachpy.CBState,
    "@smachpy.state": type(smachpy.state).__call__,
}


@pytest.mark.parametrize("name", WAYS)
def test_each_way_says_when_it_is_the_one_and_the_page_names_it(name):
    doc = WAYS[name].__doc__ or ""
    assert PAGE in doc.split("Args:")[0]
    assert f"`{name}" in (Path(__file__).parents[2] / PAGE).read_text(encoding="utf-8")
