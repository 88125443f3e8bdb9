"""Machines as nets: exported, read back and run, they do what the machine did."""

import contextlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actionlib_core.clock import VirtualClock, current_clock, use_clock
from smachpy import CBState, Concurrence, InvalidStateError, State, StateMachine, when
from smachpy.command import main
from smachpy.events.outcome_classes import is_good
from smachpy.pnp import (
    PetriNetPlan,
    check_plan,
    explore,
    export_net,
    parse_pnml,
    pnml_text,
    understand,
)
from smachpy_missions.patrol import patrol as shipped_patrol

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


class Timed(State):
    """Takes a time of its own, so that two never end at once; notes how it ended."""

    def __init__(self, path, seconds, outcome, log, listens=True):
        own = ["succeeded", "aborted"]
        super().__init__([*own, "preempted"] if listens else own, preempt_timeout=None)
        self.path, self.seconds, self.outcome, self.log = path, seconds, outcome, log
        self.listens = listens

    def execute(self, ud):
        if self.listens:
            outcome = "preempted" if self.sleep(self.seconds) else self.outcome
        else:
            current_clock().sleep(self.seconds)
            outcome = self.outcome
        self.log.append((self.path, outcome))
        return outcome


def aborts(ended):
    return [label for label in ended if label != "S0"] if "aborted" in ended.values() else None


ANSWERS = {
    "all": lambda ended: True,
    "none": lambda ended: False,
    "one": lambda ended: ["S0"],
    "when one aborts": aborts,
    "the last": lambda ended: [label for label in ended if ended[label] is None][-1:],
}
RESULTS = {
    "none": None,
    "any": lambda ended: "done" if "aborted" in ended.values() else None,
}


LEAVES = st.lists(
    st.tuples(st.integers(1, 9), st.sampled_from(["succeeded", "aborted"]), st.booleans()),
    min_size=1,
    max_size=2,
)


@pytest.mark.slow
@settings(max_examples=30)
@given(
    st.lists(
        st.tuples(LEAVES, st.sampled_from(["preempted", "aborted", "TIDY"]), st.booleans()),
        min_size=2,
        max_size=3,
    ),
    st.booleans(),
    st.sampled_from(sorted(ANSWERS)),
    st.sampled_from(sorted(RESULTS)),
)
def test_callbacks_that_decide_are_written_as_their_answers(branches, declared, answer, result):
    made = {}

    def leaf(path, *args):
        made[path] = args
        return Timed(path, *args[:2], log, *args[2:])

    def branch(number, leaves, end, nested):
        path = f"M/BOTH/S{number}"
        goes = {"aborted": "aborted", "succeeded": "succeeded", "preempted": end}
        outcomes = ["succeeded", "aborted", *(["preempted"] if declared else [])]
        if end == "preempted" and not declared:
            goes["preempted"] = "aborted"
        machine = StateMachine(outcomes)
        with machine.opened(check=False):
            for n, (seconds, outcome, listens) in enumerate(leaves):
                last = n == len(leaves) - 1
                own = {**goes, "succeeded": "succeeded" if last else f"L{n + 1}"}
                child = leaf(f"{path}/L{n}", seconds + number / 10, outcome, listens)
                if nested:
                    wrapped = StateMachine(["succeeded", "aborted"], name="IN")
                    child = leaf(f"{path}/L{n}/IN", seconds + number / 10, outcome, listens)
                    ends = {"succeeded": "succeeded", "aborted": "aborted"}
                    if listens:
                        ends["preempted"] = "aborted"
                    with wrapped.opened(check=False):
                        wrapped.add("IN", child, ends)
                    child = wrapped
                machine.add(f"L{n}", child, {o: own[o] for o in child.get_registered_outcomes()})
            if end == "TIDY":
                # It is asked again when the next child has stopped: at once in a net, later here.
                tidy = leaf(f"{path}/TIDY", 0.5 + number / 100, "succeeded", False)
                machine.add("TIDY", tidy, {"aborted": "aborted", "succeeded": "succeeded"})
        return machine

    log, log_of_net = [], []
    con = Concurrence(
        ["done", "aborted"],
        "aborted",
        outcome_map={"done": {"S0": "succeeded"}},
        child_termination_cb=ANSWERS[answer],
        outcome_cb=RESULTS[result],
    )
    with con.opened(check=False):
        for number, each in enumerate(branches):
            con.add(f"S{number}", branch(number, *each))
    root = StateMachine(["succeeded", "aborted"], name="M")
    with root.opened(check=False):
        root.add("BOTH", con, {"done": "succeeded", "aborted": "aborted"})
    if not check_reachable(root):
        return
    exported = export_net(root)
    net, _ = parse_pnml(pnml_text(exported.net))
    assert [p for p in check_plan(understand(net)) if p.rule in {"unbounded", "deadlock"}] == []
    actions = {}
    for name, path in exported.states.items():
        seconds, outcome, *listens = made[path.lstrip("/")]
        actions[name] = Timed(path.lstrip("/"), seconds, outcome, log_of_net, *listens)
    with VirtualClock() as clock, use_clock(clock):
        outcome = root.execute()
        ended = clock.now()
    with VirtualClock() as clock, use_clock(clock):
        assert PetriNetPlan(net, actions).execute() == ("goal" if is_good(outcome) else "fail")
        assert clock.now() == pytest.approx(ended)
    assert sorted(log) == sorted(log_of_net)


def test_the_shipped_patrol_is_a_net():
    net = export_net(shipped_patrol()).net
    assert [p for p in check_plan(understand(net)) if p.severity != "warning"] == []


def test_what_cannot_be_written_is_told():
    sm = StateMachine(["succeeded"], name="P")
    raises = Concurrence(["done"], "done", outcome_cb=lambda ended: ended["Z"])
    stops = Concurrence(["done"], "done", child_termination_cb=lambda ended: True)
    inner, middle = Concurrence(["done"], "done"), StateMachine(["ok"])
    deep = StateMachine(["ok"])
    for con in (raises, inner):
        with con.opened(check=False):
            con.add("A", CBState(lambda ud: "ok", outcomes=["ok"]))
    with deep.opened(check=False):
        deep.add(
            "ACT", CBState(lambda ud: "ok", outcomes=["ok", "preempted"]), {"preempted": "TIDY"}
        )
        deep.add("TIDY", CBState(lambda ud: "ok", outcomes=["ok"]))
    with middle.opened(check=False):
        middle.add("DEEP", deep)
    with stops.opened(check=False):
        stops.add("INNER", inner)
        stops.add("MIDDLE", middle)
    with sm:
        sm.add("GO", CBState(lambda ud: "x", outcomes=["low battery"]), {"low battery": "ONE"})
        sm.add("ONE", raises, {"done": "TWO"})
        sm.add("TWO", stops, {"done": "succeeded"})
    with pytest.raises(InvalidStateError) as caught:
        export_net(sm)
    paths = {problem.partition(": ")[0] for problem in caught.value.problems}
    assert paths == {"/P/GO", "/P/ONE", "/P/TWO/INNER", "/P/TWO/MIDDLE/DEEP/ACT"}


def test_conditions_and_clean_ups_are_refused():
    """A condition was left out, and its case taken always; a clean-up became another branch."""
    sm = StateMachine(["ok", "b"], name="P", userdata={"count": 0})
    both = Concurrence(["ok"], "ok")
    with both.opened(check=False):
        both.add("A", CBState(lambda ud: "ok", outcomes=["ok"]))
        both.add_cleanup("STOP", CBState(lambda ud: "ok", outcomes=["ok"]))
    with sm:
        sm.add("GO", CBState(lambda ud: "ok", outcomes=["ok"]), {"ok": [when("count", "b"), "TWO"]})
        sm.add("TWO", both)
        sm.add_cleanup("DOCK", CBState(lambda ud: "ok", outcomes=["ok"]))
    with pytest.raises(InvalidStateError) as caught:
        export_net(sm)
    assert [problem.partition("; ")[0] for problem in caught.value.problems] == [
        "/P: clean-up: got 'DOCK'",
        "/P: condition: got 'count'",
        "/P/TWO: clean-up: got 'STOP'",
    ]


@pytest.mark.slow  # pm4py takes seconds to import
@pytest.mark.filterwarnings("ignore:the Petri net has been imported without:UserWarning")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of what pm4py imports
def test_pm4py_finds_the_same_markings(tmp_path):
    pm4py = pytest.importorskip("pm4py")
    from pm4py.objects.petri_net.utils.reachability_graph import construct_reachability_graph

    from smachpy.pnp import write_pnml

    net = export_net(patrol()).net
    theirs, initial, _ = pm4py.read_pnml(str(write_pnml(net, tmp_path / "p.pnml", dialect="2009")))
    assert len(construct_reachability_graph(theirs, initial).states) == len(explore(net).came)
