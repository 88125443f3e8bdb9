"""Two versions of a machine, and numbers of many runs, in one drawing."""

from __future__ import annotations

from dataclasses import replace
from html import unescape

import pytest

from smachpy import CBState, StateMachine
from smachpy.command import main
from smachpy.events.introspection import RuleRecord, StateRecord, TransitionRecord
from smachpy.events.recording import Recorder
from smachpy_viz.pictures.drawing import draw, picture
from smachpy_viz.runs.compare import ComparedRun, drawing, unite
from smachpy_viz.runs.statistics import StateStatistics, Statistics, marks_of


def leaf(label, outcomes=("done",), **more):
    return StateRecord("", label, "state", "State", outcomes, **more)


def machine(label, children, edges, **more):
    """`edges` are (source, outcome, target)."""
    labels = {child.label for child in children}
    return StateRecord(
        "", label, "machine", "StateMachine", ("done",), children=tuple(children),
        initial=(children[0].label,),
        transitions=tuple(TransitionRecord(s, o, t, t not in labels) for s, o, t in edges), **more,
    )  # fmt: skip


def rooted(record, above=""):
    path = f"{above}/{record.label}"
    children = tuple(rooted(child, path) for child in record.children)
    return replace(record, path=path, children=children)


OLD = rooted(
    machine(
        "V1",
        [leaf("A"), leaf("B"), leaf("C"), machine("IN", [leaf("X")], [("X", "done", "done")])],
        [("A", "done", "B"), ("B", "done", "C"), ("C", "done", "IN"), ("IN", "done", "done")],
    )
)
NEW = rooted(
    machine(
        "V2",
        [
            leaf("A"),
            leaf("C", details=(("timeout", "5 s"),)),
            leaf("D"),
            machine("IN", [leaf("X"), leaf("B")], [("X", "done", "B"), ("B", "done", "done")]),
        ],
        [("A", "done", "C"), ("C", "done", "D"), ("D", "done", "IN"), ("IN", "done", "done")],
    )
)


def both(old=OLD, new=NEW, **more):
    return unite(
        ComparedRun("old", old, more.get("before")), ComparedRun("new", new, more.get("after"))
    )


def test_states_and_transitions_of_both_under_the_paths_of_the_second():
    union = both()
    assert [child.label for child in union.record.children] == ["A", "B", "C", "D", "IN"]
    assert union.states == {
        "/V2/B": "removed",
        "/V2/C": "changed",
        "/V2/D": "added",
        "/V2/IN/B": "added",
    }
    assert union.arrows["/V2/A", "done", "C"] == "added"
    assert union.arrows["/V2/A", "done", "B"] == "removed"
    assert ("/V2/IN", "done", "done") not in union.arrows
    assert union.reasons["/V2/C"] == ["timeout: none → 5 s"]


def test_a_state_that_is_elsewhere_now_says_where():
    union = both()
    assert union.reasons["/V2/B"] == ["moved to /V2/IN/B"]
    assert union.reasons["/V2/IN/B"] == ["moved from /V2/B"]


def test_the_drawing_marks_what_has_changed_and_splits_arrows():
    outcomes = ("x", "y")
    old = rooted(
        machine("M", [leaf("A", outcomes), leaf("B")], [("A", "x", "B"), ("B", "done", "done")])
    )
    new = rooted(
        machine(
            "M",
            [leaf("A", outcomes), leaf("B")],
            [("A", "x", "B"), ("A", "y", "B"), ("B", "done", "done")],
        )
    )
    node = both(old, new).node()
    found = {(e.source, e.outcomes): e.change for e in node.edges}
    assert found == {("A", ("x",)): "", ("A", ("y",)): "added", ("B", ("done",)): ""}


def test_rules_of_a_concurrence_are_compared_too():
    def watching(*rules):
        return rooted(
            StateRecord(
                "", "C", "concurrence", "Concurrence", ("done", "low"),
                children=(leaf("A"), leaf("B", ("low",))), initial=("A", "B"), rules=rules,
            )
        )  # fmt: skip

    done = RuleRecord("done", (("A", "done"),), "A:done")
    low = RuleRecord("low", (("B", "low"),), "B:low")
    node = both(watching(done), watching(done, low)).node()
    assert [(rule.outcome, rule.change) for rule in node.rules] == [("done", ""), ("low", "added")]


def test_a_machine_compared_with_itself_has_no_difference():
    assert both(OLD, OLD).listed() == []
    renamed = rooted(replace(OLD, label="OTHER"))
    assert both(OLD, renamed).listed() == []


def test_numbers_per_run_only_where_they_differ_notably():
    def runs(n, **states):
        statistics = Statistics(runs=n)
        for label, (visits, seconds) in states.items():
            statistics.states[f"/V1/{label}"] = StateStatistics(
                visits, [seconds] * visits, {"done": visits}
            )
        return statistics

    before = runs(1, A=(1, 1.0), B=(1, 1.0), C=(2, 1.0))
    after = runs(2, A=(2, 1.1), B=(4, 1.0), C=(4, 2.0))
    union = both(OLD, OLD, before=before, after=after)
    assert union.notes == {"/V1/B": "×1 → ×2", "/V1/C": "1 s → 2 s"}
    assert union.counts == {("/V1/B", "done"): "×1 → ×2"}


def test_a_difference_is_never_told_by_colour_alone():
    old, new = ComparedRun("old", OLD), ComparedRun("new", NEW)
    diagram = drawing(unite(old, new), old, new)
    text = draw(diagram, "dot").decode()
    for sign in ("+", "\u2212", "\u2260"):
        assert f"<b>{sign}</b>" in text
    assert "dotted" in text
    assert "dashed" in text
    assert [change for change, _ in diagram.legend] == ["", "added", "removed", "changed"]


def test_marks_of_many_runs_have_counts_shares_and_heat():
    statistics = Statistics(
        runs=4,
        states={
            "/V1/A": StateStatistics(4, [1.0] * 4, {"done": 3, "aborted": 1}),
            "/V1/B": StateStatistics(3, [4.0] * 3, {"done": 3}),
            "/V1/GONE": StateStatistics(1, [9.0], {"done": 1}),
        },
    )
    marks = marks_of(statistics, OLD)
    assert marks.heat == {"/V1/A": pytest.approx(1 / 3), "/V1/B": 1.0}
    assert marks.share("/V1/A", ["aborted"]) == 0.25
    assert marks.notes["/V1/A"] == "×4, 1 s, 25% failed"
    assert "/V1/GONE" not in marks.visits
    assert marks_of(statistics, OLD, heat="failures").heat["/V1/A"] == 0.25
    text = unescape(picture(OLD, "dot", run=marks).decode())
    assert "75%" in text
    assert 'fillcolor="#F5B56A"' in text.replace("'", '"')


def make_machine(extra):
    sm = StateMachine(outcomes=["done"], name="JOB")

    def add(label, after):
        StateMachine.add(label, CBState(lambda _: "done", outcomes=["done"]), {"done": after})

    with sm:
        add("FIRST", "MORE" if extra else "LAST")
        if extra:
            add("MORE", "LAST")
        add("LAST", "done")
    return sm


@pytest.fixture
def recorded(tmp_path, clock):
    def record(name, *, extra=False):
        sm = make_machine(extra)
        with Recorder(tmp_path / name, sm):
            sm.execute()
        return str(tmp_path / name)

    return record


def test_compare_in_words_and_as_a_picture(recorded, tmp_path, capsys):
    old, new = recorded("old.jsonl"), recorded("new.jsonl", extra=True)
    assert main(["runs", "compare", old, new]) == 0
    said = capsys.readouterr().out
    assert "+ /JOB/MORE  added" in said
    assert "- /JOB/FIRST  done → LAST" in said
    out = tmp_path / "both.dot"
    assert main(["runs", "compare", old, new, "-o", str(out)]) == 0
    assert "MORE" in out.read_text()
    assert main(["runs", "compare", old, new, "-o", str(tmp_path / "both.docx")]) == 2
    assert "expected one of svg" in capsys.readouterr().err


def test_machines_that_never_ran_can_be_compared(tmp_path, capsys):
    (tmp_path / "old.json").write_text(OLD.to_json())
    (tmp_path / "new.json").write_text(NEW.to_json())
    assert main(["runs", "compare", str(tmp_path / "old.json"), str(tmp_path / "new.json")]) == 0
    assert "- /V2/B  moved to /V2/IN/B" in capsys.readouterr().out


def test_render_with_recorded_runs(recorded, tmp_path, capsys):
    recorded("1.jsonl")
    recorded("2.jsonl")
    target = tmp_path / "job.json"
    from smachpy.events.introspection import describe

    target.write_text(describe(make_machine(extra=False)).to_json())
    out = tmp_path / "job.dot"
    assert main(["render", str(target), "-o", str(out), "--runs", str(tmp_path)]) == 0
    text = unescape(out.read_text())
    assert "2 runs" in text
    assert "×2" in text
    (tmp_path / "v1.json").write_text(OLD.to_json())
    other = [str(tmp_path / "v1.json"), "-o", str(out), "--runs", str(tmp_path)]
    assert main(["render", *other]) == 2
    assert "got runs of 'JOB'; expected some of 'V1'" in capsys.readouterr().err
