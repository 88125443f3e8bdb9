"""What was tried with a mission, and missions that are refused without it."""

from __future__ import annotations

import json
import os
import py_compile
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import pytest

from smachpy.command import main
from smachpy.command.evidence import library_facts, mission_facts
from smachpy.command.targets import TargetError, load_target

MISSION = """
import evidence_helper
from evidence_parts.first import part
from smachpy import CBState, StateMachine


def work(_userdata):
    return evidence_helper.OUTCOME


def mission(word: str = "x") -> StateMachine:
    sm = StateMachine(["done", "preempted"], name="GOOD")
    sm.add("WORK", CBState(work, outcomes=["done"]))
    return sm


def other():
    return mission()
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("good.py").write_text(MISSION)
    Path("evidence_helper.py").write_text('OUTCOME = "done"\n')
    Path("unused.py").write_text("")
    Path("evidence_parts").mkdir()
    Path("evidence_parts/__init__.py").write_text("")
    Path("evidence_parts/first.py").write_text("from .second import part\n")
    Path("evidence_parts/second.py").write_text("def part():\n    import evidence_late\n")
    Path("evidence_late.py").write_text("LIMIT = 3\n")
    return tmp_path


def hash_of(text):
    return mission_facts(load_target(text), text)["hash"]


def test_a_mission_of_more_files_than_are_hashed_is_refused(monkeypatch):
    monkeypatch.setattr("smachpy.command.evidence.MAX_FILES", 5)
    with pytest.raises(TargetError, match="got more than 5 files; expected fewer"):
        hash_of("good.py")


def test_compiled_modules_are_in_the_hash():
    Path("evidence_late.py").unlink()
    compiled = Path(f"evidence_late{EXTENSION_SUFFIXES[0]}")
    compiled.write_bytes(b"one")
    before = hash_of("good.py")
    compiled.write_bytes(b"two")
    assert hash_of("good.py") != before


def test_the_hash_is_of_all_that_the_mission_imports():
    facts = mission_facts(load_target("good.py"), "good.py")
    assert sorted(facts["files"]) == [
        "evidence_helper",
        "evidence_late",
        "evidence_parts",
        "evidence_parts.first",
        "evidence_parts.second",
        "good",
    ]
    assert hash_of("good.py") == facts["hash"] == hash_of(f"{Path.cwd()}/good.py:mission")
    assert hash_of("good.py:other") != facts["hash"]
    Path("unused.py").write_text("X = 1\n")
    assert hash_of("good.py") == facts["hash"]
    Path("evidence_late.py").write_text("LIMIT = 4\n")
    assert hash_of("good.py") != facts["hash"]


def test_a_mission_of_a_package_has_one_hash_by_its_file_and_by_its_module(folder, monkeypatch):
    monkeypatch.syspath_prepend(str(folder))
    Path("evidence_own").mkdir()
    Path("evidence_own/__init__.py").write_text("")
    Path("evidence_own/look.py").write_text(MISSION)
    by_file = hash_of("evidence_own/look.py")
    assert by_file == hash_of("evidence_own.look") == hash_of("evidence_own.look:mission")


def test_a_shipped_mission_and_a_mission_file_have_a_hash_of_their_own_files():
    shipped = mission_facts(load_target("countdown"), "countdown")
    assert "smachpy_missions.course.countdown" in shipped["files"]
    assert not any(name.startswith(("smachpy.", "actionlib_core")) for name in shipped["files"])
    text = "name: M\nstates:\n  WAIT: {wait: 1.0}\n"
    Path("files").mkdir()
    for name in ("one", "two"):
        Path(f"files/{name}.yaml").write_text(text)
    one, two = hash_of("files/one.yaml"), hash_of("files/two.yaml")
    assert one != two
    Path("files/two.yaml").write_text(text.replace("1.0", "2.0"))
    assert hash_of("files/one.yaml") != one  # it may use the other one


def test_a_linked_mission_runs_what_is_in_its_hash():
    Path("elsewhere").mkdir()
    Path("elsewhere/good.py").symlink_to("../good.py")
    Path("elsewhere/evidence_helper.py").write_text('OUTCOME = "other"\n')
    target = load_target("elsewhere/good.py")
    assert mission_facts(target, "elsewhere/good.py")["hash"] == hash_of("good.py")
    assert target.build().execute() == "done"


def test_a_linked_mission_file_has_the_hash_of_the_folder_where_it_is_read():
    for name, limit in (("files", 1.0), ("linked", 2.0)):
        Path(name).mkdir()
        Path(f"{name}/helper.py").write_text(f"LIMIT = {limit}\n")
    Path("files/one.yaml").write_text("name: M\nstates:\n  WAIT: {wait: 1.0}\n")
    Path("linked/one.yaml").symlink_to("../files/one.yaml")
    assert hash_of("linked/one.yaml") != hash_of("files/one.yaml")
    Path("linked/helper.py").write_text("LIMIT = 1.0\n")
    assert hash_of("linked/one.yaml") == hash_of("files/one.yaml")
    Path("files/.#one.yaml").symlink_to("somebody@nowhere.17:1")  # the lock of an editor
    assert hash_of("linked/one.yaml") == hash_of("files/one.yaml")


def test_a_mission_file_has_the_hash_of_what_its_modules_import(folder, monkeypatch):
    monkeypatch.syspath_prepend(str(folder))
    Path("files/pkg").mkdir(parents=True)
    Path("files/one.yaml").write_text("name: M\nstates:\n  WAIT: {wait: 1.0}\n")
    Path("files/pkg/__init__.py").write_text("from .states import work\n")
    Path("files/pkg/states.py").write_text("def work():\n    import evidence_late\n")
    Path("files/old.py").write_text("print 'of Python 2'\n")
    facts = mission_facts(load_target("files/one.yaml"), "files/one.yaml")
    names = ["evidence_late", "old.py", "one.yaml", "pkg/__init__.py", "pkg/states.py"]
    assert sorted(facts["files"]) == names
    Path("evidence_late.py").write_text("LIMIT = 4\n")
    assert hash_of("files/one.yaml") != facts["hash"]


def test_a_late_import_of_what_cannot_be_read_is_in_the_hash():
    Path("evidence_late.py").write_text("LIMIT = \n")
    assert "evidence_late" in mission_facts(load_target("good.py"), "good.py")["files"]


def test_a_file_with_the_bytecode_of_another_one_has_no_hash():
    """Of one of the same second and length: Python would run that."""
    file = Path("evidence_helper.py")
    good, time = file.read_text(), file.stat().st_mtime_ns
    py_compile.compile(str(file))
    before = hash_of("good.py")
    file.write_text(good.replace("done", "DONE"))
    os.utime(file, ns=(time, time))
    py_compile.compile(str(file))
    file.write_text(good)
    os.utime(file, ns=(time, time))
    with pytest.raises(TargetError, match="has the bytecode of another file of the same second"):
        hash_of("good.py")
    assert hash_of("good.py") == before


def test_what_is_no_file_among_the_evidence_is_not_opened(capsys):
    Path("all").mkdir()
    Path("all/0.json").mkdir()
    os.mkfifo("all/1.json")
    Path("all/2.json").write_text(evidence())
    assert noted(capsys, "--require-evidence", "all")[0].startswith("valid, all/2.json; hash ")


def evidence(**facts):
    mission = mission_facts(load_target("good.py"), "good.py")
    made = {"format": "smachpy-evidence", "version": 1, "ok": True, "mission": mission}
    taken = {"explored": ["/GOOD/WORK -done->"], "simulated": [], "recorded": []}
    return json.dumps({**made, "library": library_facts(), "taken": taken, **facts})


REFUSED = [
    (lambda: evidence(ok=False), "e.json, which has found problems"),
    (lambda: evidence(library={"hash": "x"}), "e.json, of another version of smachpy"),
    (lambda: evidence(mission={"hash": "x"}), "none of this mission"),
    (lambda: evidence(mission=5), "$.mission: got 5; expected an object"),
    (lambda: evidence(ok="yes"), "$.ok: got 'yes'"),
    (lambda: evidence(version=2), "$.version: got 2"),
    (lambda: evidence(taken={"explored": []}), "$.taken: "),
    (lambda: evidence(taken=[]), "$.taken: got a list of 0"),
    (lambda: evidence()[:-9], "it is no JSON"),
    (lambda: "", "it is no JSON"),
    (lambda: None, "No such file"),
]


@pytest.mark.parametrize(("text", "said"), REFUSED, ids=[said for _, said in REFUSED])
def test_a_mission_without_good_evidence_is_refused(text, said, capsys):
    if (content := text()) is not None:
        Path("e.json").write_text(content)
    assert main(["run", "good.py", "--plain", "--require-evidence", "e.json"]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert "Traceback" not in err


def test_a_mission_with_evidence_runs_until_it_is_changed(folder, capsys):
    Path("all").mkdir()
    Path("all/e.json").write_text(evidence())
    run = ["run", "good.py", "--plain", "--require-evidence", "all"]
    assert main(run) == 0
    Path("evidence_parts/second.py").write_text("def part():\n    return 7\n")
    assert main(run) == 2
    assert "evidence: got none that is good (none of this mission; hash " in capsys.readouterr().err


def noted(capsys, *words, code=0):
    """The notes of a run about its evidence, as the terminal has them."""
    assert main(["run", "good.py", "--plain", *words]) == code
    lines = capsys.readouterr().out.splitlines()
    return [line.partition("evidence: ")[2] for line in lines if "evidence: " in line]


def test_one_good_file_is_enough_beside_others(capsys):
    Path("all").mkdir()
    for number, text in enumerate(
        [evidence(ok=False), "{", evidence(), evidence(library={"hash": "x"})]
    ):
        Path(f"all/{number}.json").write_text(text)
    assert noted(capsys, "--require-evidence", "all")[0].startswith("valid, all/2.json; hash ")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (evidence, "valid, e.json; hash "),
        (lambda: evidence(ok=False), "e.json, which has found problems; hash "),
        (lambda: evidence(library={"hash": "x"}), "e.json, of another version of smachpy; hash "),
        (lambda: evidence(mission={"hash": "x"}), "none of this mission; hash "),
        (lambda: "{", "a file that cannot be read: "),
    ],
)
def test_a_run_says_what_evidence_there_is(text, said, capsys):
    Path("e.json").write_text(text())
    (line,) = noted(capsys, "--evidence", "e.json", "--record", "r.jsonl")
    assert line.startswith(said)
    recorded = [json.loads(one) for one in Path("r.jsonl").read_text().splitlines()]
    assert [e["text"] for e in recorded if e.get("kind") == "Noted"] == [f"evidence: {line}"]
    assert noted(capsys) == []


def test_a_run_says_once_what_nobody_has_tried(capsys):
    """In the order of the events, also for those who listen later."""
    text = MISSION.replace(
        'sm.add("WORK", CBState(work, outcomes=["done"]))',
        'sm.add("WORK", CBState(work, outcomes=["done"]), {"done": "AGAIN"})\n'
        '    sm.add("AGAIN", CBState(twice, outcomes=["done", "again"]), {"again": "WORK"})',
    )
    text += "\nTIMES = []\n\n\ndef twice(_userdata):\n    TIMES.append(1)\n"
    text += '    return "again" if len(TIMES) % 3 else "done"\n'
    Path("good.py").write_text(text)
    taken = {
        "explored": ["/GOOD/WORK -done->"],
        "simulated": [],
        "recorded": ["/GOOD/AGAIN -done->"],
    }
    Path("e.json").write_text(evidence(taken=taken))
    lines = noted(capsys, "--evidence", "e.json", "--record", "r.jsonl")
    assert lines[1:] == ["nothing that was tried has taken /GOOD/AGAIN -again->"]
    events = [json.loads(one) for one in Path("r.jsonl").read_text().splitlines()]
    kinds = [(e["kind"], e["path"]) for e in events if "kind" in e]
    assert kinds[:3] == [("Started", "/GOOD"), ("Entered", "/GOOD/WORK"), ("Noted", "/GOOD")]
    assert kinds[kinds.index(("Noted", "/GOOD"), 3) - 1] == ("Left", "/GOOD/AGAIN")
    assert main(["runs", "reproduce", "r.jsonl", "--allow", "good.py"]) == 0  # without the notes


def test_scripts_of_ros1_have_no_evidence(capsys):
    Path("e.json").write_text(evidence())
    for option in ("--evidence", "--require-evidence"):
        assert main(["run", "--ros1", "good.py", option, "e.json"]) == 2
        assert "got --ros1 beside it" in capsys.readouterr().err


@pytest.mark.parametrize("there", [True, False])
def test_recordings_that_are_not_there_are_told_before_the_work(there, capsys):
    if there:
        Path("none").mkdir()
    assert main(["certify", "later.py", "--recordings", "none", "-o", "e.json"]) == 2
    err = capsys.readouterr().err
    assert ("got none; expected *.jsonl" if there else "no such file or folder") in err


@pytest.mark.slow
def test_what_is_certified_is_run_by_runners_and_nothing_else(folder, capfd):
    certify = ["certify", "good.py", "--runs", "3", "--input", "word=y", "--jobs", "1"]
    properties = ["--property", "always_reaches(done)", "--property", "never(WORK)"]
    assert main(["run", "good.py", "--plain", "--record", "runs.jsonl"]) == 0
    recordings = ["--recordings", "runs.jsonl"]
    assert main([*certify, *properties, "-o", "bad.json"]) == 1
    assert main([*certify, *properties[:2], *recordings, "--faults", "raise", "-o", "e.json"]) == 1
    assert main([*certify, *properties[:2], *recordings, "-o", "good.json"]) == 0
    bad, good = (json.loads(Path(name).read_text()) for name in ("bad.json", "good.json"))
    assert (bad["ok"], bad["check"]["ok"], good["ok"]) == (False, False, True)
    assert good["check"]["properties"] == ["always_reaches(done)"]
    assert good["explore"]["exhaustive"]
    assert good["explore"]["doubles"] == ["/GOOD/WORK"]
    assert good["explore"]["coverage"]["states"] == [2, 2]
    assert good["simulate"]["outcomes"] == {"done": 3}
    assert [one["result"] for one in good["reproduce"]["recordings"]] == ["same"]
    assert good["taken"] == {
        "explored": ["/GOOD/WORK -done->"],
        "simulated": ["/GOOD/WORK -done->"],
        "recorded": ["/GOOD/WORK -done->"],
    }
    assert good["inputs"] == {"word": "y"}
    assert main([*certify, "-o", "good.json"]) == 2  # it is there
    assert main(["submit", "good.py", "--db", "j.db", "--mission", "one"]) == 0
    runner = ["runner", "--db", "j.db", "--allow", ".", "--until-empty", "--require-evidence"]
    assert main([*runner, "bad.json"]) == 2
    assert "bad.json, which has found problems" in capfd.readouterr().err
    assert main([*runner, "good.json"]) == 0
    assert "mission one: ended: done" in capfd.readouterr().out
