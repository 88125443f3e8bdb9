"""Lesson 4: a part of a mission is tested alone, then in its place."""

from smachpy_missions.lesson_04_nesting import move_cup, pick


def test_pick_takes_the_cup_at_the_place(mission):
    run = mission(pick(), userdata={"place": "floor"})
    run.assert_outcome("held")
    run.assert_userdata(thing="cup from the floor")


def test_first_the_table_then_the_shelf(mission):
    run = mission(move_cup())
    run.assert_path(["FROM_TABLE/REACH", "FROM_TABLE/GRIP", "FROM_SHELF/REACH", "FROM_SHELF/GRIP"])
    run.assert_userdata(thing="cup from the shelf")
