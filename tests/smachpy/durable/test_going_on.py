"""What a mission that goes on does with states, goals, deadlines, changed machines and bad journals."""

from __future__ import annotations

import dataclasses
import json
import threading
from typing import TYPE_CHECKING, Any

import pytest

import smachpy
from actionlib_core.clock import VirtualClock, current_clock, use_clock
from actionlib_core.node import use_node
from smachpy import (
    Concurrence,
    Container,
    InvalidStateError,
    NotDurableError,
    State,
    StateMachine,
    events,
)
from smachpy.durable import recorder
from smachpy.durable.journal import read_position
from smachpy.durable.mission import MachineChangedError, OutageError
from smachpy.durable.position import VERSION, Position
from smachpy.durable.store import FencedError, StoreError
from smachpy.engine.interrupt import Interruption
from smachpy.engine.preempt import asking
from smachpy.exceptions import MissionError
from smachpy.pnp import PetriNetPlan
from smachpy.states.questions import AnswerRefusedError, find_questions, give_answer
from tests.smachpy.durable.killing_store import Kill, KillingStore
from tests.smachpy.pnp.nets import net_of
from tests.two_nodes import TwoNodes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from actionlib_core.clock import Task


class Doing(State):
    """Executes a function; kills its process when that says so."""

    def __init__(self, do: Callable[[State, Any], str], **options: Any) -> None:
        super().__init__(["ok", "skipped", "late"], io_keys=["value"], **options)
        self.do = do

    def execute(self, userdata: Any) -> str:
        return self.do(self, userdata)


def killed(*_: object) -> str:
    raise Kill


def fine(*_: object) -> str:
    return "ok"


def machine_of(*states: State, **options: Any) -> StateMachine:
    machine = StateMachine(["ok", "skipped", "late", "preempted"], name="M", **options)
    machine.userdata.value = 0
    with machine:
        for number, state in enumerate(states):
            following = f"S{number + 1}" if number + 1 < len(states) else "ok"
            machine.add(f"S{number}", state, {"ok": following})
    return machine


def kill(store: KillingStore, machine: StateMachine) -> None:
    """Run `machine` until it is killed."""
    with pytest.raises(Kill):
        smachpy.run_durable(machine, store, mission="m")


def go_on(store: KillingStore, machine: StateMachine, **options: Any) -> str:
    return smachpy.run_durable(machine, store, mission="m", **options)


@pytest.fixture
def store() -> KillingStore:
    return KillingStore()


# -- what a state says -------------------------------------------------------------------------


def test_a_state_that_is_to_be_skipped_ends_so(store: KillingStore) -> None:
    kill(store, machine_of(Doing(killed, resume="skip:skipped")))
    assert go_on(store, machine_of(Doing(killed, resume="skip:skipped"))) == "skipped"


def test_a_method_decides_and_one_that_returns_none_lets_it_run(store: KillingStore) -> None:
    class Deciding(Doing):
        answer: str | None = "late"

        def resume(self, userdata: Any) -> str | None:
            assert userdata.value == 0
            return self.answer

    kill(store, machine_of(Deciding(killed)))
    kill(store, machine_of(_with_answer(Deciding(killed), None)))
    assert go_on(store, machine_of(Deciding(killed))) == "late"


def _with_answer(state: Any, answer: str | None) -> Any:
    state.answer = answer
    return state


def test_on_resume_is_called_with_the_own_userdata_of_a_container(store: KillingStore) -> None:
    seen: list[Any] = []
    options: dict[str, Any] = {"on_resume": lambda userdata: seen.append(userdata.value)}

    def change(_: State, userdata: Any) -> str:
        userdata.value = 7
        return "ok"

    def build(do: Any) -> StateMachine:
        return machine_of(Doing(change, **options), Doing(do, **options), **options)

    kill(store, build(killed))
    assert go_on(store, build(fine)) == "ok"
    assert seen == [7, 7]  # of the root, and of the state that was active


# -- states that raise, with a clean-up --------------------------------------------------------


def in_machine(work: State, tidy: State) -> Container:
    machine = machine_of(Doing(fine), work)
    machine.add_cleanup("TIDY", tidy)
    return machine


def in_machine_below(work: State, tidy: State) -> Container:
    """Both machines have a clean-up."""
    machine = machine_of(in_machine(work, tidy))
    machine.add_cleanup("TIDY", Doing(fine))
    return machine


def in_concurrence(work: State, tidy: State) -> Container:
    cc = Concurrence(
        ["ok", "skipped", "late"], "late", input_keys=["value"], output_keys=["value"],
        outcome_map={"ok": {"WORK": "ok", "OTHER": "ok"}}, name="M",
    )  # fmt: skip
    cc.userdata.value = 0
    with cc:
        cc.add("WORK", work)
        cc.add("OTHER", Doing(fine))
    cc.add_cleanup("TIDY", tidy)
    return cc


def in_iterator(work: State, tidy: State) -> Container:
    outcomes, keys = ["ok", "skipped", "late"], ["value"]
    it = smachpy.Iterator(outcomes, keys, keys, range(3), "item", "ok", name="M")
    it.userdata.value = 0
    it.set_contained_state("WORK", work, loop_outcomes=["ok"])
    it.add_cleanup("TIDY", tidy)
    return it


def in_plan(work: State, tidy: State) -> Container:
    net = net_of("init* -> WORK.exec : WORK.start\nWORK.exec -> goal : WORK.end")
    plan = PetriNetPlan(net, {"WORK": work}, name="M")
    plan.userdata.value = 0
    plan.add_cleanup("TIDY", tidy)
    return plan


@pytest.mark.parametrize(
    "make", [in_machine, in_machine_below, in_concurrence, in_iterator, in_plan]
)
@pytest.mark.parametrize("tidies", [True, False], ids=["", "clean-up raises"])
def test_one_that_raised_goes_on_once_it_is_repaired_although_a_clean_up_ran(
    store: KillingStore, make: Callable[[State, State], Container], tidies: bool
) -> None:
    done: list[object] = []

    def work(*_: object) -> str:
        done.append(smachpy.once("first", lambda: done.append("once") or len(done)))
        if done.count("tidied") < 2:
            raise OSError("broken")
        done.append("worked")
        return "ok"

    def tidy(*_: object) -> str:
        done.append("tidied")
        if not tidies:
            raise OSError("no dock")
        return "ok"

    for _ in range(2):
        with pytest.raises(smachpy.InvalidUserCodeError, match="broken"):
            go_on(store, make(Doing(work), Doing(tidy)))
        assert store.rows["m"].status == "interrupted"
    assert go_on(store, make(Doing(work), Doing(tidy))) == ("goal" if make is in_plan else "ok")
    items = 3 if make is in_iterator else 1
    assert done.count("worked") == items
    assert done[:6] == ["once", 1, "tidied", 1, "tidied", 1]
    assert done.count("tidied") == 3
    assert done.count("once") == items


def test_one_that_raised_is_not_executed_before_the_clean_up_has_ended(
    store: KillingStore,
) -> None:
    done: list[str] = []

    def work(*_: object) -> str:
        done.append("work")
        if len(done) == 1:
            raise OSError("broken")
        return "ok"

    kill(store, in_machine(Doing(work), Doing(killed)))
    (leaf,) = read_position(store, "m").leaves()
    assert leaf == "/M/TIDY"
    with pytest.raises(smachpy.InvalidUserCodeError, match="broken"):
        go_on(store, in_machine(Doing(work), Doing(fine)))
    assert done == ["work"]
    assert read_position(store, "m").leaves() == ["/M/S1"]
    assert go_on(store, in_machine(Doing(work), Doing(fine))) == "ok"
    assert done == ["work"] * 2


def test_position_of_one_that_raised_survives_a_snapshot_and_another_name(
    store: KillingStore,
) -> None:
    def work(*_: object) -> str:
        smachpy.once("scan", lambda: "x" * 100_000)
        raise OSError("broken")

    kill(store, in_machine(Doing(work), Doing(killed)))
    position = read_position(store, "m")
    (digest,) = position.digests()
    assert digest in store.blobs
    again = Position(json.loads(position.to_bytes())).renamed({"/M/S1": "/M/NEW"})
    again.check()
    assert again.digests() == {digest}
    again.fold({"kind": "CleanedUp", "path": "/M/TIDY", "stamp_ns": 1})
    assert again.leaves() == ["/M/NEW"]


def test_a_hook_that_raises_names_the_state(store: KillingStore) -> None:
    kill(store, machine_of(Doing(killed)))
    bad = machine_of(Doing(fine, on_resume=lambda _: 1 / 0))
    with pytest.raises(smachpy.InvalidUserCodeError) as caught:
        go_on(store, bad)
    assert caught.value.path == "/M/S0"


@pytest.mark.parametrize(
    "options",
    [
        {"resume": "skip:"},
        {"resume": "again"},
        {"resume": 3},
        {"resume": lambda: None},
        {"on_resume": "no"},
        {"idempotent": 1},
        {"transient": "socket"},
    ],
    ids=lambda options: " ".join(f"{key} {type(value).__name__}" for key, value in options.items()),
)
def test_options_that_have_no_meaning_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(InvalidStateError):
        Doing(fine, **options)


@pytest.fixture
def world() -> Iterator[TwoNodes]:
    """A network on which operators are asked, in virtual time."""
    with TwoNodes() as world, use_node(world.mission):
        yield world


def answer(world: TwoNodes, *answers: str) -> Task:
    """Let an operator answer the questions that are asked in a second, by path."""

    def reply() -> None:
        world.clock.sleep(1.0)
        questions = find_questions(world.robot)
        assert len(questions) == len(answers)
        for question, word in zip(questions, answers, strict=True):
            with pytest.raises(AnswerRefusedError):
                give_answer(question.service, "perhaps", "Ann", node=world.robot)
            give_answer(question.service, word, "Ann", node=world.robot)
            world.clock.sleep(1.0)

    return world.clock.spawn(reply, name="operator")


@pytest.mark.parametrize(
    ("word", "outcome", "executed"), [("resume", "ok", 1), ("late", "late", 0)]
)
def test_an_operator_answers_on_the_network(
    store: KillingStore, world: TwoNodes, word: str, outcome: str, executed: int
) -> None:
    kill(store, machine_of(Doing(killed, resume="ask"), Doing(fine)))
    done: list[str] = []

    def do(*_: object) -> str:
        done.append("it")
        return "ok"

    operator = answer(world, word)
    assert go_on(store, machine_of(Doing(do, resume="ask"), Doing(fine))) == outcome
    operator.join()
    assert operator.error is None
    assert len(done) == executed


def test_of_two_states_each_waits_for_its_own_answer(store: KillingStore, world: TwoNodes) -> None:
    def build(do: Callable[..., str]) -> StateMachine:
        both = Concurrence(["ok", "bad"], "bad", outcome_map={"ok": {"A": "ok", "B": "late"}})
        both.add("A", Doing(do, resume="ask"))
        both.add("B", Doing(do, resume="ask"))
        root = StateMachine(["ok", "bad"], name="M")
        root.add("BOTH", both)
        return root

    def dies(*_: object) -> str:
        world.clock.sleep(1.0)  # both have begun
        raise Kill

    kill(store, build(dies))
    operator = answer(world, "resume", "late")
    assert go_on(store, build(fine)) == "ok"
    operator.join()
    assert operator.error is None


def test_an_operator_is_asked(store: KillingStore, world: TwoNodes) -> None:
    del world
    kill(store, machine_of(Doing(killed, resume="ask")))
    machine = machine_of(Doing(killed, resume="ask"))

    def force(event: events.Event) -> None:
        if isinstance(event, events.Paused):
            machine.control.force_outcome("/M/S0", "late")
            machine.control.resume()

    machine.subscribe(force)
    assert go_on(store, machine) == "late"


def test_a_question_of_a_mission_that_was_cancelled_does_not_hold_its_clean_up(
    store: KillingStore, world: TwoNodes
) -> None:
    """The pause of the question outlasted it, although the state had been asked to stop before."""

    def build() -> StateMachine:
        machine = machine_of(Doing(killed, resume="ask"))
        machine.add_cleanup("DOCK", Doing(dock))
        return machine

    docked: list[float] = []

    def dock(*_: object) -> str:
        docked.append(world.clock.now())
        return "ok"

    kill(store, build())
    store.request_cancel("m")
    machine, begun = build(), world.clock.now()
    world.clock.call_later(60.0, machine.control.resume)
    assert go_on(store, machine) == "preempted"
    assert len(docked) == 1
    assert docked[0] < begun + 60.0


# -- userdata ----------------------------------------------------------------------------------


def test_a_value_that_cannot_be_kept_is_an_error_when_it_is_set(store: KillingStore) -> None:
    def bad(_: State, userdata: Any) -> str:
        userdata.value = object()
        raise AssertionError

    with pytest.raises(smachpy.InvalidUserCodeError) as caught:
        go_on(store, machine_of(Doing(bad)))
    error = caught.value if isinstance(caught.value, NotDurableError) else caught.value.__cause__
    assert isinstance(error, NotDurableError)
    assert (error.key, error.path) == ("value", "/M/S0")


def test_a_value_is_written_with_the_next_entry_if_its_own_is_not(
    store: KillingStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A state was interrupted as it wrote its end; the value was taken for written."""

    encoded = recorder._encoded

    def interrupted(value: Any, key: str, path: str) -> Any:
        if key == "other":
            monkeypatch.setattr(recorder, "_encoded", encoded)
            raise Interruption
        return encoded(value, key, path)

    def fill(state: State, userdata: Any) -> str:
        userdata.value = "full"
        monkeypatch.setattr(recorder, "_encoded", interrupted)
        return "ok"

    first = Doing(fill)
    first.register_io_keys(["other"])
    first.register_outcomes(["preempted"])
    machine = StateMachine(["ok", "skipped", "late"], name="M")
    machine.userdata.value, machine.userdata.other = 0, []
    machine.add("S0", first, {"preempted": "S1"})
    machine.add("S1", Doing(killed))
    kill(store, machine)
    assert recorder._encoded is encoded
    assert read_position(store, "m").userdata["/M"]["value"] == "full"


def test_a_transient_key_is_not_kept(store: KillingStore) -> None:
    def build(do: Any) -> StateMachine:
        machine = machine_of(Doing(do), transient=["socket"])
        machine.userdata.socket = object()
        return machine

    kill(store, build(killed))
    assert "socket" not in read_position(store, "m").userdata["/M"]
    assert go_on(store, build(fine)) == "ok"


# -- time --------------------------------------------------------------------------------------


def test_a_timeout_that_passed_meanwhile_is_handled_at_once(store: KillingStore) -> None:
    options: dict[str, Any] = {"timeout": 10.0, "timeout_outcome": "late"}
    with VirtualClock() as clock, use_clock(clock):
        kill(store, machine_of(Doing(killed, **options)))
        clock.sleep(11.0)
        assert go_on(store, machine_of(Doing(killed, **options))) == "late"


def test_what_is_left_of_a_timeout_is_left(store: KillingStore) -> None:
    options: dict[str, Any] = {"timeout": 10.0, "timeout_outcome": "late"}

    def wait(state: State, _: Any) -> str:
        return "preempted" if state.sleep(100.0) else "ok"

    with VirtualClock() as clock, use_clock(clock):
        kill(store, machine_of(Doing(killed, **options)))
        clock.sleep(4.0)
        kill_at = clock.now()
        assert go_on(store, machine_of(Doing(wait, **options))) == "late"
        assert clock.now() - kill_at == pytest.approx(6.0)


def test_an_outage_that_pauses_does_not_count(store: KillingStore) -> None:
    options: dict[str, Any] = {"timeout": 10.0, "timeout_outcome": "late"}
    with VirtualClock() as clock, use_clock(clock):
        kill(store, machine_of(Doing(killed, **options)))
        clock.sleep(1000.0)
        assert go_on(store, machine_of(Doing(fine, **options)), outage="pauses") == "ok"
    [[begin, end]] = read_position(store, "m").data["outages"]
    assert end - begin == pytest.approx(1000e9)


def test_a_pause_between_attempts_and_their_number_go_on(store: KillingStore) -> None:
    tries: list[float] = []

    def build(clock: VirtualClock, kills: int) -> StateMachine:
        def attempt(_: State, __: Any) -> str:
            if len(tries) == kills:
                raise Kill
            tries.append(clock.now())
            return "late"

        return machine_of(Doing(attempt, retry=(3, 8.0, ["late"])))

    with VirtualClock() as clock, use_clock(clock):
        store.arm(3, written=True)  # the pause before the second attempt
        kill(store, build(clock, 9))
        store.arm(0, written=False)
        clock.sleep(3.0)
        assert go_on(store, build(clock, 9)) == "late"
    assert [at - tries[0] for at in tries] == pytest.approx([0.0, 8.0, 24.0])


class SetBack(VirtualClock):
    """Shows a time that is `seconds` too early."""

    def __init__(self, seconds: float) -> None:
        super().__init__()
        self.back_ns = round(seconds * 1e9)

    def time_ns(self) -> int:
        return super().time_ns() - self.back_ns


@pytest.mark.parametrize("outage", ["counts", "pauses"])
def test_a_clock_that_was_put_back_holds_nothing_up(store: KillingStore, outage: Any) -> None:
    """The clock of a robot without a battery for it begins in the past after a power loss."""
    options: dict[str, Any] = {"timeout": 10.0, "timeout_outcome": "late"}

    def wait(state: State, _: Any) -> str:
        return "preempted" if state.sleep(100.0) else "ok"

    def die_after(seconds: float) -> Callable[..., str]:
        def do(state: State, _: Any) -> str:
            state.sleep(seconds)
            smachpy.once(f"{current_clock().time_ns()}", int)  # a sign of life in the journal
            raise Kill

        return do

    with VirtualClock() as clock, use_clock(clock):
        kill(store, machine_of(Doing(die_after(4.0), **options)))
    for seconds in (86_400.0, 2 * 86_400.0):
        with SetBack(seconds) as clock, use_clock(clock):
            machine = machine_of(Doing(die_after(1.0), **options))
            with pytest.raises(Kill):
                go_on(store, machine, outage=outage)
            assert clock.now() == pytest.approx(1.0)
    seen: list[events.Event] = []
    with SetBack(3 * 86_400.0) as clock, use_clock(clock):
        machine = machine_of(Doing(wait, **options))
        machine.subscribe(seen.append)
        assert go_on(store, machine, outage=outage) == "late"
        assert clock.now() == pytest.approx(10.0 - 4.0 - 1.0 - 1.0)
    [recovered] = [event for event in seen if isinstance(event, events.Recovered)]
    assert all(end >= begin for begin, end in recovered.outages)


def test_a_journal_that_is_too_old_wants_a_person(store: KillingStore) -> None:
    with VirtualClock() as clock, use_clock(clock):
        kill(store, machine_of(Doing(killed)))
        clock.sleep(61.0)
        with pytest.raises(OutageError) as caught:
            go_on(store, machine_of(Doing(fine)), max_outage=60.0)
        assert caught.value.outage == pytest.approx(61.0)
        assert go_on(store, machine_of(Doing(fine))) == "ok"


# -- requests to stop --------------------------------------------------------------------------


@pytest.mark.parametrize(("by", "expected"), [("operator", "preempted"), ("signal", "ok")])
def test_an_operators_request_holds_on_and_one_of_a_signal_does_not(
    store: KillingStore, by: str, expected: str
) -> None:
    def asked(state: State, _: Any) -> str:
        return "preempted" if state.preempt_requested() else "ok"

    def ask(_: State, __: Any) -> str:
        with asking(by, "somebody"):
            machine.request_preempt()
        raise Kill

    machine = machine_of(Doing(ask))
    kill(store, machine)
    assert go_on(store, machine_of(Doing(asked))) == expected


@pytest.mark.parametrize(
    ("how", "arguments", "ran", "expected"),
    [
        ("force_outcome", ("/M/S0", "late"), ["S0"], "late"),
        ("jump", ("/M/S2",), ["S0", "S2"], "ok"),
        ("preempt", ("/M/S0",), ["S0"], "skipped"),
    ],
)
def test_what_an_operator_wants_of_one_state_holds_on(
    store: KillingStore, how: str, arguments: tuple[str, ...], ran: list[str], expected: str
) -> None:
    seen: list[str] = []

    def steered(_: State, __: Any) -> str:
        getattr(machine.control, how)(*arguments)
        raise Kill

    def asked(label: str) -> Doing:
        def do(state: State, _: Any) -> str:
            seen.append(label)
            return "skipped" if state.preempt_requested() else "ok"

        return Doing(do)

    machine = machine_of(Doing(steered), Doing(fine), Doing(fine))
    kill(store, machine)
    assert go_on(store, machine_of(asked("S0"), asked("S1"), asked("S2"))) == expected
    assert seen == ran


def after_one_another(first: State, last: State) -> Container:
    return machine_of(first, last)


def side_by_side(first: State, last: State) -> Container:
    both = Concurrence(
        ["ok", "late"], "late", outcome_map={"ok": {"S0": "ok", "S1": "ok"}}, name="M"
    )
    both.add("S0", first)
    both.add("S1", last, remapping={"value": "other"})
    return both


@pytest.mark.parametrize("shape", [after_one_another, side_by_side])
def test_a_state_that_ended_with_a_forced_outcome_is_not_executed_again(
    shape: Callable[..., Container],
) -> None:
    done: list[str] = []

    class Killing(KillingStore):
        def append(self, lease: Any, entries: list[bytes], **named: Any) -> None:
            if len(done) == 1 and any(b'"Entered"' in entry for entry in entries):
                done.append("killed")
                raise Kill
            super().append(lease, entries, **named)

    def forced(state: State, _: Any) -> str:
        machine.control.force_outcome("/M/S0", "ok")
        done.append("S0")
        return "late"

    def dies_later(state: State, _: Any) -> str:  # in the branch beside
        state.sleep(5.0)
        raise Kill

    store = Killing()
    with use_clock(VirtualClock()):
        machine = shape(Doing(forced), Doing(dies_later))
        kill(store, machine)
        done.append("killed")
        assert go_on(store, shape(Doing(forced), Doing(fine))) == "ok"
    assert done.count("S0") == 1


def test_a_branch_that_was_stopped_before_stays_so(store: KillingStore) -> None:
    def wait(state: State, _: Any) -> str:
        state.wait_preempt()
        state.service_preempt()
        return "preempted"

    def build(last: Any) -> StateMachine:
        both = Concurrence(["ok"], "ok", child_termination_cb=lambda _: True)
        with both:
            both.add("QUICK", Doing(fine))
            both.add("WAITS", Doing(wait), remapping={"value": "other"})
        machine = StateMachine(["ok", "preempted", "skipped", "late"], name="M")
        with machine:
            machine.add("BOTH", both, {"ok": "LAST"})
            machine.add("LAST", Doing(last))
        return machine

    calm = KillingStore()
    expected = go_on(calm, build(fine))
    for kill_at in range(1, calm.writes):
        store = KillingStore()
        store.arm(kill_at, written=True)
        kill(store, build(fine))
        store.arm(0, written=False)
        assert go_on(store, build(fine)) == expected, kill_at


# -- a machine that has changed ----------------------------------------------------------------


def test_a_changed_machine_is_refused_with_the_differences(store: KillingStore) -> None:
    kill(store, machine_of(Doing(killed)))
    changed = machine_of(Doing(fine), Doing(fine))
    with pytest.raises(MachineChangedError) as caught:
        go_on(store, changed)
    assert "/M/S1: is new" in caught.value.differences
    assert go_on(store, changed, migrate={"/M/S0": "/M/S0"}) == "ok"


def test_a_machine_that_names_other_outcomes_as_good_goes_on(store: KillingStore) -> None:
    kill(store, machine_of(Doing(killed), success=["ok"]))
    assert go_on(store, machine_of(Doing(fine), success=["ok", "late"])) == "ok"


def test_a_path_that_moved_is_followed(store: KillingStore) -> None:
    def build(label: str, do: Any) -> StateMachine:
        machine = StateMachine(["ok", "skipped", "late"], name="M")
        machine.userdata.value = 0
        with machine:
            machine.add("FIRST", Doing(fine), {"ok": label})
            machine.add(label, Doing(do))
        return machine

    kill(store, build("OLD", killed))
    entered: list[str] = []
    machine = build("NEW", fine)
    machine.subscribe(
        lambda event: entered.append(event.path) if isinstance(event, events.Entered) else None
    )
    with pytest.raises(MachineChangedError):
        go_on(store, machine, migrate={"/M/FIRST": "/M/FIRST"})  # it does not say what OLD is now
    with pytest.raises(MissionError):
        go_on(store, machine, migrate={"/M/OLD": "/M/NOWHERE"})
    kill_again = build("NEW", killed)
    with pytest.raises(Kill):
        go_on(store, kill_again, migrate={"/M/OLD": "/M/NEW"})
    assert go_on(store, machine) == "ok"  # it has been said
    assert entered == ["/M/NEW"]


def test_a_jump_goes_to_the_state_that_has_another_name_now(store: KillingStore) -> None:
    def build(label: str, do: Any) -> StateMachine:
        machine = StateMachine(["ok", "skipped", "late"], name="M")
        machine.userdata.value = 0
        with machine:
            machine.add("FIRST", Doing(do))
            machine.add(label, Doing(lambda *_: "late"))
        return machine

    def steered(_: State, __: Any) -> str:
        machine.control.jump("/M/OLD")
        raise Kill

    machine = build("OLD", steered)
    kill(store, machine)
    assert go_on(store, build("NEW", fine), migrate={"/M/OLD": "/M/NEW"}) == "late"


def test_a_function_may_say_what_has_changed_or_refuse(store: KillingStore) -> None:
    kill(store, machine_of(Doing(killed)))
    changed = machine_of(Doing(fine), Doing(fine))
    with pytest.raises(MachineChangedError):
        go_on(store, changed, migrate=lambda _: None)
    assert go_on(store, changed, migrate=lambda found: {"/M/S0": "/M/S0"} if found else None)


# -- journals that cannot be used --------------------------------------------------------------


@pytest.mark.parametrize("entry", [b"", b"{", b"[]", b'{"kind":"Nothing"}', b'{"kind":"Left"}'])
def test_an_entry_that_cannot_be_read_is_told(store: KillingStore, entry: bytes) -> None:
    kill(store, machine_of(Doing(killed)))
    store.entries["m"].append(entry)
    with pytest.raises(StoreError) as caught:
        go_on(store, machine_of(Doing(fine)))
    assert caught.value.reason == "corrupt"


def test_entries_of_a_newer_smachpy_are_not_read(store: KillingStore) -> None:
    kill(store, machine_of(Doing(killed)))
    store.rows["m"] = dataclasses.replace(store.rows["m"], version=VERSION + 1)
    before = list(store.entries["m"])
    with pytest.raises(StoreError, match="Try a newer smachpy") as caught:
        go_on(store, machine_of(Doing(fine)))
    assert caught.value.reason == "future"
    assert store.entries["m"] == before


def test_a_journal_that_cannot_be_written_preempts_the_machine(store: KillingStore) -> None:
    class Full(KillingStore):
        def append(self, *arguments: Any, **named: Any) -> None:
            if self.writes == 3:
                raise StoreError("here", "no space is left.", reason="full")
            super().append(*arguments, **named)

    full, begun = Full(), []

    def note(_: State, __: Any) -> str:
        begun.append(1)
        return "ok"

    with pytest.raises(StoreError) as caught:
        go_on(full, machine_of(*(Doing(note) for _ in range(9))))
    assert caught.value.reason == "full"
    assert len(begun) == 2
    assert full.rows["m"].status == "interrupted"


def test_a_run_ends_without_its_journal_even_if_a_request_to_stop_leads_on() -> None:
    class Gone(KillingStore):
        is_gone = False

        def append(self, *arguments: Any, **named: Any) -> None:
            if self.is_gone:
                raise StoreError("here", "no space is left.", reason="full")
            super().append(*arguments, **named)

    gone, begun = Gone(), []

    def drive(state: State, _: Any) -> str:
        begun.append(1)
        gone.is_gone = len(begun) == 2
        return "skipped" if state.sleep(30.0) else "ok"

    # A request to stop skips to the next place; there are always more.
    machine = StateMachine(["late", "preempted"], name="M")
    machine.userdata.value = 0
    for label, following in (("A", "B"), ("B", "A")):
        machine.add(label, Doing(drive), {"ok": following, "skipped": following})
    outer = StateMachine(["late", "preempted"], name="OUTER")
    outer.add("M", machine, {"preempted": "M"})
    with use_clock(VirtualClock()) as clock:
        clock.call_later(45.0, machine.request_preempt)
        with pytest.raises(StoreError):
            go_on(gone, outer)
    assert len(begun) == 2


def test_a_mission_whose_end_cannot_be_written_is_interrupted() -> None:
    """It waited in the queue, as if it had not begun."""

    class Full(KillingStore):
        def append(self, lease: Any, entries: list[bytes], **named: Any) -> None:
            if any(b'"Finished"' in entry for entry in entries):
                raise StoreError("here", "no space is left.", reason="full")
            super().append(lease, entries, **named)

    full = Full()
    with pytest.raises(StoreError):
        go_on(full, machine_of(Doing(fine)))
    assert full.rows["m"].status == "interrupted"


def test_one_that_was_taken_over_is_preempted(store: KillingStore) -> None:
    class Taken(KillingStore):
        def append(self, lease: Any, *arguments: Any, **named: Any) -> None:
            if self.writes == 2:
                raise FencedError("here", lease, "other:7")
            super().append(lease, *arguments, **named)

    taken = Taken()
    with pytest.raises(FencedError):
        go_on(taken, machine_of(*(Doing(fine) for _ in range(9))))


# -- once --------------------------------------------------------------------------------------


def test_once_is_per_visit_and_survives_attempts(store: KillingStore) -> None:
    calls: list[int] = []

    def do(_: State, userdata: Any) -> str:
        smachpy.once("call", lambda: calls.append(userdata.value))
        userdata.value += 1
        return "late" if userdata.value == 1 else "ok"

    machine = machine_of(Doing(do, retry=(2, 0.0, ["late"])), Doing(do))
    assert go_on(store, machine) == "ok"
    assert calls == [0, 2]


def test_what_once_raises_is_not_kept_and_bad_arguments_are_refused(store: KillingStore) -> None:
    calls: list[int] = []

    def call() -> int:
        calls.append(1)
        if len(calls) == 1:
            raise OSError
        return 3

    def do(_: State, userdata: Any) -> str:
        try:
            smachpy.once("call", call)
        except OSError:
            userdata.value = smachpy.once("call", call)
        return "ok"

    machine = machine_of(Doing(do))
    assert go_on(store, machine) == "ok"
    assert machine.userdata.value == 3

    async def never() -> None: ...

    for key, function in (("", call), (3, call), ("key", never), ("key", None)):
        with pytest.raises(InvalidStateError):
            smachpy.once(key, function)  # type: ignore[arg-type]
    assert smachpy.once("outside", lambda: 4) == 4


def test_a_program_runs_one_mission_after_the_other(tmp_path: Path) -> None:
    for _ in range(2):
        assert smachpy.run_durable(machine_of(Doing(fine)), tmp_path / "j.db") == "ok"


@pytest.mark.parametrize("mission", ["", 3, b"m"])
def test_the_id_of_a_mission_is_a_text(tmp_path: Path, mission: Any) -> None:
    """A number was kept as a text, so that the mission could not be resumed."""
    with pytest.raises(InvalidStateError, match="run_durable: mission: got"):
        smachpy.run_durable(machine_of(Doing(fine)), tmp_path / "j.db", mission=mission)
    assert not (tmp_path / "j.db").exists()


# -- keys with a dot ---------------------------------------------------------------------------


def test_keys_with_a_dot_are_kept_and_constants_come_from_the_code(store: KillingStore) -> None:
    """A dot once marked constants, so a key such as "arm.pose" was lost without a word."""

    def build(do: Callable[..., str], speed: int) -> StateMachine:
        keys: dict[str, Any] = {"output_keys": ["arm.pose"]}
        machine = StateMachine(["ok"], name="M")
        with machine:
            measure = smachpy.CBState(measured, outcomes=["ok"], **keys)
            StateMachine.add("MEASURE", measure, {"ok": "CARRY"}, constants={"speed": speed})
            reads = {"input_keys": ["arm.pose", "speed"]}
            carry = smachpy.CBState(do, outcomes=["ok"], **reads)
            StateMachine.add("CARRY", carry, constants={"speed": speed})
        return machine

    def measured(userdata: Any) -> str:
        userdata["arm.pose"] = [userdata.speed]
        return "ok"

    seen: list[Any] = []

    def carried(userdata: Any) -> str:
        seen.append((userdata["arm.pose"], userdata.speed))
        return "ok"

    kill(store, build(killed, 1))
    assert read_position(store, "m").userdata["/M"] == {"arm.pose": [1]}  # type: ignore[arg-type]
    assert go_on(store, build(carried, 2)) == "ok"
    assert seen == [([1], 2)]


def test_a_dot_does_not_take_a_key_past_the_check_of_typed_userdata() -> None:
    class Facts:
        count: int = 0

    machine = StateMachine(["ok"], userdata_type=Facts)
    with pytest.raises(smachpy.UserDataKeyError):
        machine.userdata["arm.pose"] = 1
    state = smachpy.CBState(fine, outcomes=["ok"], output_keys=["arm.pose"])
    with pytest.raises(smachpy.InconsistentMachineError, match=r"arm\.pose"), machine:
        StateMachine.add("A", state)


@pytest.mark.parametrize("in_place", [False, True])
def test_a_branch_begins_again_with_the_values_with_which_it_began(
    store: KillingStore, in_place: bool
) -> None:
    """The end of another branch had written the half-finished work of this one into the journal."""
    begun: list[Any] = []
    wrote, other_left = threading.Event(), threading.Event()

    def work(_: State, userdata: Any) -> str:
        begun.append(list(userdata.value))
        if in_place:
            userdata.value.append("work")
        else:
            userdata.value = [*userdata.value, "work"]
        if len(begun) == 1:
            wrote.set()
            assert other_left.wait(60)
            store.dead = True
        return "ok"

    def other(_: State, userdata: Any) -> str:
        assert wrote.wait(60)
        userdata.value = "done"
        return "ok"

    def live() -> tuple[str, dict[str, Any]]:
        machine = Concurrence(["ok"], "ok", name="M")
        machine.userdata.value, machine.userdata.other = [], ""
        with machine:
            machine.add("WORK", Doing(work))
            machine.add("OTHER", Doing(other), remapping={"value": "other"})
        machine.subscribe(
            lambda event: (
                other_left.set()
                if isinstance(event, events.Left) and event.path == "/M/OTHER"
                else None
            )
        )
        return smachpy.run_durable(machine, store, mission="m"), dict(machine.userdata)

    with pytest.raises(Kill):
        live()
    store.arm(0, written=False)
    assert live() == ("ok", {"value": ["work"], "other": "done"})
    assert begun == [[], []]


# -- a container that cannot go on ---------------------------------------------------------------


def two_in_a_machine(grasp: State, place: State, **options: Any) -> Container:
    machine = StateMachine(["goal", "preempted"], **options)
    machine.add("GRASP", grasp, {"ok": "PLACE"})
    machine.add("PLACE", place, {"ok": "goal"})
    return machine


def two_in_a_plan(grasp: State, place: State, **options: Any) -> Container:
    net = net_of(
        "init* -> GRASP.exec : GRASP.start\nGRASP.exec -> held : GRASP.end\n"
        "held -> PLACE.exec : PLACE.start\nPLACE.exec -> goal : PLACE.end"
    )
    return PetriNetPlan(net, {"GRASP": grasp, "PLACE": place}, **options)


@pytest.mark.parametrize("shape", [two_in_a_machine, two_in_a_plan])
def test_a_container_that_cannot_go_on_begins_anew_when_it_is_visited_again(
    store: KillingStore, shape: Callable[..., Container]
) -> None:
    done: list[str] = []

    def doing(name: str) -> smachpy.CBState:
        return smachpy.CBState(lambda _: done.append(name) or "ok", outcomes=["ok"])

    def build(place: smachpy.CBState, on_resume: Callable[..., object]) -> StateMachine:
        work = StateMachine(["goal", "fail", "preempted"], on_exception={Exception: "fail"})
        work.add("CELL", shape(doing("grasp"), place, on_resume=on_resume))
        machine = StateMachine(["ok", "preempted"], name="M")
        machine.add("WORK", work, {"goal": "ok", "fail": "RECOVER"})
        machine.add("RECOVER", doing("recover"), {"ok": "WORK"})
        return machine

    def has_no_camera(_: Any) -> None:
        raise OSError

    kill(store, build(smachpy.CBState(killed, outcomes=["ok"]), fine))
    assert go_on(store, build(doing("place"), has_no_camera)) == "ok"
    assert done == ["grasp", "recover", "grasp", "place"]
