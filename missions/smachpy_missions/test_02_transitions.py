"""Lesson 2: the fixture `mission` runs a machine; the run knows its path."""

from smachpy_missions.lesson_02_transitions import mail


def test_every_letter_is_read(mission):
    run = mission(mail())
    run.assert_outcome("succeeded")
    run.assert_path(["OPEN", "READ", "READ", "READ"])


def test_an_empty_box_ends_it_at_once(mission):
    mission.replace("OPEN", outcomes=["opened"], writes={"letters": []})
    run = mission(mail())
    run.assert_path(["OPEN", "READ"])
