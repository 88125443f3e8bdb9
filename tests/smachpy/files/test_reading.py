"""Mission files: what they build, what is refused and where, and that loading runs no code."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

import pytest

import smachpy
from smachpy import Resource, get_options
from smachpy.checks import check
from smachpy.files import MissionFileError, load, read, resolve
from smachpy.files.reference import ResolveError
from smachpy.testing import explore, mission_kit

HERE = Path(__file__).parent

GOOD = """\
name: ROUNDS
help: Counts, then waits.
parameters:
  seconds: {type: number, default: 2.0, unit: s, help: how long}
  last: {type: whole, default: 3}
outcomes: [done, preempted]
userdata: {count: 0, last: "${last}"}
states:
  COUNT:
    state: compute
    with: {count: count + 1}
    on:
      done:
        - {when: count >= last, to: BOTH}
        - {to: COUNT}
  BOTH:
    concurrence:
      outcomes: [done, preempted]
      default_outcome: done
      outcome_map: {done: {need: 1, of: {A: done, B: done}}}
      stop_others: true
      states:
        A: {state: wait, with: {seconds: "${seconds}"}}
        B: {state: wait, with: {seconds: 60}}
    on: {done: EACH}
  EACH:
    iterator:
      outcomes: [done, preempted]
      items: [1, 2]
      each:
        PART:
          sequence:
            outcomes: [done, preempted]
            connector: done
            states:
              X: {state: wait, with: {seconds: 1}}
              Y: {state: wait, with: {seconds: 1}, timeout: 5, retry: {attempts: 2, on: [aborted]}, on: {aborted: done}}
cleanup:
  TIDY: {state: set, with: {count: 0}}
"""


@pytest.fixture
def file(tmp_path):
    def write(text: str, name: str = "mission.yaml") -> Path:
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def problems_of(path: Path, **arguments) -> list[str]:
    with pytest.raises(MissionFileError) as caught:
        load(path, **arguments)
    return [problem.removeprefix(f"{path}:") for problem in caught.value.problems]


def test_all_kinds_of_containers_run(file):
    with mission_kit() as mission:
        run = mission(load(file(GOOD)))
    assert (run.outcome, run.duration) == ("done", 6.0)
    assert run.visits("COUNT") == 3
    assert run.userdata["count"] == 0


def test_the_public_name_loads_too(file):
    assert smachpy.load(file(GOOD)).name == "ROUNDS"


def test_parameters_change_it_and_are_described(file):
    path = file(GOOD)
    with mission_kit() as mission:
        run = mission(load(path, seconds=5.0, last=1))
    assert (run.duration, run.visits("COUNT")) == (9.0, 1)
    text, parameters = read(path)
    assert text == "Counts, then waits."
    assert [(one.name, one.type, one.unit) for one in parameters] == [
        ("seconds", "number", "s"),
        ("last", "whole", ""),
    ]


def test_wrong_parameters_are_all_told(file):
    path = file(GOOD)
    assert problems_of(path, seconds="x", lst=3) == [
        (
            "3:1: parameters: got an argument 'lst'; expected one of ['last', 'seconds']. "
            "Did you mean 'last'?"
        ),
        "4:3: parameters.seconds: got 'x'; expected a number [s].",
    ]


def test_a_required_parameter_is_asked_for(file):
    text = "outcomes: [done, preempted]\nparameters: {n: {type: number}}\nstates:\n  A: {state: wait}\n"
    assert problems_of(file(text)) == [
        "2:14: parameters.n: got no value; expected one, it is required."
    ]


@pytest.mark.parametrize("name", ["path", "allow", "to_run"])
def test_a_parameter_is_not_named_as_an_argument_of_load(file, name):
    """Its value was a TypeError."""
    states = "states:\n  A: {state: wait, with: {seconds: 1}}\n"
    path = file(f"outcomes: [done, preempted]\nparameters: {{{name}: {{type: any}}}}\n{states}")
    expected = f"2:14: parameters.{name}: got {name!r}, an argument of smachpy.load; expected"
    with pytest.raises(MissionFileError, match=re.escape(expected)):
        smachpy.files.read(path)
    assert problems_of(path)[0].startswith(expected)


@pytest.mark.parametrize("default", ['"${n}"', '["${n}"]'])
def test_the_default_of_a_parameter_names_no_other(file, default):
    """It was taken as it is written, without a word."""
    states = "states:\n  A: {state: wait, with: {seconds: 1}}\n"
    parameters = f"parameters:\n  n: {{type: text, default: x}}\n  m: {{default: {default}}}\n"
    (problem,) = problems_of(file(f"outcomes: [done, preempted]\n{parameters}{states}"))
    assert problem.startswith("4:")
    assert problem.endswith("expected a value: a default names no parameter.")


def test_every_mistake_has_its_place_and_a_suggestion(file):
    path = file(
        """\
nam: X
outcomes: [done, preempted]
states:
  A:
    state: wayt
    on: {done: B}
  B:
    state: wait
    with: {secnds: 3}
    on:
      done:
        - {when: "x <", to: A}
        - {to: A}
  C: {state: wait, with: {seconds: "${m}"}, timeot: 3}
  D: {mission: ../x.yaml}
  E: {mission: mission.yaml}
  F: {plan: nothing.pnml}
  G: {machine: {outcomes: [x], states: {Q: {state: wait, on: {done: nowhere}}}}}
  H: {}
  I: {state: wait, machine: {}}
  J: {state: set, on: {done: [{to: A}, {to: B}]}}
"""
    )
    found = problems_of(path)
    begins = [
        "1:1: nam: got an unknown field",
        "5:5: states.A.state: got 'wayt'",
        "9:5: states.B.with: wait: got 'secnds'",
        "12:12: states.B.on.done[0].when: condition",
        "14:27: states.C.with.seconds: got '${m}'",
        "14:45: states.C.timeot: got an unknown field",
        "15:7: states.D.mission: got '../x.yaml', which is not in",
        "16:7: states.E.mission: got 'mission.yaml', which contains this file",
        "17:7: states.F.plan: got 'nothing.pnml', which is no file",
        "18:63: states.G.machine.states.Q.on.done: transition 'done' leads nowhere",
        "19:3: states.H: got no kind of state",
        "20:20: states.I.machine: got ['state', 'machine']",
        "21:31: states.J.on.done[0]: got a case without a condition before the last",
    ]
    assert [begin for begin, one in zip(begins, found, strict=True) if begin not in one] == []
    assert "Did you mean 'name'?" in found[0]
    assert "Did you mean 'seconds'?" in found[2]
    assert "Did you mean 'timeout'?" in found[5]


def test_files_that_name_each_other_twice_do_not_multiply(tmp_path):
    for level in range(40):
        inner = f"{{mission: m{level + 1}.yaml, on: {{done: done}}}}"
        states = f"A: {inner}, B: {inner}" if level < 39 else "A: {state: wait}"
        text = f"outcomes: [done, preempted]\nstates: {{{states}}}\n"
        (tmp_path / f"m{level}.yaml").write_text(text)
    with pytest.raises(MissionFileError, match="got more than 1000 mission files") as caught:
        load(tmp_path / "m0.yaml")
    assert len(caught.value.problems) == 1


def test_files_are_not_too_deep_in_each_other(tmp_path):
    for level in range(60):
        states = f"A: {{mission: m{level + 1}.yaml, on: {{done: done}}}}"
        text = f"outcomes: [done, preempted]\nstates: {{{states}}}\n"
        (tmp_path / f"m{level}.yaml").write_text(text)
    (tmp_path / "m60.yaml").write_text("outcomes: [done]\nstates: {A: {state: wait}}\n")
    with pytest.raises(MissionFileError, match="inside of 50 mission files; expected fewer levels"):
        load(tmp_path / "m0.yaml")


def test_a_transition_from_an_unknown_outcome_is_told_with_its_line(file):
    text = "outcomes: [done, preempted]\nstates:\n  A: {state: wait, on: {dne: done}}\n"
    (problem,) = problems_of(file(text))
    place = "3:25: states.A.on.dne: "
    assert problem.startswith(f"{place}transition from an unknown outcome: got 'dne'")


@pytest.mark.parametrize(
    ("state", "problem"),
    [
        (
            "{state: wait, on: {done: [{when: x > 1, to: A}, {when: x > 2, to: B}, {to: done}]}}",
            "3:75: states.A.on.done[1].to: transition if 'x > 2' leads nowhere: got 'B'",
        ),
        (
            "{state: wait, on: {done: [{when: 5, to: A}, {to: done}]}}",
            "3:40: states.A.on.done[0].when: got 5; expected a text",
        ),
        ("{state: wait, resource: a b}", "3:27: states.A.resource: invalid resource name"),
    ],
)
def test_a_problem_of_a_state_has_the_place_of_its_value(file, state, problem):
    text = f"outcomes: [done, preempted]\ninput_keys: [x]\nstates: {{A: {state}}}\n"
    found = problems_of(file(text))
    assert [one[: len(problem)] for one in found] == [problem]


def test_a_link_to_itself_is_no_file(tmp_path, file):
    (tmp_path / "loop.yaml").symlink_to("loop.yaml")
    (problem,) = problems_of(file("outcomes: [done]\nstates: {A: {mission: loop.yaml}}\n"))
    assert problem.startswith("2:14: states.A.mission: got 'loop.yaml', which is no file")
    with pytest.raises(MissionFileError, match="symbolic links"):
        load(tmp_path / "loop.yaml")


def test_bytes_that_are_no_text_have_their_line(tmp_path):
    path = tmp_path / "latin.yaml"
    path.write_bytes("outcomes: [done]\nhelp: Fährt\n".encode("latin-1"))
    (problem,) = problems_of(path)
    assert problem.startswith("2:1: got no UTF-8")


# -- code --------------------------------------------------------------------------------------

NAMES_CODE = """\
outcomes: [enough, preempted]
userdata: {count: 0}
states:
  COUNT:
    state: some_states:Count
    on: {more: COUNT, enough: enough}
"""


@pytest.fixture
def with_code(file, tmp_path):
    shutil.copy(HERE / "own_states.py", tmp_path / "some_states.py")
    yield file
    sys.modules.pop("some_states", None)


def test_nothing_is_imported_before_it_runs(with_code):
    machine = load(with_code(NAMES_CODE))
    smachpy.describe(machine)
    assert check(machine).ok
    machine._repr_svg_()
    explore(machine)
    assert "some_states" not in sys.modules
    assert machine.execute() == "enough"
    assert "some_states" in sys.modules


def test_a_function_with_arguments_makes_a_state(with_code):
    text = "outcomes: [done, preempted]\nstates:\n  A: {state: 'some_states:step', with: {seconds: 7}, outcomes: [done, preempted]}\n"
    with mission_kit() as mission:
        assert mission(load(with_code(text))).duration == 7.0


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("some_states:Cont", "Did you mean 'Count'?"),
        ("some_states:NUMBER", "it is ready|expected none|made 3|got"),
        ("some_state:Count", "which is not in"),
        ("os:system", "which is not in .*Try --allow os"),
        ("smachpy.states:Wait", "Try --allow smachpy"),
        ("..some_states:Count", "which is not in"),
        (":Count", "got '', which is not in .*expected a module there.\nMore"),
        ("some_states:os.getcwd", "got 'os', which is not in .*Try --allow os"),
        ("some_states:State", "got 'smachpy.*which is not in .*Try --allow smachpy"),
        ("some_states:step.__globals__.clear", "got '__globals__'"),
    ],
)
def test_code_that_cannot_be_used_is_refused_before_anything_starts(with_code, name, problem):
    path = with_code(NAMES_CODE.replace("some_states:Count", name))
    with pytest.raises(
        (MissionFileError, ResolveError), match=f"5:5: states.COUNT.state: .*({problem})"
    ):
        load(path).execute()


def test_an_allowed_package_gives_only_its_own_code(file, tmp_path):
    arguments = f"with: {{path: '{tmp_path / 'made'}'}}"
    text = f"outcomes: [done]\nstates:\n  A: {{state: 'smachpy.base.log:logging.os.mkdir', {arguments}, on: {{done: done}}}}\n"
    with pytest.raises(MissionFileError, match="Try --allow logging"):
        load(file(text), allow=["smachpy"]).execute()
    assert not (tmp_path / "made").exists()


def test_an_allowed_package_may_be_named(file):
    text = "outcomes: [done, preempted]\nstates:\n  A: {state: 'smachpy.states:Wait', with: {seconds: 0}, outcomes: [done, preempted]}\n"
    path = file(text)
    assert load(path, allow=["smachpy"]).execute() == "done"
    assert load(path, to_run=False)["A"].get_registered_outcomes() == ("done", "preempted")
    with pytest.raises(ResolveError, match="Try --allow smachpy"):
        resolve(load(path, to_run=False))


def test_outcomes_that_the_code_does_not_have_are_refused(with_code):
    path = with_code(NAMES_CODE.replace("more: COUNT", "less: COUNT"))
    machine = load(path)
    with pytest.raises(ResolveError, match="less"):
        machine.execute()
    assert machine["COUNT"].get_registered_outcomes() == ("less", "enough")


def test_a_module_of_the_standard_library_is_not_taken_for_one_of_the_folder(file, tmp_path):
    (tmp_path / "json.py").write_text("loads = None\nraise SystemExit")
    text = NAMES_CODE.replace("some_states:Count", "json:loads")
    with pytest.raises(ResolveError, match=r"which is .* already"):
        load(file(text)).execute()


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("state: 'some_states:Cont'", "5:11: states.COUNT.state: .*Did you mean 'Count'?"),
        ("state: 'some_states:os.getcwd'", "5:11: states.COUNT.state: got 'os', which is not in"),
        ("state: 'some_states:State'", "5:11: states.COUNT.state: got 'smachpy', which is not in"),
        ("state: 'broken:Count'", "5:11: states.COUNT.state: got 'broken', which is no Python"),
        ("state: some_states", "5:11: states.COUNT.state: got 'some_states'; expected one of"),
        ("state: 'some_states:'", "5:11: states.COUNT.state: .*expected module:Name"),
        (
            "state: 'some_states:step', with: {second: 3}",
            "5:38: states.COUNT.with: some_states:step: .*Did you mean 'seconds'?",
        ),
    ],
)
def test_check_refuses_what_the_source_of_the_code_shows_without_running_it(
    with_code, tmp_path, text, problem
):
    (tmp_path / "broken.py").write_text("def (")
    path = with_code(f"outcomes: [done]\n\n\nstates:\n  COUNT: {{{text}, on: {{done: done}}}}\n")
    with pytest.raises(MissionFileError, match=problem):
        load(path)
    assert "some_states" not in sys.modules


def test_an_installed_module_in_the_place_of_one_of_the_folder_is_not_imported(file, tmp_path):
    (tmp_path / "antigravity").mkdir()  # a namespace: the module of Python comes before it
    shutil.copy(HERE / "own_states.py", tmp_path / "antigravity" / "states.py")
    machine = load(file(NAMES_CODE.replace("some_states", "antigravity.states")))
    with pytest.raises(ResolveError, match=r"which is .* already"):
        machine.execute()
    assert "antigravity" not in sys.modules


def test_an_object_of_a_class_of_elsewhere_is_not_called(with_code, tmp_path):
    path = with_code(NAMES_CODE.replace("some_states:Count", "callers:get"))
    (tmp_path / "callers.py").write_text("import operator\nget = operator.methodcaller('x')\n")
    with pytest.raises(ResolveError, match="Try --allow operator"):
        load(path).execute()
    sys.modules.pop("callers", None)


# -- other files -------------------------------------------------------------------------------


def test_another_mission_is_a_state_with_arguments(file):
    file(GOOD, "inner.yaml")
    outer = file(
        "outcomes: [done, preempted]\nstates:\n"
        "  IN: {mission: inner.yaml, with: {seconds: 1.0, last: 1}, on: {done: done}}\n",
        "outer.yaml",
    )
    with mission_kit() as mission:
        assert mission(load(outer)).duration == 5.0


def test_mistakes_in_another_mission_have_its_place(file):
    file("outcomes: [done]\nstates: {A: {state: wat}}\n", "inner.yaml")
    outer = file("outcomes: [done]\nstates:\n  IN: {mission: inner.yaml}\n", "outer.yaml")
    (problem,) = problems_of(outer)
    assert "inner.yaml:2:14: states.A.state" in problem


@pytest.mark.parametrize("name", ["../x.yaml", "/etc/passwd", "a/../../x.yaml", "link.yaml"])
def test_files_outside_of_the_folder_are_refused(file, tmp_path, name):
    (tmp_path / "link.yaml").symlink_to("/etc/hostname")
    text = f"outcomes: [done]\nstates:\n  A: {{mission: {name}}}\n"
    (problem,) = problems_of(file(text))
    assert "which is not in" in problem


@pytest.mark.parametrize("name", ['"a\\0b"', "a" * 5000])
def test_a_name_that_no_file_can_have_is_refused_with_its_place(file, name):
    (problem,) = problems_of(file(f"outcomes: [done]\nstates:\n  A: {{mission: {name}}}\n"))
    assert problem.startswith("3:7: states.A.mission: got a name of no file")


def test_a_plan_that_cannot_be_read_is_told_with_its_place(file):
    file("no net", "net.pnml")
    (problem,) = problems_of(file("outcomes: [done]\nstates:\n  A: {plan: net.pnml}\n"))
    assert problem.startswith("3:7: states.A.plan: ")
    assert "is no XML" in problem


@pytest.mark.parametrize("beside", ["plan", "mission"])
def test_the_code_of_a_plan_in_another_folder(file, tmp_path, monkeypatch, beside):
    """A module of this name beside the mission ran in place of the one beside the plan."""
    monkeypatch.delitem(sys.modules, "robot_of_plan", raising=False)
    (tmp_path / "plans").mkdir()
    file("actions: {goto: {run: 'robot_of_plan:goto'}}", "plans/actions.yaml")
    file("goto_x", "plans/go.plan")
    file("def goto(ud, place): return True", "robot_of_plan.py")
    if beside == "plan":
        file("def goto(ud, place): return True", "plans/robot_of_plan.py")
    path = file("outcomes: [goal, fail, preempted]\nstates:\n  P: {plan: plans/go.plan}\n")
    assert load(path).execute() == "goal"
    found = Path(sys.modules["robot_of_plan"].__file__)
    assert found.parent.name == ("plans" if beside == "plan" else tmp_path.name)


@pytest.mark.parametrize(
    ("entry", "problem"),
    [
        ("drive_to, with: {place: shelf, yaw: 1.5}", "drive_to: got place and yaw; expected one"),
        ("drive_to, with: {place: shelf, x: 1}", "drive_to: got place and x; expected one"),
        ("drive_to, with: {x: 1}", "drive_to: got neither place nor x and y"),
        (
            "publish, with: {topic: a, type: std_msgs/Bool, message: {}, latch: true, subscribers: 3}",
            "publish: got latch and subscribers: 3; expected one",
        ),
        (
            "publish, with: {topic: a, type: std_msgs/Bool, message: {}, latch: true, timeout: 60}",
            "latch, timeout: got both; expected one",
        ),
        (
            "action, with: {name: a, type: move_base_msgs/MoveBase, goal: {}, goal_key: shelf}",
            "action: got goal and goal_key; expected one",
        ),
        (
            "wait, with: {seconds: 5}, constants: {seconds: 7}",
            "states.A.constants.seconds: got 'seconds'; expected none: the state reads no key",
        ),
        (
            "service, with: {name: s, type: std_srvs/Trigger, succeeded_if: sucess}",
            "3:63: states.A.with.succeeded_if: field: got 'sucess'; .*Did you mean 'success'",
        ),
        (
            "monitor, with: {topic: b, type: std_msgs/Bool, valid_while: dta}",
            "states.A.with.valid_while: field: got 'dta'; .*Did you mean 'data'",
        ),
        (
            "await_message, with: {topic: b, type: std_msgs/Bool, until: m.data and dta}",
            "states.A.with.until: field: got 'dta'",
        ),
    ],
)
def test_what_has_no_effect_or_names_no_field_is_refused(file, entry, problem):
    (found,) = problems_of(
        file(f"outcomes: [done]\nstates:\n  A: {{state: {entry}}}\nuserdata: {{shelf: {{}}}}\n")
    )
    assert re.search(problem, found), found


@pytest.mark.parametrize("more", ["latch: true", "latch: true, subscribers: 0", "subscribers: 3"])
def test_publish_waits_for_subscribers_or_latches(file, more):
    text = f"{{state: publish, with: {{topic: a, type: std_msgs/Bool, message: {{}}, {more}}}}}"
    load(file(f"outcomes: [succeeded, aborted, preempted]\nstates:\n  A: {text}\n"))


def test_options_that_are_set_before_the_code_is_imported_are_kept(file, tmp_path):
    """The stand-in had them, and the state that took its place had not."""
    shutil.copy(HERE / "own_states.py", tmp_path / "states_of_options.py")
    text = "outcomes: [done, late]\nstates:\n  A: {state: states_of_options:Up, retry: {attempts: 3, on: [a]}, on: {a: done, b: A}}\n"
    machine = load(file(text))
    smachpy.set_options(machine["A"], timeout=2.0, timeout_outcome="late", resource="base")
    resolve(machine)
    options = smachpy.get_options(machine["A"])
    assert (options.timeout, options.resource, options.retry.attempts) == (2.0, Resource("base"), 3)
    assert "late" in machine["A"].get_registered_outcomes()
    assert "timeout: 2.0" in smachpy.files.write(machine)


def test_parameters_in_retry_and_resource(file):
    """They were told to be no numbers."""
    text = """outcomes: [done, preempted]
parameters: {n: {type: whole, default: 3}, base: {default: arm}}
states:
  A:
    state: wait
    retry: {attempts: "${n}", on: [done]}
    resource: {name: "${base}", policy: wait}
"""
    options = smachpy.get_options(load(file(text))["A"])
    assert (options.retry.attempts, options.resource.name) == (3, "arm")
    (problem,) = problems_of(file(text.replace("default: 3", "default: 0")))
    assert "retry.attempts" in problem or "states.A.retry" in problem


def test_stop_others_names_states_of_the_concurrence(file):
    text = "outcomes: [done, preempted]\nstates:\n  A: {concurrence: {outcomes: [done, preempted], default_outcome: done, stop_others: [LET], states: {LEFT: {state: wait}}}}\n"
    (problem,) = problems_of(file(text))
    assert problem.startswith("3:73: states.A.concurrence.stop_others: ")
    assert "got 'LET'" in problem


INNER = "{outcomes: [done, preempted], states: {B: {state: wait, with: {seconds: 1}}}}"


@pytest.mark.parametrize(
    ("states", "problem"),
    [
        (f"A: {{machine: {INNER}, timeout: 5}}", "states.A.timeout: got it beside 'machine'"),
        (f"A: {{machine: {INNER}, outcomes: [x]}}", "states.A.outcomes: got it beside 'machine'"),
        (f"A: {{machine: {INNER}, with: {{x: 1}}}}", "states.A.with: got an unknown field"),
        ("A: {plan: x.pnml, with: {x: 1}}", "states.A.with: got an unknown field"),
        (
            f"A: {{concurrence: {{default_outcome: done, {INNER[1:-3]}, constants: {{x: 1}}}}}}}}}}",
            "states.A.concurrence.states.B.constants: got an unknown field",
        ),
        (
            f"A: {{sequence: {{connector: done, {INNER[1:-3]}, constants: {{x: 1}}}}}}}}}}",
            "states.A.sequence.states.B.constants: got an unknown field",
        ),
        (
            "A: {iterator: {outcomes: [done, preempted], items: [1], each: {B: {state: wait, on: {done: done}}}}}",
            "states.A.iterator.each.B.on: got an unknown field",
        ),
        ("A: {state: wait, help: [1]}", "states.A.help: got [1]; expected a text"),
        ('"A\\nB": {state: wait}', "got 'A\\nB'; expected no control characters"),
        ("A: {mission: .}", "states.A.mission: got '.', which is no file; expected one of []."),
    ],
)
def test_what_would_have_no_effect_is_refused(file, states, problem):
    found = problems_of(file(f"outcomes: [done, preempted]\nstates:\n  {states}\n"))
    assert any(problem in one for one in found), found


@pytest.mark.parametrize(
    ("state", "problem"),
    [
        (
            "state: wait, with: {seconds: -1}",
            "3:27: states.A.with.seconds: got -1.0; expected seconds",
        ),
        ("state: wait, with: {seconds: 1}, timeout: soon", "3:40: states.A.timeout: got 'soon'"),
        (
            "state: ask, with: {question: 3}",
            "3:19: states.A.with: question: got 3; expected a text.",
        ),
        (
            "state: service, with: {name: x, type: 3}",
            "3:23: states.A.with: type: got 3; expected a text.",
        ),
    ],
)
def test_a_wrong_argument_has_its_own_place(file, state, problem):
    (found,) = problems_of(file(f"outcomes: [done, preempted]\nstates:\n  A: {{{state}}}\n"))
    assert found.startswith(problem)


def test_what_would_have_no_effect_in_a_clean_up_is_refused(file):
    text = "outcomes: [done, preempted]\nstates: {A: {state: wait}}\ncleanup: {C: {state: wait, on: {done: done}}}\n"
    (problem,) = problems_of(file(text))
    assert "cleanup.C.on: got an unknown field" in problem


def test_an_iterator_reads_the_key_of_its_items(file):
    text = """\
outcomes: [done, preempted]
userdata: {places: [a, b, c]}
states:
  ALL:
    iterator:
      outcomes: [done, preempted]
      items_from: places
      each: {ONE: {state: wait, with: {seconds: 1}}}
"""
    with mission_kit() as mission:
        assert mission(load(file(text))).duration == 3.0
    assert load(file(text))["ALL"].get_registered_input_keys() == ("places",)


# -- hostile texts -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "a: &a [*a]",
        "\n".join(
            [
                "a0: &a0 [x]",
                *(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 9)),
            ]
        ),
        "outcomes: !!python/object/apply:os.system ['touch evil']\nstates: {}",
        "outcomes: [done]\nstates: {A: {state: wait, on: {done: [{when: '().__class__', to: done}, {to: done}]}}}",
        "outcomes: [done]\nstates: {A: {state: wait, on: {done: [{when: '9**9**9', to: done}, {to: done}]}}}",
        "outcomes: 3\nstates: x",
        "outcomes: [done]\nstates: {A: 3, B: [], C: null}",
        "outcomes: [done]\nstates: {A: {machine: 3}, B: {concurrence: []}, C: {iterator: null}}",
        "{" * 5000,
        "\x00",
    ],
)
def test_hostile_texts_are_refused(file, tmp_path, text):
    assert problems_of(file(text))
    assert not (tmp_path / "evil").exists()


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("name: X\noutcomes: [a\x00]\n", "2:13: not YAML: the character '\\x00' is not allowed."),
        ("name: X\nstates:\n  A: 1\n  A: 2\n", "4:3: not YAML: found duplicate key"),
        ("name: X\nn: " + "9" * 5000, "2:4: not YAML: got a number of 5,000 characters"),
        ("name: X\nn: 0x" + "f" * 5000, "2:4: not YAML: got a number of 5,002 characters"),
        ("name: X\nn: " + "[" * 300, "2:204: not YAML: it is nested too deeply"),
        ("name: X\na: &a [*a]", "2:4: not YAML: a value contains itself"),
        ("name: X\na: !x 1", "2:4: not YAML: could not determine a constructor"),
    ],
)
def test_what_is_no_yaml_has_its_place(file, text, problem):
    (found,) = problems_of(file(text))
    assert found.startswith(problem)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(MissionFileError, match="No such file"):
        load(tmp_path / "none.yaml")


@pytest.mark.parametrize(
    ("given", "resource"),
    [
        ("base", Resource("base")),
        ("{name: base}", Resource("base")),
        ("{name: /robot/arm, policy: preempt}", Resource("/robot/arm", "preempt")),
    ],
)
def test_resources(tmp_path, given, resource):
    path = tmp_path / "m.yaml"
    path.write_text(
        "name: M\noutcomes: [done, preempted]\nstates:\n"
        f"  A: {{state: wait, with: {{seconds: 1}}, resource: {given}}}\n"
    )
    assert get_options(load(path)["A"]).resource == resource


@pytest.mark.parametrize("given", ["'a b'", "{name: base, policy: steal}", "{policy: wait}", "7"])
def test_wrong_resources_have_a_line(tmp_path, given):
    path = tmp_path / "m.yaml"
    path.write_text(
        "name: M\noutcomes: [done, preempted]\nstates:\n"
        f"  A: {{state: wait, with: {{seconds: 1}}, resource: {given}}}\n"
    )
    with pytest.raises(MissionFileError, match=r"m\.yaml:4:\d+: .*resource"):
        load(path)
