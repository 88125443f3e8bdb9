"""A Petri Net Plan on the page in a real browser: its tokens, and why its transitions do not fire."""

from __future__ import annotations

import threading
from itertools import pairwise

import pytest

from actionlib_core.node import Node, use_node
from smachpy import IntrospectionServer
from smachpy.pnp import PetriNetPlan
from tests.smachpy.pnp.nets import net_of

pytestmark = [pytest.mark.browser, pytest.mark.zenoh]

NET = """
init* -> there : [begun]
there -> near near : [and seen close]
near near -> goal : [taken]
"""


@pytest.fixture
def no_leaks():
    """Processes of the browser outlive single tests."""


@pytest.fixture
def plan(domain):
    """A plan that runs in this process, and what was heard of its end."""
    net = net_of(NET, "fetch")
    plan = PetriNetPlan(net)
    with Node("robot") as node, use_node(node):
        server = IntrospectionServer("fetch", plan, "/fetch", control=True)
        server.start()
        worker = threading.Thread(target=plan.execute)
        worker.start()
        yield plan
        plan.request_preempt()
        worker.join()
        server.stop()


def path_of(plan, name):
    net = plan.plan.net
    (found,) = [p.id for p in net.places if p.name == name]
    return f"/fetch/{found}"


def text_of(page, path):
    """What stands at a box: its classes and its badge."""
    return page.evaluate(
        """(path) => { const g = document.querySelector(`g[data-path="${path}"]`);
        return [[...g.classList], g.querySelector(".badge").textContent, g.getAttribute("aria-label")]; }""",
        path,
    )


def wait_for(page, path, wanted):
    """Wait until a badge says something; the page is woken by events alone."""
    page.wait_for_selector(f'g[data-path="{path}"] .badge >> text="{wanted}"')


def test_tokens_move_and_guards_say_what_they_wait_for(plan, start, look):
    page = look(start.view().base + "?machine=fetch")
    first, second, third = (f"/fetch/{t.id}" for t in plan.plan.net.transitions)
    init, there, near = (path_of(plan, name) for name in ("init", "there", "near"))
    wait_for(page, first, "begun is false")
    boxes = [page.locator(f'g[data-path="{path}"]').bounding_box() for path in (init, first, there)]
    assert any(
        all(one[at] + one[size] <= other[at] for one, other in pairwise(boxes))
        for at, size in (("x", "width"), ("y", "height"))
    ), boxes
    assert "waiting" in text_of(page, first)[0]
    assert "marked" in text_of(page, init)[0]
    assert text_of(page, init)[1] == "\u25cf"
    assert "lacks tokens in there" in text_of(page, second)[2]

    plan.post("begun")
    wait_for(page, second, "seen is false, close is false")
    assert "marked" not in text_of(page, init)[0]
    assert "fired" in text_of(page, first)[0]
    assert text_of(page, there)[1] == "\u25cf"
    plan.set_condition("seen", True)
    wait_for(page, second, "seen is true, close is false")

    plan.set_condition("close", True)
    wait_for(page, third, "taken is false")
    assert text_of(page, near)[1] == "\u25cf\u25cf"
    assert "2 tokens" in text_of(page, near)[2]
    plan.post("taken")
    wait_for(page, path_of(plan, "goal"), "\u25cf")
    assert text_of(page, third)[1] == ""


def test_an_operator_fires_a_transition(plan, start, look):
    view = start.view("--control")
    page = look(f"{view.base}?machine=fetch#token={view.token}")
    first, second, _ = (f"/fetch/{t.id}" for t in plan.plan.net.transitions)
    wait_for(page, first, "begun is false")
    page.click(f'g[data-path="{first}"]')
    page.get_by_role("button", name="Fire", exact=True).click()
    page.click(".confirm .warn")
    wait_for(page, second, "seen is false, close is false")
    assert plan.marking() == {path_of(plan, "there").rpartition("/")[2]: 1}
