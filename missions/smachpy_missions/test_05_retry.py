"""Lesson 5: a double in the place of a state fails as often as the test wants; time is virtual."""

import pytest

from smachpy_missions.lesson_05_retry import Gripper, take_cup


def test_nobody_comes_in_time(mission):
    run = mission(take_cup(seconds=60.0))
    run.assert_outcome("nobody")
    assert run.duration == 5.0


@pytest.mark.parametrize(("failures", "outcome"), [(0, "held"), (2, "held"), (3, "broken")])
def test_the_gripper_gets_three_tries(mission, failures, outcome):
    answers = iter([OSError("no answer")] * failures)

    class Failing(Gripper):
        def close(self):
            for error in answers:
                raise error

    mission(take_cup(gripper=Failing())).assert_outcome(outcome)
