"""Lesson 1: a machine runs in a test as it runs anywhere else."""

from smachpy_missions.lesson_01_state import hello


def test_it_says_hello(capsys):
    assert hello().execute() == "succeeded"
    assert "Hello" in capsys.readouterr().out


def test_it_can_run_again():
    sm = hello()
    assert [sm.execute(), sm.execute()] == ["succeeded", "succeeded"]
