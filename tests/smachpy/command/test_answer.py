"""`smachpy answer` against a mission in another process, over zenoh."""

from __future__ import annotations

import json
import subprocess
import sys
import textwrap

import pytest

from smachpy.command.answer import choose, show
from smachpy.exceptions import MissionError
from smachpy.states.questions import Question

COMMAND = [sys.executable, "-m", "smachpy.command"]
# The same, but it takes a network on which it finds nothing at once for a busy one.
PATIENT = """
import sys
from actionlib_core.wire import presence
from smachpy.command import main

presence.FIRST_S = presence.SETTLE_MOST_S = 60.0
presence.is_busy = lambda: True
sys.exit(main())
"""
MISSION = """
    import smachpy
    from smachpy.events import QuestionAsked
    from smachpy.states import AskOperator

    @smachpy.mission()
    def ask():
        sm = smachpy.StateMachine(["yes", "no", "preempted"], name="JOB")
        with sm:
            sm.add("ASK", AskOperator("Go on?", patience=300.0, default="no"))
        sm.subscribe(lambda e: print("asked", flush=True) if isinstance(e, QuestionAsked) else None)
        return sm
"""


def question(path, service="operator/questions/q"):
    return Question(path, "Go on?", ("yes", "no"), ("", ""), "no", 60.0, 30.0, service)


@pytest.mark.slow
@pytest.mark.zenoh
@pytest.mark.timeout(900)  # six processes, one after another
def test_a_mission_in_another_process_is_answered_by_name(tmp_path):
    (tmp_path / "ask.py").write_text(textwrap.dedent(MISSION))

    def answer(*words, command=(sys.executable, "-c", PATIENT)):
        done = subprocess.run(
            [*command, "answer", *words], capture_output=True, text=True, timeout=200
        )
        return done.returncode, done.stdout, done.stderr

    record = tmp_path / "run.jsonl"
    mission = subprocess.Popen(
        [*COMMAND, "run", str(tmp_path / "ask.py") + ":ask", "--record", str(record)],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    try:
        assert any("asked" in line for line in mission.stdout)
        code, shown, _ = answer("--json")
        (found,) = json.loads(shown)
        assert (code, found["path"], found["answers"]) == (0, "/JOB/ASK", ["yes", "no"])
        code, _, told = answer("yse", "--state", "ASK")
        assert code == 2
        assert "Did you mean 'yes'?" in told
        assert answer("yes", "--by", "ann")[0] == 0
        mission.stdout.read()
        mission.wait(60)
    finally:
        mission.kill()
        mission.wait()
        mission.stdout.close()
    events = [json.loads(line) for line in record.read_text().splitlines()]
    (answered,) = (event for event in events if event.get("kind") == "QuestionAnswered")
    assert (answered["answer"], answered["by"]) == ("yes", "ann")
    assert answer(command=COMMAND)[0] == 1  # nobody asks any more
    code, _, told = answer("yes", command=COMMAND)
    assert code == 2
    assert "no question" in told


def test_a_question_is_chosen_by_the_end_of_its_path():
    one, other = question("/A/ASK"), question("/B/C/ASK")
    assert choose([one], None) is one
    assert choose([one, other], "C/ASK") is other
    assert choose([one, other], "/A/ASK") is one
    for state in (None, "ASK"):
        with pytest.raises(MissionError, match=r"2 questions are asked"):
            choose([one, other], state)
    with pytest.raises(MissionError, match=r"expected one of \['/A/ASK'\]"):
        choose([one], "SK")
    with pytest.raises(MissionError, match="no question"):
        choose([], None)
    inner = question("/X/A/ASK")
    assert choose([one, inner], "/A/ASK") is one
    assert choose([one, inner], "/X/A/ASK") is inner


def test_questions_of_one_path_are_chosen_by_their_services(capsys):
    """Two robots run the same mission."""
    one, other = (question("/A/ASK", f"r{n}/operator/questions/q") for n in (1, 2))
    with pytest.raises(MissionError, match=r"one of \['r1/operator/questions/q', 'r2/op.*--state"):
        choose([one, other], "/A/ASK")
    assert choose([one, other], "r2/operator/questions/q") is other
    assert choose([one, other], "/r1/operator/questions/q") is one
    assert show([one, other, question("/B/ASK")], as_json=False) == 0
    shown = capsys.readouterr().out.splitlines()[::2]
    assert shown == [
        "/A/ASK (r1/operator/questions/q): Go on?",
        "/A/ASK (r2/operator/questions/q): Go on?",
        "/B/ASK: Go on?",
    ]
