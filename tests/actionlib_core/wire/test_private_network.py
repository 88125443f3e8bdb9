"""Domains that programs take for themselves."""

from __future__ import annotations

import os

import pytest

from actionlib_core.clock import RealClock
from actionlib_core.config import DOMAIN_VARIABLE, ENVIRONMENT_VARIABLE, LAST_DOMAIN, Config
from actionlib_core.transport.zenoh import ZenohTransport
from actionlib_core.wire.private_network import (
    FIRST_PRIVATE_DOMAIN,
    list_private_networks,
    network_is_chosen,
    private_network,
    watch_private_networks,
)

pytestmark = pytest.mark.zenoh

WAIT_S = 60.0


@pytest.fixture(autouse=True)
def _unset(monkeypatch):
    monkeypatch.delenv(DOMAIN_VARIABLE, raising=False)
    monkeypatch.delenv(ENVIRONMENT_VARIABLE, raising=False)


def test_each_has_a_domain_of_its_own_while_it_lasts():
    assert not network_is_chosen()
    with private_network() as one:
        assert os.environ[DOMAIN_VARIABLE] == str(one)
        assert network_is_chosen()
        with private_network() as other:
            assert other != one
        assert os.environ[DOMAIN_VARIABLE] == str(one)
    assert DOMAIN_VARIABLE not in os.environ
    assert FIRST_PRIVATE_DOMAIN <= one <= LAST_DOMAIN


def test_a_domain_in_which_somebody_is_is_not_taken():
    with private_network() as free:
        pass
    there = ZenohTransport(Config(domain=free))
    try:
        with private_network() as taken:
            assert taken != free
    finally:
        there.close()


def test_tools_of_the_default_domain_see_them_come_and_go():
    clock = RealClock()
    news = {True: clock.event(), False: clock.event()}
    shared = ZenohTransport(Config())
    mine: list[int] = []

    def on_change(domain: int, alive: bool) -> None:
        if domain in mine:
            news[alive].set()

    try:
        with private_network() as domain:
            mine.append(domain)
            watch = watch_private_networks(shared, on_change)  # also those that were there before
            assert news[True].wait(WAIT_S)
            assert domain in list_private_networks(shared)
            assert not news[False].is_set()
        assert news[False].wait(WAIT_S)
        watch.close()
    finally:
        shared.close()
