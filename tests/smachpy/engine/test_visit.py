"""The life cycle of a child: every cell of its table, every line of what follows a visit."""

from __future__ import annotations

import itertools
import random

import pytest
from transitions import Machine

from smachpy.engine.options import Options, Retry
from smachpy.engine.visit import (
    ROWS,
    STEPS,
    Again,
    ChildErrors,
    Effect,
    End,
    Event,
    Override,
    Phase,
    Why,
    after,
    after_attempt,
    choice_after,
    following,
)
from smachpy.exceptions import InvalidUserCodeError
from tests.places import DOCS

IMAGES = DOCS / "images"

# One line per phase and event: what follows ("=": it stays), and what is done. A pair that is
# missing cannot happen.
CELLS = """
CHOSEN        ASK              CALLED_OFF
CHOSEN        START            RUNNING
CHOSEN        END              ENDED        CLEAR
CALLED_OFF    ASK              =
CALLED_OFF    START            =
CALLED_OFF    END              ENDED        CLEAR
RUNNING       ASK              ASKED        PUBLISH_REQUEST TELL CALL_OVERRIDE ARM_GRACE
RUNNING       TIME_OVER        ASKED        PUBLISH_TIMED_OUT PUBLISH_REQUEST TELL CALL_OVERRIDE ARM_GRACE
RUNNING       SERVICE          =
RUNNING       RECALL           =
RUNNING       NEXT_ATTEMPT     =
RUNNING       END              ENDED        CLEAR
ASKED         ASK              =            PUBLISH_REQUEST TELL
ASKED         TIME_OVER        =            PUBLISH_TIMED_OUT PUBLISH_REQUEST TELL
ASKED         SERVICE          =            PUBLISH_SERVICED
ASKED         RECALL           RUNNING      CLEAR
ASKED         GRACE_OVER       OVERDUE      PUBLISH_ABANDONED ARM_PATIENCE INTERRUPT
ASKED         NEXT_ATTEMPT     RUNNING      CLEAR
ASKED         END              ENDED        CLEAR
OVERDUE       ASK              =            PUBLISH_REQUEST TELL
OVERDUE       TIME_OVER        =            PUBLISH_TIMED_OUT PUBLISH_REQUEST TELL
OVERDUE       SERVICE          =            PUBLISH_SERVICED
OVERDUE       RECALL           RUNNING      CLEAR
OVERDUE       INTERRUPT_AGAIN  =            ARM_PATIENCE INTERRUPT
OVERDUE       LEAVE            LEFT_BEHIND  PUBLISH_LEFT CUT_OFF
OVERDUE       NEXT_ATTEMPT     RUNNING      CLEAR
OVERDUE       END              ENDED        CLEAR
ENDED         ASK              =
ENDED         TIME_OVER        =
ENDED         SERVICE          =
ENDED         RECALL           =
ENDED         GRACE_OVER       =
ENDED         INTERRUPT_AGAIN  =
ENDED         LEAVE            =
ENDED         NEXT_ATTEMPT     =
ENDED         END              =
"""


def cells():
    found = {}
    for line in CELLS.strip().splitlines():
        phase, event, target, *effects = line.split()
        source = Phase[phase]
        follows = source if target == "=" else Phase[target]
        found[source, Event[event]] = (follows, tuple(Effect[name] for name in effects))
    for event in Event:  # nothing that a thread left behind does has an effect
        found[Phase.LEFT_BEHIND, event] = (Phase.LEFT_BEHIND, ())
    return found


@pytest.mark.parametrize(
    ("phase", "event"), [*itertools.product(Phase, Event)], ids=lambda value: value.name
)
def test_every_cell_of_the_table(phase, event):
    assert STEPS.get((phase, event)) == cells().get((phase, event))


def test_transitions_accepts_the_table_and_walks_as_the_compiled_one():
    class Model:
        pass

    model = Model()
    machine = Machine(
        model,
        states=[phase.name for phase in Phase],
        initial=Phase.CHOSEN.name,
        auto_transitions=False,
        transitions=[
            [row.event.name, source.name, (row.target or source).name]
            for row in ROWS
            for source in row.sources
        ],
    )
    for (source, event), (target, _) in STEPS.items():
        machine.set_state(source.name)
        model.trigger(event.name)
        assert model.state == target.name
        assert len(machine.get_transitions(event.name, source.name)) == 1  # no line is hidden


def test_every_phase_can_be_reached_and_every_effect_is_used():
    reached = {Phase.CHOSEN}
    for _ in Phase:
        reached |= {target for (source, _), (target, _) in STEPS.items() if source in reached}
    assert reached == set(Phase)
    assert {effect for _, effects in STEPS.values() for effect in effects} == set(Effect)


def test_a_visit_is_told_armed_and_cleared_in_pairs_on_every_way():
    """Whatever happens in whatever order, what was armed or told is cleared at the end."""
    rng = random.Random(1)
    for _ in range(2000):
        phase, armed = Phase.CHOSEN, False
        for _ in range(12):
            possible = [event for (source, event) in STEPS if source is phase]
            phase, effects = STEPS[phase, rng.choice(possible)]
            for effect in effects:
                if effect in {Effect.TELL, Effect.ARM_GRACE, Effect.ARM_PATIENCE}:
                    armed = True
                if effect in {Effect.CLEAR, Effect.CUT_OFF}:
                    armed = False
        if phase in {Phase.CHOSEN, Phase.CALLED_OFF, Phase.RUNNING, Phase.ENDED, Phase.LEFT_BEHIND}:
            assert not armed


# -- after an attempt --------------------------------------------------------------------------


def after_plain_attempt(result, *, attempt=1, asked=False, timed_out=False, **options):
    given = Options(**options)
    return after_attempt(result, given, attempt, asked=asked, timed_out=timed_out)


def test_the_outcome_stands_if_no_option_wants_anything_else():
    assert after_plain_attempt("done") == "done"
    assert after_plain_attempt(["no", "outcome"]) == ["no", "outcome"]


class Interrupted(BaseException):
    """As what breaks into a child that ignored its preempt."""


@pytest.mark.parametrize("result", ["preempted", Interrupted()])
def test_a_timeout_gives_its_outcome_only_to_what_it_stopped(result):
    assert after_plain_attempt(result, timed_out=True, timeout_outcome="late") == "late"
    assert after_plain_attempt("done", timed_out=True, timeout_outcome="late") == "done"
    assert after_plain_attempt(result, timeout_outcome="late") is result


@pytest.mark.parametrize("asked", [False, True])
@pytest.mark.parametrize("attempt", [1, 2])
@pytest.mark.parametrize("result", ["aborted", "done", ValueError("x")])
def test_it_runs_again_while_attempts_are_left_unless_somebody_asked(result, attempt, asked):
    retry = Retry(2, 0.5, ["aborted", ValueError])
    found = after_plain_attempt(result, attempt=attempt, asked=asked, retry=retry)
    expected = result
    if result != "done" and attempt == 1:
        expected = "preempted" if asked else Again(0.5, result)
    assert found == expected


def test_a_request_leaves_what_no_attempt_would_mend():
    options = {"retry": Retry(2, 0.0, [OSError]), "on_exception": {ValueError: "broken"}}
    assert after_plain_attempt(ValueError(), asked=True, **options) == "broken"
    error = KeyError()
    assert after_plain_attempt(error, asked=True, **options) is error


def test_a_timeout_outcome_may_be_tried_again():
    retry = Retry(2, 0.0, ["aborted"])
    found = after_plain_attempt("preempted", timed_out=True, retry=retry)
    assert found == Again(0.0, "aborted")


def test_an_error_becomes_the_outcome_that_is_named_for_it():
    handled = {ValueError: "bad", Exception: "broken"}
    assert after_plain_attempt(ValueError("x"), on_exception=handled) == "bad"
    assert after_plain_attempt(OSError("x"), on_exception=handled) == "broken"
    error = OSError("x")
    assert after_plain_attempt(error, on_exception={ValueError: "bad"}) is error


def test_an_interruption_by_somebody_else_is_passed_on():
    interrupted = Interrupted()
    assert after_plain_attempt(interrupted, retry=Retry(5, 0.0, ["aborted"])) is interrupted


# -- after the visit ---------------------------------------------------------------------------


class Child:
    """Stands for another child's record."""

    final = False


def plainly(outcome, targets, run_asked, answered, override):
    """Decide as the page in the docs says, line by line, without a thought for brevity."""
    decided = None
    if override == Override():  # an operator has stopped it, and chosen nothing
        override = None
    if outcome == "preempted" and "preempted" not in targets and (run_asked or override is None):
        decided = "STOPPED", "preempted"
    elif run_asked:
        if outcome not in targets:
            decided = "UNKNOWN", None
        elif isinstance(targets[outcome], End):
            decided = "FOLLOWED", targets[outcome]
        elif answered:
            decided = "ANSWERED", targets[outcome]
        elif outcome == "preempted":
            decided = "STOPPED", "preempted"
        else:  # its work is finished: a next run would go on there
            decided = "STOPPED", targets[outcome]
    elif override is not None and override.label is not None:
        decided = "JUMPED", override.label
    elif override is not None:
        decided = "FORCED", targets[override.outcome]
    elif outcome in targets:
        decided = "FOLLOWED", targets[outcome]
    return decided or ("UNKNOWN", None)


DONE, NEXT = End("done"), Child()
TARGETS = [
    {"done": DONE, "next": NEXT},
    {"done": DONE, "next": NEXT, "preempted": End("preempted")},
    {"done": DONE, "next": NEXT, "preempted": NEXT},
]


@pytest.mark.parametrize("targets", TARGETS, ids=["unregistered", "ends", "cleans up"])
@pytest.mark.parametrize("outcome", ["done", "next", "preempted", "typo"])
@pytest.mark.parametrize("run_asked", [False, True])
@pytest.mark.parametrize("answered", [False, True])
@pytest.mark.parametrize(
    "override",
    [None, Override(), Override(outcome="done"), Override(label="NEXT")],
    ids=str,
)
def test_every_line_with_every_kind_of_request(targets, outcome, run_asked, answered, override):
    leads = {name: following(name, target) for name, target in targets.items()}
    found = after(outcome, leads, run_asked=run_asked, answered=answered, override=override)
    why, target = plainly(outcome, targets, run_asked, answered, override)
    assert found.why is Why[why]
    if target == "preempted":
        assert (found.target.final, found.target.outcome) == (True, "preempted")
    else:
        assert found.target == target


AGAIN = Override(label="DRIVE", if_stopped=True)  # of a pause


@pytest.mark.parametrize(
    ("earlier", "later", "asked", "counts"),
    [
        (None, AGAIN, False, AGAIN),
        (None, AGAIN, True, None),  # a concurrence, a plan or who takes the resource has asked it
        (AGAIN, None, True, None),
        (AGAIN, AGAIN, True, AGAIN),
        (AGAIN, Override(outcome="done"), True, Override(outcome="done")),
        (Override(outcome="done"), Override(label="NEXT"), True, Override(label="NEXT")),
        (Override(label="NEXT"), Override(), True, Override()),
        (Override(label="NEXT"), AGAIN, True, Override(label="NEXT")),
        (Override(label="NEXT"), None, True, Override(label="NEXT")),
        (Override(), AGAIN, True, Override()),
    ],
)
def test_the_last_choice_of_an_operator_counts_and_a_pause_is_none(earlier, later, asked, counts):
    assert choice_after(earlier, later, asked=asked) == counts


@pytest.mark.parametrize("outcome", [None, 3, ["done"], {"done": 1}])
def test_what_is_no_outcome_at_all_is_unknown(outcome):
    leads = {name: following(name, target) for name, target in TARGETS[0].items()}
    found = after(outcome, leads, run_asked=False, answered=False)
    assert found.why is Why.UNKNOWN


# -- the picture -------------------------------------------------------------------------------


def draw():
    """Return the table as a DOT graph; what changes no phase is left out."""
    lines = [
        "digraph visit {",
        '  graph [fontname="sans-serif", rankdir="LR"]',
        '  node [fontname="sans-serif", shape="box", style="rounded"]',
        '  edge [fontname="sans-serif", fontsize="10"]',
    ]
    ends = {Phase.ENDED, Phase.LEFT_BEHIND}
    for phase in Phase:
        double = ', peripheries="2"' if phase in ends else ""
        lines.append(f'  {phase.name} [label="{phase.value}"{double}]')
    edges = {}
    for (source, event), (target, _) in STEPS.items():
        if source is not target:
            edges.setdefault((source.name, target.name), []).append(event.value)
    for (source, target), events in edges.items():
        lines.append(f'  {source} -> {target} [label="{", ".join(events)}"]')
    return "\n".join([*lines, "}", ""])


def test_the_picture_in_the_docs_is_that_of_the_table():
    """If not: write `draw()` to the .dot file, and run `dot -Tsvg` on it."""
    assert (IMAGES / "visit_life_cycle.dot").read_text() == draw()
    assert "left behind" in (IMAGES / "visit_life_cycle.svg").read_text()


# -- errors that a container has wrapped --------------------------------------------------------


def wrapped(cause):
    error = InvalidUserCodeError("a child raised")
    error.__cause__ = cause
    return error


@pytest.mark.parametrize(
    ("cause", "is_covered"),
    [
        (OSError("bus"), True),
        (wrapped(OSError("bus")), True),  # two levels of containers
        (ValueError("typo"), False),
        (None, False),
        (ChildErrors("both", [OSError("bus"), wrapped(OSError("bus"))]), True),
        (ChildErrors("one of them", [OSError("bus"), ValueError("typo")]), False),
        (ExceptionGroup("the state's own", [OSError("bus")]), False),
    ],
    ids=repr,
)
def test_an_error_in_a_container_is_covered_if_all_that_it_wraps_are(cause, is_covered):
    result = wrapped(cause)
    by_outcome = Options(on_exception={OSError: "failed"})
    decided = after_attempt(result, by_outcome, 1, asked=False, timed_out=False)
    assert decided == ("failed" if is_covered else result)
    by_retry = Options(retry=Retry(2, 3.0, [OSError]))
    decided = after_attempt(result, by_retry, 1, asked=False, timed_out=False)
    assert decided == (Again(3.0, result) if is_covered else result)


def test_a_group_of_children_that_is_named_itself_is_covered_whatever_is_in_it():
    result = wrapped(ChildErrors("both", [OSError("bus"), ValueError("typo")]))
    options = Options(on_exception={ExceptionGroup: "failed"})
    assert after_attempt(result, options, 1, asked=False, timed_out=False) == "failed"
