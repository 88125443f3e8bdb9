"""A mission whose PostgreSQL is restarted, or replaced by its standby, while it runs."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
import threading
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import smachpy
from smachpy import CBState, StateMachine
from smachpy.durable.journal import read_position
from smachpy.durable.opening import open_store
from smachpy.durable.processes import this_runner
from tests.postgres_server import PostgresServer
from tests.smachpy.durable.test_stores import LONG_S, ROW

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


def crash_after(server: PostgresServer, kill_at: int) -> bool:
    """Crash the server after that statement of one of four runners; return whether it came to it."""
    import psycopg

    url = server.new_database(f"queue_{kill_at}")
    names = [f"m{n}" for n in range(8)]
    with contextlib.closing(open_store(url)) as store:
        for name in names:
            store.create(replace(ROW, id=name, group="lift" if name == "m0" else None))
    ran: list[str] = []
    reached: list[int] = []
    left = [kill_at]
    barrier = threading.Barrier(4)

    def runner(left: list[int] | None, *, alone: bool = False) -> None:
        with contextlib.closing(open_store(url, patience=PATIENCE_S)) as store:
            do = store._do

            def counted(cursor: Any, sql: str, *values: object) -> None:
                do(cursor, sql, *values)
                assert left is not None
                left[0] -= 1
                if left[0] == 0:
                    reached.append(len(ran))
                    server.kill()
                    server.start()

            if left is not None:
                store._do = counted
            if not alone:
                barrier.wait(PATIENCE_S)
            while (found := store.reserve(this_runner(), seconds=LONG_S)) is not None:
                row, lease = found
                lease = store.claim(row.id, this_runner(), seconds=LONG_S, reserved=lease)
                ran.append(row.id)
                store.append(lease, [b"x"], status="ended", outcome="done")
                store.release(lease, "ended")

    threads = [threading.Thread(target=runner, args=(left if n == 0 else None,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(4 * PATIENCE_S)
        assert not thread.is_alive()
    # A runner whose answer was lost with the server has a reservation of which it does not know.
    lost = sorted(set(names) - set(ran))
    with psycopg.connect(url, autocommit=True) as connection:
        ended = connection.execute(
            "UPDATE smachpy_missions SET lease_end = 0 "
            "WHERE owner IS NOT NULL AND status = 'queued' RETURNING id"
        )
        assert sorted(row[0] for row in ended) == lost
    with contextlib.closing(open_store(url)) as store:
        store.look()
    runner(None, alone=True)
    assert sorted(ran) == names
    with contextlib.closing(open_store(url)) as store:
        assert {row.status for row in store.missions()} == {"ended"}
        assert all(len(store.read(name)[1]) == 1 for name in names)
    return bool(reached)


@pytest.mark.postgres
@pytest.mark.slow
@pytest.mark.timeout(900)
def test_each_mission_runs_once_if_the_database_is_killed_at_any_statement(folder: Path) -> None:
    """Four runners share a queue; after each statement of one of them, the server crashes once."""
    (folder / "own").mkdir()
    folder.chmod(0o777)
    server = PostgresServer(folder / "own")
    server.start()
    try:
        # How many statements are that runner's depends on how quick the others are.
        assert sum(crash_after(server, kill_at) for kill_at in range(1, 25)) >= 5
    finally:
        server.stop()
