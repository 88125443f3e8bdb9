"""`smachpy view` and the runs that have a network of their own."""

from __future__ import annotations

import os

import pytest

from actionlib_core.clock import RealClock
from actionlib_core.config import DOMAIN_VARIABLE, Config
from actionlib_core.node import Node
from actionlib_core.wire.private_network import private_network
from smachpy_viz.live.cli import private_runs

pytestmark = pytest.mark.zenoh

WAIT_S = 60.0


class Part:
    """Something that looks at networks."""

    def __init__(self):
        self.joined, self.left = set(), set()
        self._changed = RealClock().event()

    def join(self, node):
        self.joined.add(node.transport.config.domain)
        self._changed.set()

    def leave(self, node):
        self.left.add(node.transport.config.domain)
        self._changed.set()

    def wait(self, domain, domains):
        while domain not in domains:
            assert self._changed.wait(WAIT_S)
            self._changed.clear()


@pytest.fixture
def shared(monkeypatch):
    monkeypatch.delenv(DOMAIN_VARIABLE, raising=False)
    with Node("desk", config=Config()) as node:
        yield node


def test_a_viewer_joins_private_runs_and_leaves_them(shared):
    part = Part()
    with private_runs(shared, [part]):
        with private_network() as domain:
            del os.environ[DOMAIN_VARIABLE]  # as for the viewer, which is another process
            part.wait(domain, part.joined)
            assert domain not in part.left
        part.wait(domain, part.left)


def test_a_viewer_that_ends_leaves_them(shared):
    part = Part()
    with private_network() as domain:
        del os.environ[DOMAIN_VARIABLE]
        with private_runs(shared, [part]):
            part.wait(domain, part.joined)
        assert domain in part.left


def test_a_viewer_that_is_told_where_to_look_looks_only_there(shared, monkeypatch):
    part = Part()
    with private_network(), private_runs(shared, [part]):  # SMACHPY_DOMAIN is set
        pass
    assert not part.joined
