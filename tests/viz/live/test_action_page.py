"""The action page in a real browser, against the simulated robot in another process."""

from __future__ import annotations

import pytest

from tests.browser import wait_for

pytestmark = [pytest.mark.browser, pytest.mark.zenoh]

FRAME = '[id="$.target_pose.header.frame_id"]'
X, Y = ('[id="$.target_pose.pose.position.x"]', '[id="$.target_pose.pose.position.y"]')


@pytest.fixture
def no_leaks():
    """Processes of this module's fixtures outlive single tests."""


@pytest.fixture
def action_page(simulation, start, look):
    """`action_page()` is the page of the robot's `move_base`, with the token."""

    def open_page(*arguments, view=None, token=True):
        view = view or start.view(*arguments)
        address = view.address if token else view.base
        page = look(
            address.replace("/#", "/?actions#") if token else f"{address}?actions", drawn=False
        )
        page.click(".action:has(b:text-is('/move_base'))")
        page.wait_for_selector(FRAME)
        return page

    return open_page


def fill(page, x, y):
    page.fill(FRAME, "map")
    page.fill(X, x)
    page.fill(Y, y)


def test_a_goal_from_the_form_shows_its_feedback_and_can_be_cancelled(action_page):
    page = action_page("--control")
    assert "Where to drive to" in page.text_content(".goal-pane")
    assert page.input_value('[id="$.target_pose.pose.orientation.w"]') == "1.0"
    fill(page, "3.5", "2.0")
    page.click("#send-goal")
    page.wait_for_selector(".sent.active")
    wait_for(page, "smachpy.store.data.actions.value.goals[0]?.fraction > 0.01")
    assert "base_position" in page.text_content(".sent pre")
    assert "m left" in page.text_content(".sent")
    page.click(".sent >> text=Cancel")
    page.wait_for_selector(".sent.preempted .pill-text:text-is('preempted')")
    assert page.query_selector(".sent >> text=Cancel") is None
    assert page.foreign == []


def test_a_goal_to_its_end(action_page):
    page = action_page("--control")
    page.click(".action:has(b:text-is('/charge'))")
    page.wait_for_selector('[id="$.until"]')
    assert "0 to 1" in page.text_content(".goal-pane")
    page.fill('[id="$.until"]', "0.1")
    page.press('[id="$.until"]', "Control+Enter")
    page.wait_for_selector(".sent")
    wait_for(page, "smachpy.store.data.actions.value.goals[0]?.ended")
    # Not at the dock, the robot refuses; at the dock, it has charge enough already.
    status, text = page.evaluate(
        "() => { const g = smachpy.store.data.actions.value.goals[0]; return [g.status, g.text]; }"
    )
    assert status in {"ABORTED", "REJECTED", "SUCCEEDED"}
    assert text in page.text_content(".sent")


def test_bad_values_are_named_at_their_fields_and_are_not_sent(commanding, action_page):
    page = action_page(view=commanding)
    fill(page, "north", "2.0")
    page.fill('[id="$.target_pose.header.seq"]', "-1")
    page.click("#send-goal")
    page.wait_for_selector(".problem")
    assert page.get_attribute(X, "aria-invalid") == "true"
    assert page.get_attribute(Y, "aria-invalid") == "false"
    told = page.get_attribute(X, "aria-describedby").split()[-1]
    assert page.text_content(f'[id="{told}"]') == "expected float64, got “north”"
    assert page.text_content('[id="$.target_pose.header.seq!"]') == (
        "expected uint32 (0 to 4294967295), got -1"
    )
    # The first bad field has the focus, and nothing has been sent.
    wait_for(page, "document.activeElement.id === '$.target_pose.header.seq'")
    assert page.evaluate("() => smachpy.store.data.actions.value.goals.length") == 0


def test_form_and_yaml_are_two_views_of_one_goal(commanding, action_page):
    page = action_page(view=commanding)
    fill(page, "1.25", "-2")
    page.click("[role=tab]:text-is('YAML')")
    page.wait_for_selector("textarea")
    text = page.input_value("textarea")
    assert "x: 1.25" in text
    assert 'frame_id: "map"' in text
    assert "# Where to drive" not in text.splitlines()[-1]
    page.fill("textarea", text.replace("1.25", "wrong"))
    page.click("[role=tab]:text-is('Form')")
    page.wait_for_selector(".problem-list")
    assert "$.target_pose.pose.position.x" in page.text_content(".problem-list")
    page.fill("textarea", text.replace("1.25", "7.5"))
    page.click("[role=tab]:text-is('Form')")
    page.wait_for_selector(X)
    assert page.input_value(X) == "7.5"
    assert page.input_value(Y) == "-2.0"
    page.click("text=Defaults")
    wait_for(page, f"document.querySelector('{X}').value === '0.0'")


def test_a_viewer_that_only_looks_shows_the_form_and_says_why_nothing_goes(action_page, look):
    page = action_page(token=False)
    assert "smachpy view --control" in page.text_content("#why")
    assert page.is_disabled("#send-goal")
    assert page.is_disabled(X)
    ask = """(headers) => fetch('/api/action', {method: 'POST', headers,
        body: JSON.stringify({command: 'send', name: 'move_base', yaml: ''})}).then((a) => a.status)"""
    assert page.evaluate(ask, {}) == 403


def test_with_control_but_without_the_token_nothing_goes_either(commanding, action_page):
    page = action_page(view=commanding, token=False)
    assert "has no token" in page.text_content("#why")
    assert page.is_disabled("#send-goal")
    ask = """(headers) => fetch('/api/action', {method: 'POST', headers,
        body: JSON.stringify({command: 'send', name: 'move_base', yaml: ''})}).then(async (a) => [a.status,
          await a.text()])"""
    status, text = page.evaluate(ask, {"x-smachpy-token": "guess"})
    assert status == 403
    assert "token" in text


def test_a_server_that_dies_is_told_at_its_goal_and_at_its_form(alone, start, look):
    robot = start.simulation()
    view = start.view("--control")
    page = look(view.address.replace("/#", "/?actions#"), drawn=False)
    page.click(".action:has(b:text-is('/move_base'))")
    page.wait_for_selector(FRAME)
    fill(page, "3.5", "2.0")
    page.click("#send-goal")
    page.wait_for_selector(".sent.active")
    robot.kill()
    page.wait_for_selector(".sent.failure .pill-text:text-is('lost')")
    assert "The server of this goal is gone" in page.text_content(".sent")
    page.wait_for_selector("text=it has left or died")
    assert page.is_disabled("#send-goal")
    assert page.input_value(X) == "3.5"
    start.simulation()
    wait_for(page, "!document.getElementById('send-goal').disabled")
    assert page.input_value(X) == "3.5"


def test_with_the_keyboard_alone_and_with_names_for_all(commanding, action_page):
    page = action_page(view=commanding)
    page.keyboard.press("Escape")
    page.keyboard.press("Escape")
    wait_for(page, "!document.querySelector('.actions-page')")
    page.keyboard.press("a")
    page.wait_for_selector(".actions-page")
    wait_for(page, "document.activeElement.id === 'actions-title'")
    wait_for(page, "document.querySelectorAll('.action').length === 2")
    unnamed = page.evaluate("""() => [...document.querySelectorAll(
        '.actions-page button, .actions-page input, .actions-page select, .actions-page textarea')]
        .filter((e) => !(e.getAttribute('aria-label') || e.labels?.length || e.textContent.trim()))
        .map((e) => e.outerHTML)""")
    assert unnamed == []
    for key in ("Tab", "Tab", "Enter"):  # the second action of the list
        page.keyboard.press(key)
    page.wait_for_selector(FRAME)
    page.focus("[role=tab][aria-selected=true]")
    page.keyboard.press("ArrowRight")
    page.wait_for_selector("textarea")
    wait_for(page, "document.activeElement.textContent === 'YAML'")
    # Keys of the diagram mean nothing here.
    k = page.evaluate("() => smachpy.page.view.k")
    page.keyboard.press("+")
    assert page.evaluate("() => smachpy.page.view.k") == k


SENDER = """
from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from actionlib_core.node import Node
import sys
client = SimpleActionClient("move_base", MoveBaseAction, node=Node("planner"))
assert client.wait_for_server(60.0)
goal = MoveBaseGoal()
goal.target_pose.header.frame_id = "map"
position, orientation = goal.target_pose.pose.position, goal.target_pose.pose.orientation
position.x, position.y, orientation.w = 3.5, 2.0, 1.0
client.send_goal(goal)
assert not client.wait_for_result(1.0)
print("sent", flush=True)
sys.stdin.read()
"""


def test_a_goal_of_a_killed_program_is_shown_and_cancelled(alone, start, look):
    """Nobody else can stop that robot."""
    start.simulation()
    page = look(start.view("--control").address.replace("/#", "/?actions#"), drawn=False)
    page.click(".action:has(b:text-is('/move_base'))")
    sender = start.program(SENDER)
    assert sender.said == "sent"
    sender.kill()
    page.wait_for_selector(".sent:has-text('node /planner'):has-text('its client is gone')")
    page.click(".sent:has-text('node /planner') button:text-is('Cancel')")
    assert "Cancel the goal of node /planner to /move_base?" in page.text_content(".confirm")
    page.click(".confirm .warn")
    page.wait_for_selector(".sent:has-text('node /planner')", state="detached")
