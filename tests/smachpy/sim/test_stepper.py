from __future__ import annotations

import pytest

from smachpy.sim.stepper import Stepper


class Thing:
    """Is busy for a number of steps."""

    def __init__(self, steps=0):
        self.left = steps
        self.times = []
        self.reports = []

    def is_busy(self, now):
        return self.left > 0

    def step(self, now, dt):
        self.left -= 1
        self.times.append(now)

    def report(self, now):
        self.reports.append(now)


@pytest.fixture
def stepper(clock):
    stepper = Stepper(clock, rate=20.0)
    yield stepper
    stepper.close()


def test_it_steps_what_is_busy_at_its_rate(clock, stepper):
    thing = Thing(steps=10)
    stepper.add(thing)
    clock.sleep(1.0)
    assert thing.times == pytest.approx([0.05 * i for i in range(10)])
    assert thing.reports[:5] == pytest.approx([0.1 * i for i in range(1, 6)])


def test_what_is_idle_is_only_reported(clock, stepper):
    thing = Thing()
    stepper.add(thing)
    clock.sleep(10.0)
    assert thing.times == []
    assert len(thing.reports) == pytest.approx(20, abs=2)


def test_it_wakes_at_once_for_an_order(clock, stepper):
    thing = Thing()
    stepper.add(thing)
    clock.sleep(3.2)
    thing.left = 2
    stepper.wake()
    clock.sleep(0.2)
    assert thing.times == pytest.approx([3.2, 3.25])


def test_what_was_removed_is_stepped_no_more(clock, stepper):
    kept, removed = Thing(steps=100), Thing(steps=100)
    stepper.add(kept)
    stepper.add(removed)
    clock.sleep(0.95)
    stepper.remove(removed)
    clock.sleep(1.0)
    assert len(removed.times) == pytest.approx(20, abs=2)
    assert len(kept.times) > 35


def test_a_slow_computer_gives_lost_time_up(clock):
    class Slow(Thing):
        def report(self, now):
            clock.sleep(2.0)

    stepper = Stepper(clock, rate=20.0)
    thing = Slow(steps=100)
    stepper.add(thing)
    clock.sleep(10.0)
    stepper.close()
    assert len(thing.times) < 20
    assert thing.times[-1] > 7.0
    clock.sleep(3.0)


def test_close_twice_is_once(clock):
    stepper = Stepper(clock)
    stepper.add(Thing(steps=3))
    stepper.close()
    stepper.close()
