"""A mission whose PostgreSQL is restarted, or replaced by its standby, while it runs."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import smachpy
from smachpy import CBState, StateMachine
from smachpy.durable.journal import read_position
from smachpy.durable.store import open_store
from tests.postgres_server import PostgresServer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

PATIENCE_S = 60.0  # a busy computer


@pytest.fixture
def folder() -> Iterator[Path]:
    # Not in pytest's own folder: the servers run as another user, who may not look into it.
    path = Path(tempfile.mkdtemp(prefix="smachpy-postgres-"))
    yield path
    shutil.rmtree(path)


@pytest.fixture
def pair(folder: Path) -> Iterator[tuple[PostgresServer, PostgresServer]]:
    """A server, and a standby that has all that is committed there."""
    import psycopg

    (folder / "first").mkdir()
    (folder / "second").mkdir()
    folder.chmod(0o777)
    first = PostgresServer(folder / "first")
    first.start()
    try:
        second = PostgresServer(folder / "second", primary=first)
        second.start()
        try:
            with psycopg.connect(first.url, autocommit=True) as connection:
                connection.execute("ALTER SYSTEM SET synchronous_standby_names = '*'")
                connection.execute("SELECT pg_reload_conf()")
            yield first, second
        finally:
            second.stop()
    finally:
        first.stop()


def errand(happens: Callable[[], object]) -> StateMachine:
    def carry(userdata: dict[str, int]) -> str:
        happens()
        userdata["parcel"] += 1
        return "done"

    machine = StateMachine(["done"], name="ERRAND")
    machine.userdata.parcel = 0
    keys = {"input_keys": ["parcel"], "output_keys": ["parcel"]}
    with machine:
        for label, following in (("LOAD", "CARRY"), ("CARRY", "UNLOAD"), ("UNLOAD", "done")):
            work = carry if label == "CARRY" else (lambda _: "done")
            state = CBState(work, outcomes=["done"], **keys)
            StateMachine.add(label, state, {"done": following})
    return machine


@pytest.mark.postgres
def test_a_standby_takes_over_from_a_server_that_crashes(
    pair: tuple[PostgresServer, PostgresServer],
) -> None:
    first, second = pair
    hosts = f"127.0.0.1:{first.port},127.0.0.1:{second.port}"
    url = f"postgresql://tests@{hosts}/postgres?target_session_attrs=read-write"

    def crash() -> None:
        first.kill()
        second.promote()

    store = open_store(url, patience=PATIENCE_S)
    machine = errand(crash)
    assert smachpy.run_durable(machine, store, mission="m") == "done"
    assert machine.userdata.parcel == 1
    store.close()
    store = open_store(second.url)  # that one has all of it
    position = read_position(store, "m")
    assert position.data["outcome"] == "done"
    assert position.userdata["/ERRAND"] == {"parcel": 1}
    assert store.mission("m").status == "ended"
    store.close()


@pytest.mark.postgres
@pytest.mark.parametrize("how", ["stop", "kill"])
def test_a_server_restarts_under_a_running_mission(
    postgres_server: PostgresServer, postgres_url: str, how: str
) -> None:
    def restart() -> None:
        getattr(postgres_server, how)()
        postgres_server.start()

    store = open_store(postgres_url, patience=PATIENCE_S)
    assert smachpy.run_durable(errand(restart), store, mission="m") == "done"
    assert read_position(store, "m").userdata["/ERRAND"] == {"parcel": 1}
    store.close()
