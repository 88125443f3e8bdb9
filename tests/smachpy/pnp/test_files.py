"""Plans on the command line: loaded with what belongs to them, checked, run, drawn; bad ones refused."""

import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

import smachpy
from smachpy.command import main
from smachpy.exceptions import InconsistentMachineError
from smachpy.pnp import (
    PlanError,
    explore,
    load,
    load_plan,
    parse_plan,
    parse_pnml,
    pnml_text,
    write_pnml,
)
from smachpy.pnp.mapping import read_mapping
from tests.smachpy.pnp.nets import net_of

FETCH = """
init* -> goto_kitchen.exec : goto_kitchen.start
goto_kitchen.exec -> there : goto_kitchen.end
goto_kitchen.exec -> blocked : goto_kitchen.interrupt [obstacle]
blocked -> wait_5.exec : wait_5.start
wait_5.exec -> init : wait_5.end
there -> goal : done
"""

MAPPING = """
actions:
  goto:
    action: move_base
    type: move_base_msgs/MoveBase
    goal: {target_pose.header.frame_id: map}
    cases:
      kitchen: {target_pose.pose.position.x: "4"}
conditions:
  obstacle: false
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_pnml(net_of(FETCH, "fetch"), "fetch.pnml")
    Path("actions.yaml").write_text(MAPPING)
    return tmp_path


def test_check_run_and_render(folder, capsys):
    Path("actions.yaml").write_text("actions:\n  goto: {run: 'fetch_robot:goto'}\n")
    Path("fetch_robot.py").write_text("def goto(ud, place): print('to', place)\n")
    assert main(["check", "fetch.pnml"]) == 0
    assert main(["run", "fetch.pnml", "--time", "virtual", "--plain"]) == 0
    assert "to kitchen" in capsys.readouterr().out
    for name in ("fetch.txt", "fetch.mmd", "fetch.dot", "fetch.json"):
        assert main(["render", "fetch.pnml", "-o", name]) == 0
    assert "goto_kitchen" in Path("fetch.txt").read_text()


def test_what_a_rule_says_in_vain_is_a_warning(folder):
    Path("tour.plan").write_text("goto_x; goto_y")
    Path("tour.er").write_text("# a rule\n*if* obstacle *during* goto *do* goal *x* 3\n")
    (problem,) = load("tour.plan").problems
    assert (problem.severity, problem.line, problem.file) == ("warning", 2, "tour.er")
    assert "*x* 3" in problem.message


@pytest.mark.parametrize("ending", ["plan", "pddlout"])
def test_a_rule_for_no_action_of_the_plan_is_a_warning(folder, ending):
    """It vanished; the robot drove on past the obstacle."""
    text = "goto_x; wait_1"
    Path(f"tour.{ending}").write_text("(goto x)" if ending == "pddlout" else text)
    rules = [
        "*if* obstacle *during* gto *do* say_hi; goal",
        "*if* obstacle *during* goto *do* goal",
    ]
    Path("tour.er").write_text("\n".join(rules))
    (wrong,) = load(f"tour.{ending}", {"goto": print, "say": print}).problems
    assert (wrong.rule, wrong.severity, wrong.line, wrong.file) == (
        "unmatched", "warning", 1, "tour.er")  # fmt: skip
    assert "got 'gto'" in wrong.message
    assert "Did you mean 'goto'?" in wrong.message


def test_the_code_of_another_folder_is_not_run(tmp_path, monkeypatch):
    """The second plan ran the first one's `goto`."""
    monkeypatch.delitem(sys.modules, "robot_of_two", raising=False)
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "go.plan").write_text("goto_x")
        (tmp_path / name / "actions.yaml").write_text(
            "actions:\n  goto: {run: 'robot_of_two:goto'}"
        )
        (tmp_path / name / "robot_of_two.py").write_text("def goto(ud, place): pass\n")
    load_plan(tmp_path / "a" / "go.plan")
    with pytest.raises(PlanError, match=r"b.actions.yaml:2: .*a.robot_of_two.py already"):
        load_plan(tmp_path / "b" / "go.plan")
    assert load_plan(tmp_path / "a" / "go.plan").execute() == "goal"


def test_the_picture_is_the_net(folder):
    assert main(["render", "fetch.pnml", "-o", "fetch.svg"]) == 0
    ids = {e.get("id") for e in ET.parse("fetch.svg").iter() if e.get("id")}
    assert {"/fetch/goto_kitchen", "/fetch/p0", "/fetch/t2"} <= ids


def test_goals_are_typed_by_their_fields(folder):
    plan = load_plan("fetch.pnml")
    state = plan["goto_kitchen"]
    assert plan.find_problems("") == ()
    assert dict(state.describe_details()[1])["action"] == "move_base"


def test_a_condition_of_two_kinds_is_refused(folder):
    """All but one of them had no effect."""
    text = MAPPING + "  low: {userdata: x > 0, topic: battery, every: 0.5}\n"
    Path("actions.yaml").write_text(text)
    with pytest.raises(PlanError) as caught:
        read_mapping("actions.yaml")
    assert [problem.element for problem in caught.value.found] == [
        "conditions.low.userdata", "conditions.low.every"]  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "text", "line"),
    [
        ("kitchen:", "bedroom:", "kitchen", 0),
        ('"4"', '"four"', "expected float", 0),
        ("position.x", "position.xx", "xx", 0),
        ("move_base_msgs/MoveBase", "move_base_msgs/Move", "type", 5),
        ("cases:", "case:", "Did you mean", 7),
        ("  goto:", "  say: {run: 'math:pi'}\n  goto:", "which is 3.14", 3),
        ("obstacle: false", "obstacle: {userdata: 'f(x)'}", "this call is not allowed", 10),
        ("obstacle: false", "obstacle: {topic: b, type: std_msgs/Bool, when: 'dta'}", "Did you mean 'data'", 10),
        ("obstacle: false", "obstacle: {}", "expected true, false", 10),
        ("actions:", "action:", "Did you mean", 2),
        ("obstacle: false", "obstacle: {run: 'nowhere_x:f'}", "nowhere_x", 10),
        ("obstacle: false", "obstacle: [", "YAML", 0),
    ],
)  # fmt: skip
def test_a_wrong_mapping_is_told_and_nothing_runs(folder, capsys, old, new, text, line):
    assert old in MAPPING
    Path("actions.yaml").write_text(MAPPING.replace(old, new))
    assert main(["run", "fetch.pnml"]) == 2
    err = capsys.readouterr().err
    assert text in err
    assert "Traceback" not in err
    if line:
        with pytest.raises(PlanError) as caught:
            read_mapping("actions.yaml")
        assert line in {problem.line for problem in caught.value.found}


@pytest.mark.parametrize("data", [b"", b"<pnml>", b"\xff\xfe", b"<pnml/>", b"actions"])
@pytest.mark.parametrize("command", [["check"], ["run"], ["render", "-o", "x.svg"]])
def test_bad_files_end_with_2(folder, capsys, data, command):
    Path("fetch.pnml").write_bytes(data)
    assert main([command[0], "fetch.pnml", *command[1:]]) == 2
    err = capsys.readouterr().err
    assert "fetch.pnml" in err
    assert "Traceback" not in err
    assert not Path("x.svg").exists()


def test_no_such_file(folder, capsys):
    assert main(["check", "fetsh.pnml"]) == 2
    assert "Did you mean 'fetch.pnml'" in capsys.readouterr().err


def test_an_unknown_action_is_told_with_its_line(folder, capsys):
    Path("actions.yaml").write_text("actions:\n  goto_: {run: 'os:getcwd'}\n")
    assert main(["check", "fetch.pnml"]) == 1
    out = capsys.readouterr().out
    assert "fetch.pnml:" in out
    assert "net-unbound" in out
    assert main(["run", "fetch.pnml"]) == 2


@pytest.mark.parametrize(
    ("action", "guard", "code", "found"),
    [
        ("wait_1", "true", 0, ""),
        ("wait_1", "not timeout_wait_1", 0, ""),
        ("wait_1", "equal_@x_1", 0, ""),
        ("wait_1", "trueheading", 0, "has to post: trueheading. [net-condition]"),
        ("wait_soon", "c", 1, "wait_soon: got 'soon'; expected seconds, as in wait_5"),
        ("goto_wait", "c", 0, "expected one for each of goto."),
    ],
)
def test_names_that_are_built_in(folder, capsys, action, guard, code, found):
    """The program was to post `true`, and an action for `wait` was to be registered."""
    net = net_of(f"init* -> {action}.exec : start\n{action}.exec -> goal : end [{guard}]", "built")
    write_pnml(net, "built.pnml")
    Path("actions.yaml").unlink()
    assert main(["check", "built.pnml"]) == code
    out = capsys.readouterr().out
    assert found in out
    assert found or "note" not in out


def test_an_action_that_might_be_built_in_is_a_note_while_nothing_is_registered(folder, capsys):
    text = "init* -> {0}.exec : start\n{0}.exec -> m : end\nm -> {1}.exec : start\n{1}.exec -> goal : end"
    write_pnml(net_of(text.format("goto_a", "wait_here"), "built"), "built.pnml")
    Path("actions.yaml").unlink()
    assert main(["check", "built.pnml"]) == 0
    assert "note: /built: place 'p3' (wait_here.exec): wait_here: got" in capsys.readouterr().out


def test_sub_plans(folder):
    ran = []
    write_pnml(
        net_of("init* -> goto_a.exec : start\ngoto_a.exec -> goal : end", "sub"), "tour.pnml"
    )
    write_pnml(
        net_of("init* -> tour.exec : tour.start\ntour.exec -> goal : tour.end", "main"), "main.pnml"
    )
    plan = load("main.pnml", {"goto": lambda ud, place: ran.append(place)})
    assert plan.execute() == "goal"
    assert ran == ["a"]
    assert [s.path for s in smachpy.describe(plan).walk()] == [
        "/main",
        "/main/tour",
        "/main/tour/goto_a",
    ]


def test_recursion_is_an_error(folder, capsys):
    for one, other in (("a", "b"), ("b", "a")):
        write_pnml(
            net_of(f"init* -> {other}.exec : start\n{other}.exec -> goal : end", one), f"{one}.pnml"
        )
    with pytest.raises(PlanError) as caught:
        load("a.pnml")
    assert [problem.rule for problem in caught.value.found] == ["recursion"]
    assert caught.value.found[0].line > 0
    assert main(["check", "a.pnml"]) == 2


def test_a_plan_is_loaded_without_the_network():
    code = (
        "import sys; from smachpy import pnp; "
        "assert not {'zenoh', 'numpy', 'rosbags'} & set(sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_plan_with_a_wrong_condition_is_drawn_and_checked_but_not_run(tmp_path, capsys):
    file = tmp_path / "wrong.pnml"
    net = net_of("init* -> A.exec : A.start\nA.exec -> goal : A.end [and c]")
    write_pnml(net, file)
    with pytest.raises(PlanError) as caught:
        load_plan(file)
    assert len(caught.value.problems) == 1
    plan = load_plan(file, to_run=False)
    assert plan.plan.net.transitions[1].name == "A.end [and c]"
    with pytest.raises(InconsistentMachineError):
        plan.execute()
    assert main(["check", str(file)]) == 1
    out = capsys.readouterr().out
    assert out.count("net-label") == 1
    assert "inconsistent" not in out
    assert main(["run", str(file), "--time", "virtual"]) == 2


def test_an_arc_that_moves_no_token_is_left_out_with_a_warning():
    text = pnml_text(net_of("init* -> goal : t"))
    at = text.index("<arc")
    arc = '<arc id="zero" source="p0" target="t0"><inscription><value>0</value></inscription></arc>'
    net, problems = parse_pnml(text[:at] + arc + text[at:])
    assert len(net.arcs) == 2
    assert {problem.severity for problem in problems} == {"warning"}


@pytest.mark.parametrize("goto", ["GOTO LABEL1", "GOTO_LABEL1"])
def test_a_blank_may_stand_in_a_jump(goto):
    net = parse_plan(f"LABEL1; a; < again ? {goto} : done ? b >")
    same = parse_plan("LABEL1; a; < again ? GOTO_LABEL1 : done ? b >")
    assert len(explore(net).came) == len(explore(same).came)
    rule = parse_plan(f"LABEL1; a; b; ! *if* c *do* {goto} !")
    assert any("b.interrupt [c]" in each.name for each in rule.transitions)


def test_a_rule_without_marks_ends_at_the_semicolon():
    marked = parse_plan("a; ! *if* c *do* skip_action !; b")
    assert parse_plan("a; *if* c *do* skip_action; b").transitions == marked.transitions
