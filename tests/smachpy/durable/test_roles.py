"""The roles of docs/deployments.md: who submits cannot run, who reads changes nothing."""

from __future__ import annotations

import contextlib
import re

import pytest

import smachpy
from smachpy.durable.mission import new_mission
from smachpy.durable.opening import open_store
from smachpy.durable.overview import overview
from smachpy.durable.processes import this_runner
from smachpy.durable.store import StoreError
from tests.places import DOCS

pytestmark = pytest.mark.postgres

PAGE = DOCS / "deployments.md"
ROLES = ("smachpy_submit", "smachpy_run", "smachpy_read")


def mission(name):
    machine = smachpy.StateMachine(["done"], name="M")
    machine.add("A", smachpy.CBState(lambda _: "done", outcomes=["done"]))
    return machine, new_mission(machine, mission=name, target="patrol", argv=(), robot=None)


@pytest.fixture
def stores(postgres_url):
    """The store of the administrator and of each role, set up as the page says."""
    import psycopg

    [block] = re.findall(r"```sql\n(.*?)```", PAGE.read_text(), re.DOTALL)
    with contextlib.ExitStack() as stack:
        admin = stack.enter_context(contextlib.closing(open_store(postgres_url)))
        connection = stack.enter_context(psycopg.connect(postgres_url, autocommit=True))
        for statement in filter(str.strip, block.split(";")):
            connection.execute(statement)
        found = {"admin": admin}
        for role in ROLES:
            url = postgres_url.replace("tests@", f"{role}@")
            found[role] = stack.enter_context(contextlib.closing(open_store(url, patience=2.0)))
        yield found
        for role in ROLES:
            connection.execute(f"DROP OWNED BY {role}")
            connection.execute(f"DROP ROLE {role}")


def refused(call):
    with pytest.raises(StoreError, match="may not do that"):
        call()


def test_each_role_does_its_work_and_nothing_else(stores):
    submits, runs, reads = (stores[role] for role in ROLES)
    submits.create(mission("one")[1])
    assert submits.mission("one").status == "queued"
    refused(lambda: submits.claim("one", this_runner(), seconds=10.0))
    refused(lambda: submits.request_cancel("one"))
    refused(lambda: submits.forget("one"))
    refused(lambda: submits.read("one"))

    assert [row.id for row in reads.missions()] == ["one"]
    refused(lambda: reads.create(mission("two")[1]))
    refused(lambda: reads.claim("one", this_runner(), seconds=10.0))
    refused(lambda: reads.request_cancel("one"))
    refused(lambda: reads.forget("one"))

    assert smachpy.run_durable(mission("one")[0], runs, mission="one") == "done"
    assert overview(reads, reads.mission("one"))["outcome"] == "done"
    runs.forget("one")
    assert reads.missions() == []
