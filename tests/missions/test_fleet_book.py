from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from smachpy.places.pose import Pose2D
from smachpy.states import Waypoint
from smachpy_missions.fleet.order_book import FINAL, MAX_ATTEMPTS, DockBook, Order, OrderBook, Stage
from smachpy_missions.interfaces.srv import PermitRequest

PICK_UP, DRIVE_OFF, HAND_OVER = (
    PermitRequest.PICK_UP,
    PermitRequest.DRIVE_OFF,
    PermitRequest.HAND_OVER,
)
HERE, THERE = Waypoint("here", Pose2D(0, 0, 0)), Waypoint("there", Pose2D(9, 9, 0))
SEEN = Pose2D(4, 4, 0)


def book(count=1):
    return OrderBook(Order(f"o{n}", HERE, THERE) for n in range(count))


def ask(book, entry, robot, attempt, step):
    return book.permit(
        PermitRequest(order=entry.order.name, attempt=attempt, robot=robot, step=step)
    )


def up_to(book, robot, *steps):
    entry = book.hand_out(robot)
    for step in steps:
        assert ask(book, entry, robot, entry.attempt, step) == ""
    return entry


def test_an_order_goes_along_its_line():
    orders = book()
    entry = up_to(orders, "a", PICK_UP, DRIVE_OFF, HAND_OVER)
    orders.delivered(entry)
    assert entry.stage is Stage.DELIVERED
    assert not orders.open
    assert orders.report() == "1 delivered, 0 in doubt, 0 undelivered"
    assert orders.hand_out("b") is None


@pytest.mark.parametrize(
    ("steps", "step"),
    [
        ((), DRIVE_OFF),
        ((), HAND_OVER),
        ((PICK_UP,), HAND_OVER),
        ((PICK_UP, DRIVE_OFF), PICK_UP),
        ((PICK_UP, DRIVE_OFF, HAND_OVER), DRIVE_OFF),
        ((), 9),
    ],
)
def test_a_step_out_of_turn_is_refused(steps, step):
    orders = book()
    entry = up_to(orders, "a", *steps)
    before = entry.stage
    assert ask(orders, entry, "a", 1, step) != ""
    assert entry.stage is before


def test_a_step_asked_for_again_is_granted_again():
    orders = book()
    entry = up_to(orders, "a", PICK_UP, PICK_UP, DRIVE_OFF, DRIVE_OFF, HAND_OVER, HAND_OVER)
    assert entry.stage is Stage.HANDING_OVER


def test_nobody_takes_a_step_with_an_order_that_is_not_his():
    orders = book()
    entry = up_to(orders, "a")
    assert ask(orders, entry, "b", 1, PICK_UP) == "o0: it is no longer b's"
    assert ask(orders, entry, "a", 2, PICK_UP) == "o0: it is no longer a's"
    request = PermitRequest(order="o7", attempt=1, robot="a", step=PICK_UP)
    assert orders.permit(request) == "there is no order 'o7'"


@pytest.mark.parametrize("steps", [(), (PICK_UP,), (PICK_UP, DRIVE_OFF)])
def test_who_was_lost_and_comes_back_is_refused(steps):
    orders = book()
    entry = up_to(orders, "a", *steps)
    orders.lost(entry, SEEN)
    for step in (PICK_UP, DRIVE_OFF, HAND_OVER):
        assert ask(orders, entry, "a", 1, step) == "o0: it is no longer a's"
    assert orders.hand_out("a") is None  # nor does it get the order again
    assert orders.hand_out("b") is entry
    for step in (PICK_UP, DRIVE_OFF, HAND_OVER):
        assert ask(orders, entry, "a", 1, step) == "o0: it is no longer a's"
    assert ask(orders, entry, "b", 2, PICK_UP) == ""


@pytest.mark.parametrize(
    ("steps", "pickup"),
    [((), HERE.pose), ((PICK_UP,), HERE.pose), ((PICK_UP, DRIVE_OFF), SEEN)],
)
def test_the_next_robot_fetches_the_parcel_where_it_is(steps, pickup):
    orders = book()
    entry = up_to(orders, "a", *steps)
    orders.lost(entry, SEEN)
    assert (entry.stage, entry.pickup) == (Stage.WAITING, pickup)


def test_a_parcel_on_a_robot_that_was_never_seen_is_reported():
    orders = book()
    entry = up_to(orders, "a", PICK_UP, DRIVE_OFF)
    orders.lost(entry, None)
    assert entry.stage is Stage.UNDELIVERED
    assert entry.reason == "a was lost while it was aboard, nobody knows where"


def test_what_may_have_been_handed_over_is_in_doubt_for_ever():
    orders = book()
    entry = up_to(orders, "a", PICK_UP, DRIVE_OFF, HAND_OVER)
    orders.lost(entry, SEEN)
    assert entry.stage is Stage.IN_DOUBT
    assert orders.hand_out("b") is None
    assert orders.report().splitlines()[1] == (
        "  o0: in doubt: a was lost while it was handing over"
    )


def test_an_order_that_so_many_fail_is_given_up():
    orders = book()
    for n in range(MAX_ATTEMPTS):
        orders.failed(up_to(orders, f"r{n}"), "no way", aboard=False)
    (entry,) = orders.entries.values()
    assert entry.reason == f"no way; {MAX_ATTEMPTS} robots have tried"
    assert not orders.open


def test_an_order_that_none_of_the_others_may_take_is_given_up():
    orders = book(2)
    orders.failed(up_to(orders, "a"), "no way", aboard=False)
    orders.give_up(["a", "b"])
    assert orders.open
    orders.give_up(["a"])
    assert orders.entries["o0"].stage is Stage.UNDELIVERED
    assert orders.entries["o1"].stage is Stage.WAITING
    orders.give_up([])
    assert not orders.open


def test_the_word_of_a_robot_that_lives_counts():
    orders = book(2)
    entry = up_to(orders, "a", PICK_UP, DRIVE_OFF, HAND_OVER)
    orders.failed(entry, "stopped", aboard=True)
    assert (entry.stage, entry.reason) == (Stage.UNDELIVERED, "aboard a: stopped")
    entry = up_to(orders, "b", PICK_UP, DRIVE_OFF)
    orders.failed(entry, "dropped it", aboard=False)
    assert entry.stage is Stage.IN_DOUBT


ROBOTS = st.sampled_from(["a", "b", "c", "d"])
DEEDS = st.lists(
    st.tuples(
        st.sampled_from(["hand_out", "permit", "deliver", "fail", "fail aboard", "lose"]),
        ROBOTS,
        st.sampled_from([PICK_UP, DRIVE_OFF, HAND_OVER]),
        st.integers(1, MAX_ATTEMPTS),
    ),
    max_size=60,
)


@given(DEEDS)
def test_no_order_may_ever_be_handed_over_by_two(deeds):
    """Whatever robots ask and report, in any order, late and wrong ones included."""
    orders = book(2)
    granted: dict[str, set[tuple[str, int]]] = {name: set() for name in orders.entries}
    for deed, robot, step, attempt in deeds:
        held = [e for e in orders.entries.values() if e.robot == robot and e.stage not in FINAL]
        if deed == "hand_out" and not held:
            orders.hand_out(robot)
        elif deed == "permit":
            for entry in orders.entries.values():
                ended = entry.stage in FINAL
                if ask(orders, entry, robot, attempt, step) == "":
                    assert not ended
                    if step == HAND_OVER:
                        granted[entry.order.name].add((robot, attempt))
        elif held:
            (entry,) = held
            if deed == "deliver" and entry.stage is Stage.HANDING_OVER:
                orders.delivered(entry)
            elif deed.startswith("fail"):
                orders.failed(entry, "why", aboard=deed.endswith("aboard"))
            elif deed == "lose":
                orders.lost(entry, SEEN)
    orders.close("the end")
    assert not orders.open
    for name, entry in orders.entries.items():
        assert len(granted[name]) <= 1
        assert entry.stage is not Stage.DELIVERED or granted[name]
        assert (entry.reason == "") == (entry.stage is Stage.DELIVERED)


@given(st.lists(st.tuples(st.sampled_from(["take", "leave", "block"]), ROBOTS), max_size=40))
def test_no_dock_is_ever_held_by_two(deeds):
    stations = [Waypoint(f"d{n}", Pose2D(n, 0, 0)) for n in range(2)]
    docks = DockBook(stations)
    holding: dict[str, Waypoint] = {}
    for deed, robot in deeds:
        if deed == "take" and robot not in holding:
            dock = docks.take(robot, None)
            if dock is None:
                assert len(docks.holders) == len(stations)
            else:
                assert dock.name not in {d.name for d in holding.values()}
                holding[robot] = dock
        elif deed == "leave" and robot in holding:
            docks.leave(holding.pop(robot), robot)
        elif deed == "block" and robot in holding:
            docks.block(holding[robot], robot)
            dock = holding.pop(robot)
            holding[f"dead, at {dock.name}"] = dock
        assert len(docks.holders) == len(holding)
    assert docks.hopeless == (len(docks.blocked) == len(stations))


def test_the_nearest_free_dock_is_given():
    docks = DockBook([Waypoint("far", Pose2D(9, 0, 0)), Waypoint("near", Pose2D(1, 0, 0))])
    assert docks.take("a", Pose2D(0, 0, 0)).name == "near"
    assert docks.take("b", Pose2D(0, 0, 0)).name == "far"
    assert docks.take("c", Pose2D(0, 0, 0)) is None
    docks.leave(Waypoint("near", Pose2D(1, 0, 0)), "b")  # it is not b's
    assert docks.take("c", None) is None
