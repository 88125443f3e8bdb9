"""Runs as rows of a list, and the list of what there is."""

from __future__ import annotations

import contextlib
import json
import os
import random
from dataclasses import asdict

import pytest

import smachpy
from smachpy import CBState, Concurrence, StateMachine, describe
from smachpy.durable.opening import open_store
from smachpy.events.recording import (
    RecordingError,
    header_line,
    read_recording,
    recording_lines,
)
from smachpy.exceptions import SmachError
from smachpy_viz.live import runs as runs_module
from smachpy_viz.live.journals import Journals
from smachpy_viz.live.machines import Machines
from smachpy_viz.live.runs import Runs
from smachpy_viz.runs.listing import MANY_PIECES, MAX_PIECES, run_row

S = 1_000_000_000
BEGAN = 1_700_000_000 * S


def chain(name="JOB"):
    sm = StateMachine(outcomes=["done", "aborted"], name=name)
    with sm:
        StateMachine.add("A", CBState(lambda _: "ok", outcomes=["ok"]), {"ok": "B"})
        StateMachine.add(
            "B", CBState(lambda _: "done", outcomes=["done", "aborted"]), {"done": "done"}
        )
    return describe(sm)


def told(*events, began=BEGAN):
    return [
        {"kind": kind, "path": path, "t": at, "stamp_ns": began + int(at * S), "seq": n, **facts}
        for n, (at, kind, path, facts) in enumerate(events, 1)
    ]


def failed(began=BEGAN, root="/JOB"):
    return told(
        (0.0, "Started", root, {}),
        (0.0, "Entered", f"{root}/A", {}),
        (2.0, "Left", f"{root}/A", {"outcome": "ok"}),
        (2.0, "Entered", f"{root}/B", {}),
        (3.0, "GoalSent", f"{root}/B", {"action": "/robot_1/go", "goal_id": "1", "goal": None}),
        (4.0, "GoalDone", f"{root}/B", {"action": "/robot_1/go", "goal_id": "1", "status": "ABORTED",
                                        "text": "no way", "result": None}),
        (5.0, "Left", f"{root}/B", {"outcome": "aborted"}),
        (5.0, "Finished", root, {"outcome": "aborted"}),
        began=began,
    )  # fmt: skip


def test_a_run_that_failed_has_its_first_cause():
    row = run_row(chain(), failed())
    assert (row["machine"], row["outcome"], row["robots"]) == ("JOB", "aborted", ["robot_1"])
    assert (row["began"], row["ended"]) == (BEGAN, BEGAN + 5 * S)
    assert "no way" in row["reason"]
    assert row["strip"] == [(0, "A", 0.0, 2.0, "success"), (0, "B", 2.0, 5.0, "failure")]


def test_a_run_that_goes_on_says_where_it_is():
    row = run_row(chain(), failed()[:4])
    assert (row["outcome"], row["ended"], row["reason"]) == (None, None, "B")
    assert row["strip"][-1] == (0, "B", 2.0, None, "active")


def test_a_run_that_goes_on_says_what_its_state_notes():
    noted = (4.0, "Noted", "/JOB/B", {"text": "aisle 7"})
    row = run_row(chain(), [*failed()[:4], *told(noted)])
    assert row["reason"] == "B: aisle 7"


@pytest.mark.parametrize("asking", ["/JOB/B", "/JOB/B/CONFIRM"])
def test_a_run_that_asks_a_person_waits_in_its_strip(asking):
    asked = (3.0, "QuestionAsked", asking, {"text": "may I?"})
    answered = (4.0, "QuestionAnswered", asking, {"answer": "yes", "by": "ann"})
    row = run_row(chain(), [*failed()[:4], *told(asked)])
    assert row["strip"] == [(0, "A", 0.0, 2.0, "success"), (0, "B", 2.0, None, "waiting")]
    row = run_row(chain(), [*failed()[:4], *told(asked, answered)])
    assert row["strip"][-1] == (0, "B", 2.0, None, "active")


def test_only_the_newest_run_counts_and_none_is_no_run():
    events = [*failed(), *failed(began=BEGAN + 100 * S)[:2]]
    row = run_row(chain(), events)
    assert (row["began"], len(row["strip"])) == (BEGAN + 100 * S, 1)
    assert run_row(chain(), []) == {
        "machine": "JOB", "robots": [], "began": None, "ended": None, "last": None,
        "outcome": None, "reason": "", "strip": [], "outages": [],
    }  # fmt: skip


def test_a_concurrence_has_a_row_for_each_region():
    sm = Concurrence(outcomes=["done"], default_outcome="done", name="BOTH")
    with sm:
        Concurrence.add("L", CBState(lambda _: "done", outcomes=["done"]))
        Concurrence.add("R", CBState(lambda _: "done", outcomes=["done"]))
    row = run_row(
        describe(sm),
        told(
            (0.0, "Started", "/BOTH", {}),
            (0.0, "Entered", "/BOTH/R", {}),
            (0.0, "Entered", "/BOTH/L", {}),
            (1.0, "Left", "/BOTH/R", {"outcome": "done"}),
        ),
    )
    assert row["strip"] == [(1, "R", 0.0, 1.0, "success"), (0, "L", 0.0, None, "active")]


def test_a_long_run_has_a_strip_of_its_longest_states():
    events = [(0.0, "Started", "/JOB", {})]
    for n in range(500):
        events += [
            (n, "Entered", "/JOB/A", {}),
            (n + (n % 7) / 7, "Left", "/JOB/A", {"outcome": "ok"}),
        ]
    row = run_row(chain(), told(*events))
    assert len(row["strip"]) == MAX_PIECES
    assert all(to - since > 0.7 for _, _, since, to, _ in row["strip"])
    assert [piece[2] for piece in row["strip"]] == sorted(piece[2] for piece in row["strip"])


def test_what_is_cut_off_anywhere_is_a_row():
    events = failed()
    for first in range(len(events)):
        row = run_row(chain(), events[first:])
        assert row["machine"] == "JOB"


def random_events(seed, count):
    """Events of several runs of a concurrence, some of which are resumed."""
    choose = random.Random(seed)
    root, since, number, events = "/BOTH", {}, 0, []

    def add(kind, path, **facts):
        at = BEGAN + len(events) * S // 3
        events.append({"kind": kind, "path": path, "stamp_ns": at, "seq": len(events) + 1, **facts})

    add("Started", root)
    while len(events) < count:
        path = f"{root}/{choose.choice('LR')}"
        kind = choose.choice(["visit"] * 8 + ["goal", "goal", "restart", "resume"])
        if kind == "visit" and path in since:
            del since[path]
            add("Left", path, outcome=choose.choice(["done", "aborted"]))
        elif kind == "visit":
            since[path] = BEGAN + len(events) * S // 3
            add("Entered", path)
        elif kind == "goal":
            number += 1
            robot = choose.choice(["r1", "r2"])
            add("GoalSent", path, action=f"/{robot}/go", goal_id=str(number), goal=None)
        elif kind == "restart":
            since.clear()
            add("Finished", root, outcome=choose.choice(["done", "aborted", None]))
            add("Started", root)
        else:
            kept = {one: at for one, at in since.items() if choose.random() < 0.7}
            for one in since.keys() - kept.keys():
                add("Left", one, outcome="preempted")
            since = kept
            active = [[root, BEGAN], *([one, at] for one, at in kept.items())]
            at = BEGAN + len(events) * S // 3
            add("Recovered", root, active=active, outages=[[at - S, at]])
    return events


@pytest.mark.parametrize("seed", range(8))
def test_the_row_of_a_live_run_is_that_of_all_its_events(seed):
    sm = Concurrence(outcomes=["done", "aborted"], default_outcome="done", name="BOTH")
    with sm:
        Concurrence.add("L", CBState(lambda _: "done", outcomes=["done", "aborted"]))
        Concurrence.add("R", CBState(lambda _: "done", outcomes=["done", "aborted"]))
    record, events = describe(sm), random_events(seed, 600)
    machine = Machines().obtain("both")
    history = {"epoch": "e", "description": record, "base": None, "events": events[:1]}
    machine.reset(history)
    for count, event in enumerate(events[1:], 2):
        assert machine.add([event])
        if count % 7 == 0:
            assert machine.row() == run_row(record, events[:count])
    assert machine.row() == run_row(record, events)
    assert len(machine._row._pieces) <= MANY_PIECES


def test_the_cost_of_a_live_row_does_not_grow_with_the_run(monkeypatch):
    """A list of 1,000 machines took as long as all of their events: 2.8 s for 1,000 each."""
    machine = Machines().obtain("job")
    history = {"epoch": "e", "description": chain(), "base": None, "events": failed()[:1]}
    machine.reset(history)
    machine.add(failed()[1:4])
    monkeypatch.setattr(machine._events, "records", lambda: pytest.fail("all events were read"))
    assert machine.row()["reason"] == "B"


def write(path, events, record=None):
    path.write_text("".join(recording_lines(record or chain(), events, None)), encoding="utf-8")


@pytest.fixture
def folder(tmp_path):
    write(tmp_path / "one.jsonl", failed())
    write(tmp_path / "two.jsonl", failed(began=BEGAN + 9 * S))
    (tmp_path / "bad.jsonl").write_text("no run\n", encoding="utf-8")
    return tmp_path


def test_files_and_machines_are_listed_newest_first(folder):
    machines = Machines()
    live = machines.obtain("live")
    history = {"epoch": "x", "description": asdict(chain("LIVE"))}
    live.reset({**history, "events": failed(BEGAN + 5 * S, "/LIVE")[:4]})
    runs = Runs(machines, [folder, folder, folder / "none"])
    rows = runs.rows()["runs"]
    assert [(one["id"].rpartition("/")[2], one["live"]) for one in rows] == [
        ("machine live", True),
        ("two.jsonl", False),
        ("one.jsonl", False),
        ("bad.jsonl", False),
    ]
    assert "no header" in rows[-1]["problem"]
    live.set_stale(BEGAN)
    assert not next(one for one in runs.rows()["runs"] if one["name"] == "live")["live"]


def test_a_file_that_is_being_written_is_no_second_run(folder):
    machines = Machines()
    history = {"epoch": "x", "description": asdict(chain())}
    machines.obtain("job").reset({**history, "events": failed(BEGAN + 1000)[:4]})
    ids = [one["id"] for one in Runs(machines, [folder]).rows()["runs"]]
    assert not [one for one in ids if "one.jsonl" in one]
    assert len(ids) == 3


def test_a_file_is_read_again_only_when_it_has_changed(folder, monkeypatch):
    read = []
    real = runs_module.read_recording
    monkeypatch.setattr(
        runs_module,
        "read_recording",
        lambda path, **how: (read.append(path.name), real(path, **how))[1],
    )
    runs = Runs(Machines(), [folder])
    runs.rows()
    runs.rows()
    assert sorted(read) == ["bad.jsonl", "one.jsonl", "two.jsonl"]
    write(folder / "one.jsonl", failed()[:3])
    os.utime(folder / "one.jsonl", ns=(1, 1))
    (row,) = [one for one in runs.rows()["runs"] if one["file"].endswith("one.jsonl")]
    assert row["outcome"] is None


def test_a_long_recording_that_is_being_written_is_not_read_at_each_look(folder, monkeypatch):
    monkeypatch.setattr(runs_module, "LONG", 10)
    monkeypatch.setattr(runs_module, "REST", 1e9)
    path = folder / "one.jsonl"
    write(path, failed()[:3])
    runs = Runs(Machines(), [folder])

    def reason():
        return next(one["reason"] for one in runs.rows()["runs"] if one["file"] == str(path))

    assert reason() == ""
    write(path, failed()[:4])
    assert reason() == ""  # as it was
    with path.open("a", encoding="utf-8") as file:
        file.write('{"kind": "End", "path": "/JOB", "stamp_ns": 1, "events": 4, "missing": 0, ')
        file.write('"first_ns": 1, "outcome": null, "outages": []}\n')
    assert reason() == "B"


def test_of_a_huge_recording_the_list_reads_two_lines_and_the_page_the_newest(folder, monkeypatch):
    monkeypatch.setattr(runs_module, "LARGEST", 10)
    monkeypatch.setattr(runs_module, "MOST_EVENTS", 2)
    machines = Machines()
    runs = Runs(machines, [folder])
    rows = {one["file"].rpartition("/")[2]: one for one in runs.rows()["runs"]}
    assert "no header" in rows["bad.jsonl"]["problem"]
    row = rows["one.jsonl"]
    whole = run_row(chain(), failed())
    assert {one: row[one] for one in whole} == {**whole, "robots": [], "reason": "", "strip": []}
    assert row["problem"] == ""
    machine = machines.get(runs.open(row["id"]))
    assert machine.events() == failed()[-2:]
    assert json.loads(machine.snapshot()[1])["base"]["states"]["/JOB/A"]["visits"] == 1


def test_the_list_does_not_wait_for_a_recording_that_is_being_opened(folder, monkeypatch):
    real = runs_module.read_for_page
    machines = Machines()
    runs = Runs(machines, [folder])

    def look(path):
        assert not runs._lock.locked()
        assert machines.summaries() == []
        return real(path)

    monkeypatch.setattr(runs_module, "read_for_page", look)
    machine = machines.get(runs.open(f"file {folder / 'one.jsonl'}"))
    assert machines.changed_since(0)[1] == [machine.summary()]


def test_what_is_listed_can_be_opened_and_nothing_else(folder, tmp_path_factory, monkeypatch):
    monkeypatch.setattr(runs_module, "MAX_OPEN_RECORDINGS", 1)
    machines = Machines()
    runs = Runs(machines, [folder])
    name = runs.open(f"file {folder / 'one.jsonl'}")
    machine = machines.get(name)
    assert machine.recorded
    assert machine.summary()["outcome"] == "aborted"
    assert runs.open(f"file {folder / 'one.jsonl'}") == name
    assert runs.open(f"machine {name}") == name
    assert len(runs.rows()["runs"]) == 3  # an opened file is one run
    runs.open(f"file {folder / 'two.jsonl'}")
    assert machines.get(name) is None
    other = tmp_path_factory.mktemp("other") / "secret.jsonl"
    write(other, failed())
    for run in (f"file {other}", f"file {folder}/../x.jsonl", "file /etc/passwd", "machine none", "", "file",
                f"file {folder / 'bad.jsonl'}"):  # fmt: skip
        with pytest.raises(RecordingError):
            runs.open(run)


def test_a_run_in_virtual_time_has_its_real_date_and_is_one_row_with_its_file(tmp_path):
    path = tmp_path / "virtual.jsonl"
    lines = list(recording_lines(chain(), failed(began=S), None))
    made = BEGAN + 5 * S
    path.write_text(header_line(chain(), S, made_ns=made) + "".join(lines[1:]), encoding="utf-8")
    runs = Runs(Machines(), [tmp_path])
    [row] = runs.rows()["runs"]
    assert (row["began"], row["stamp"]) == (made, S)
    assert row["ended"] - row["began"] == row["last"] - made
    machines = Machines()
    machine = machines.obtain("one")
    machine.reset(
        {"epoch": "x", "description": asdict(chain()), "base": None, "events": failed(began=S)}
    )
    machine.behind = BEGAN
    [row] = Runs(machines, [tmp_path]).rows()["runs"]
    assert (row["began"], row["stamp"]) == (BEGAN + S, S)


def test_runs_in_virtual_time_which_all_begin_at_one_instant_are_told_apart(tmp_path):
    def virtual(path, made, events):
        lines = list(recording_lines(chain(), events, None))
        text = header_line(chain(), S, made_ns=BEGAN + made * S) + "".join(lines[1:])
        path.write_text(text, encoding="utf-8")
        os.utime(path, ns=(BEGAN + made * S, BEGAN + made * S))

    def begin(epoch):
        history = {"epoch": epoch, "description": chain(), "events": failed(began=S)}
        machines.obtain("job").reset(history)

    virtual(tmp_path / "oldest.jsonl", 1, failed(began=S)[:3])
    virtual(tmp_path / "older.jsonl", 2, failed(began=S))
    machines = Machines()
    runs = Runs(machines, [tmp_path])
    begin("2")
    ids = {row["id"].rpartition("/")[2] for row in runs.rows()["runs"]}
    assert ids == {"machine job", "oldest.jsonl"}
    assert runs.file_of("job") == tmp_path / "older.jsonl"
    virtual(tmp_path / "newest.jsonl", 3, failed(began=S))
    begin("3")
    kept = machines.get("job").before
    assert runs.file_of("job") == tmp_path / "newest.jsonl"
    assert runs.file_of(kept) == tmp_path / "older.jsonl"
    ids = {row["id"].rpartition("/")[2] for row in runs.rows()["runs"]}
    assert ids == {"machine job", f"machine {kept}", "oldest.jsonl"}
    (tmp_path / "older.jsonl").unlink()
    (tmp_path / "oldest.jsonl").unlink()
    assert runs.file_of(kept) is None
    virtual(tmp_path / "oldest.jsonl", 1, failed(began=S)[:3])
    machines.obtain("by name").load(read_recording(tmp_path / "oldest.jsonl"))
    assert runs.file_of("by name") == tmp_path / "oldest.jsonl"
    ids = {row["id"].rpartition("/")[2] for row in runs.rows()["runs"]}
    assert ids == {"machine job", f"machine {kept}", "machine by name"}


def test_files_of_one_name_in_two_folders_are_two_machines(tmp_path):
    for name, events in (("one", failed()), ("two", failed()[:3])):
        (tmp_path / name).mkdir()
        write(tmp_path / name / "run.jsonl", events)
    machines = Machines()
    runs = Runs(machines, [tmp_path / "one", tmp_path / "two"])
    names = [runs.open(f"file {tmp_path / name / 'run.jsonl'}") for name in ("one", "two")]
    assert [machines.get(name).summary()["outcome"] for name in names] == ["aborted", None]
    other = tmp_path / "three"
    other.mkdir()
    write(other / "alone.jsonl", failed())
    runs = Runs(machines, [other])
    assert runs.open(f"file {other / 'alone.jsonl'}") == "run alone.jsonl"


def test_a_file_that_has_grown_since_it_was_opened_is_shown_with_all(folder):
    machines = Machines()
    runs = Runs(machines, [folder])
    write(folder / "one.jsonl", failed()[:3])
    name = runs.open(f"file {folder / 'one.jsonl'}")
    assert machines.get(name).summary()["outcome"] is None
    write(folder / "one.jsonl", failed())
    assert runs.open(f"file {folder / 'one.jsonl'}") == name
    assert machines.get(name).summary()["outcome"] == "aborted"
    with pytest.raises(RecordingError):
        runs.open(f"file {folder / 'bad.jsonl'}")
    assert machines.get("run bad.jsonl") is None


def test_a_fleet_of_a_thousand_is_sent_in_parts():
    machines = Machines()
    for number in range(1_000):
        history = {"epoch": f"{number}", "description": chain(), "base": None}
        machines.obtain(f"r{number:04}").reset({**history, "events": failed()[:4]})
    machines.get("r0003").add(failed()[4:])  # it has ended
    machines.get("r0005").set_stale(BEGAN)
    runs = Runs(machines)
    first = runs.fleet()
    assert (first["skip"], first["total"]) == (0, 998)
    names = [row["name"] for row in first["rows"]]
    assert names == [f"r{n:04}" for n in range(34) if n not in {3, 5}]
    assert next(row["name"] for row in runs.fleet(32)["rows"]) == "r0034"
    last = runs.fleet(10_000)
    assert (last["skip"], [row["name"] for row in last["rows"]]) == (997, ["r0999"])
    assert Runs(Machines()).fleet() == {"rows": [], "skip": 0, "total": 0}


def test_a_recording_that_is_open_and_pruned_stays_on_its_page(folder):
    machines = Machines()
    runs = Runs(machines, [folder])
    name = runs.open(f"file {folder / 'one.jsonl'}")
    (folder / "one.jsonl").unlink()
    listed = {row["file"] for row in runs.rows()["runs"]}
    assert listed == {str(folder / "bad.jsonl"), str(folder / "two.jsonl")}
    machine = machines.get(name)
    assert len(machine.since(0)) == len(failed())
    with pytest.raises(RecordingError, match="no such run"):
        runs.open(f"file {folder / 'one.jsonl'}")


def test_a_mission_that_is_listed_and_pruned_is_refused_by_name(tmp_path):
    place = str(tmp_path / "journal.db")
    machine = StateMachine(["done"], name="JOB")
    machine.add("A", CBState(lambda _: "done", outcomes=["done"]))
    with contextlib.closing(open_store(place)) as store:
        smachpy.run_durable(machine, store, mission="gone")
        smachpy.run_durable(machine, store, mission="left")
        with contextlib.closing(Journals([place])) as journals:
            assert {row["mission"]["id"] for row in journals.rows()} == {"gone", "left"}
            store.forget("gone")
            with pytest.raises(SmachError, match="gone"):
                journals.command(place, "gone", "resume")
            assert {row["mission"]["id"] for row in journals.rows()} == {"left"}
            assert {mission for _, mission in journals._known} == {"left"}
