"""Machines as nets: exported, read back and run, they do what the machine did."""

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.clock import VirtualClock, use_clock
from smachpy import CBState, Concurrence, InvalidStateError, State, StateMachine
from smachpy.command import main
from smachpy.outcome_classes import is_good
from smachpy.pnp import (
    PetriNetPlan,
    check_plan,
    explore,
    export_net,
    parse_pnml,
    pnml_text,
    understand,
)

OUTCOMES = ("succeeded", "aborted", "again")


class Scripted(State):
    """Ends as the script says; takes a time of its own, so that two never end at once."""

    def __init__(self, path, script, log):
        super().__init__(OUTCOMES)
        self.path, self.script, self.log = path, script, log

    def execute(self, ud):
        visit = sum(1 for path, _ in self.log if path == self.path)
        outcome = self.script[(visit + len(self.path)) % len(self.script)]
        self.log.append((self.path, outcome))
        self.sleep(1.0)
        return outcome


@st.composite
def machines(draw):
    """Draw a function that builds a machine: nested machines and concurrences, all edges forward
    or to an outcome, so that each run ends."""

    def shape(depth, path):
        kinds = ["leaf", "machine", "concurrence"] if depth < 2 else ["leaf"]
        kind = draw(st.sampled_from(kinds)) if depth else "machine"
        if kind == "leaf":
            return ("leaf", path)
        count = draw(st.integers(1, 3))
        children = [shape(depth + 1, f"{path}/S{n}") for n in range(count)]
        if kind == "machine":
            goes = []
            for n in range(count):
                targets = [f"S{m}" for m in range(n + 1, count)] + ["succeeded", "aborted"]
                goes.append([draw(st.sampled_from(targets)) for _ in OUTCOMES])
            return (kind, path, children, goes)
        wanted = [draw(st.sampled_from(OUTCOMES[:2])) for _ in range(count)]
        return (kind, path, children, wanted)

    return shape(0, "M"), draw(st.lists(st.sampled_from(OUTCOMES), min_size=1, max_size=5))


def outcomes_of(shape):
    return OUTCOMES if shape[0] == "leaf" else ("succeeded", "aborted")


def built(shape, script, log):
    kind, path, *rest = shape
    if kind == "leaf":
        return Scripted(path, script, log)
    children, how = rest
    if kind == "machine":
        made = StateMachine(["succeeded", "aborted"], name="M")
        with made.opened(check=False):
            for n, child in enumerate(children):
                goes = dict(zip(OUTCOMES, how[n], strict=True))
                own = {o: goes[o] for o in outcomes_of(child)}
                made.add(f"S{n}", built(child, script, log), own)
        return made
    rule = {f"S{n}": wanted for n, wanted in enumerate(how)}
    made = Concurrence(["succeeded", "aborted"], "aborted", outcome_map={"succeeded": rule})
    with made.opened(check=False):
        for n, child in enumerate(children):
            made.add(f"S{n}", built(child, script, log))
    return made


def check_reachable(machine):
    with contextlib.suppress(Exception):
        machine.check_consistency()
        return True
    return False


@given(machines())
def test_a_machine_and_its_net_do_the_same(drawn):
    shape, script = drawn
    log, log_of_net = [], []
    machine = built(shape, script, log)
    if not check_reachable(machine):
        return
    exported = export_net(machine)
    net, problems = parse_pnml(pnml_text(exported.net))
    assert problems == ()
    actions = {
        name: Scripted(path.lstrip("/"), script, log_of_net)
        for name, path in exported.states.items()
    }
    plan = PetriNetPlan(net, actions)
    with VirtualClock() as clock, use_clock(clock):
        outcome = machine.execute()
    with VirtualClock() as clock, use_clock(clock):
        assert plan.execute() == ("goal" if is_good(outcome) else "fail")
    # What begins at the same time has no order.
    assert sorted(log) == sorted(log_of_net)


def patrol():
    sm = StateMachine(["succeeded", "aborted"], name="P")
    with sm:
        sm.add(
            "GO",
            CBState(lambda ud: "ok", outcomes=["ok", "blocked"]),
            {"ok": "BOTH", "blocked": "aborted"},
        )
        both = Concurrence(["done"], "done")
        with both:
            both.add("A", CBState(lambda ud: "ok", outcomes=["ok"]))
            both.add("B", CBState(lambda ud: "ok", outcomes=["ok"]))
        sm.add("BOTH", both, {"done": "succeeded"})
    return sm


def test_names_are_the_labels_down_to_a_state():
    exported = export_net(patrol())
    assert exported.states == {"GO": "/P/GO", "BOTH_A": "/P/BOTH/A", "BOTH_B": "/P/BOTH/B"}
    assert [p.rule for p in check_plan(understand(exported.net)) if p.severity == "error"] == []


@pytest.mark.parametrize("dialect", ["pnp", "2009"])
def test_the_command(tmp_path, monkeypatch, capsys, dialect):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.py").write_text(
        "from smachpy import CBState, StateMachine\n"
        "sm = StateMachine(['done'], name='M')\n"
        "sm.add('A', CBState(lambda ud: 'ok', outcomes=['ok']), {'ok': 'done'})\n"
    )
    assert main(["export", "m.py", "--pnml", "m.pnml", "--dialect", dialect]) == 0
    assert main(["render", "m.pnml", "-o", "m.txt"]) == 0
    capsys.readouterr()
    assert main(["export", "m.py", "--pnml", "no/such/m.pnml"]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_what_cannot_be_written_is_told():
    sm = StateMachine(["succeeded"], name="P")
    con = Concurrence(["done"], "done", child_termination_cb=lambda ended: True)
    with con.opened(check=False):
        con.add("A", CBState(lambda ud: "ok", outcomes=["ok"]))
    with sm:
        sm.add("GO", CBState(lambda ud: "x", outcomes=["low battery"]), {"low battery": "BOTH"})
        sm.add("BOTH", con, {"done": "succeeded"})
    with pytest.raises(InvalidStateError) as caught:
        export_net(sm)
    assert len(caught.value.problems) == 2


def test_pm4py_finds_the_same_markings(tmp_path):
    pm4py = pytest.importorskip("pm4py")
    from pm4py.objects.petri_net.utils.reachability_graph import construct_reachability_graph

    from smachpy.pnp import write_pnml

    net = export_net(patrol()).net
    theirs, initial, _ = pm4py.read_pnml(str(write_pnml(net, tmp_path / "p.pnml", dialect="2009")))
    assert len(construct_reachability_graph(theirs, initial).states) == len(explore(net).came)
