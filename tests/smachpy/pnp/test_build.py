"""Plans built in Python and read from PNP's text forms: what they do when they run."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from smachpy.command import main
from smachpy.exceptions import InvalidStateError
from smachpy.pnp import (
    PetriNetPlan,
    PlanError,
    action,
    check_plan,
    choose,
    fork,
    go_to,
    loop,
    mark,
    parse_pddl,
    parse_plan,
    parse_rules,
    sense,
    understand,
)


def ran(net, clock, seconds=None, posts=(), conditions=None):
    """Return the plan's outcome and what its actions did, with the time."""
    import smachpy

    log = []
    seconds = seconds or {}

    def act(name):
        def run(ud):
            log.append((name, round(clock.now(), 3)))
            stopped = smachpy.current_state().sleep(float(seconds.get(name, 1.0)))
            if stopped:
                log.append((f"{name}!", round(clock.now(), 3)))
                return "preempted"
            return None

        return run

    names = [n for n in understand(net).executables if not n.startswith("wait_")]
    plan = PetriNetPlan(net, {name: act(name) for name in names}, conditions)
    for at, event in posts:
        clock.call_later(at, lambda event=event: plan.post(event))
    return plan.execute(), log


def clean(net):
    return [p.rule for p in check_plan(understand(net)) if p.severity != "note"]


def test_a_sequence(clock):
    net = action("goto", "kitchen").then(action("say", "hi")).net("fetch")
    assert ran(net, clock) == ("goal", [("goto_kitchen", 0.0), ("say_hi", 1.0)])
    assert clean(net) == []


def test_robots_and_numbers_are_part_of_the_name():
    (place,) = [p for p in action("wait", 5, robot="r1").net().places if "exec" in p.name]
    assert place.name == "r1#wait_5.exec"


def test_sensing(clock):
    net = sense(action("look"), {"seen": action("grasp"), "not seen": None}).net()
    assert ran(net, clock, conditions={"seen": True})[1][-1][0] == "grasp"
    assert clean(net) == []


@pytest.mark.parametrize(("door", "expected"), [(True, "go"), (False, "knock")])
def test_a_choice(clock, door, expected):
    net = choose({"open": action("go"), "not open": action("knock")}).net()
    assert ran(net, clock, conditions={"open": door}) == ("goal", [(expected, 0.0)])


def test_a_fork(clock):
    net = fork(action("a").then(action("b")), action("c")).then(action("d")).net()
    outcome, log = ran(net, clock, {"c": 5})
    assert outcome == "goal"
    assert log[-1] == ("d", 5.0)
    assert sorted(log[:2]) == [("a", 0.0), ("c", 0.0)]
    assert clean(net) == []


def test_a_loop(clock):
    laps = []
    net = loop(action("lap"), until="tired").then(action("rest")).net()
    outcome, log = ran(
        net, clock, conditions={"tired": lambda ud: laps.append(1) or len(laps) >= 3}
    )
    assert (outcome, [name for name, _ in log]) == ("goal", ["lap", "lap", "lap", "rest"])


@pytest.mark.parametrize(
    ("then", "names", "outcome"),
    [
        ("restart_action", ["a", "a!", "r", "a", "b"], "goal"),
        ("skip_action", ["a", "a!", "r", "b"], "goal"),
        ("restart_plan", ["a", "a!", "r", "a", "b"], "goal"),
        ("fail_plan", ["a", "a!", "r"], "fail"),
        ("goal", ["a", "a!", "r"], "goal"),
        ("GOTO_late", ["a", "a!", "r", "b"], "goal"),
    ],
)
def test_an_interrupt(clock, then, names, outcome):
    net = action("a").interrupt("c", action("r"), then=then).then(mark("late"), action("b")).net()
    found, log = ran(net, clock, {"a": 5}, posts=[(2.0, "c")])
    assert found == outcome
    assert sorted(name for name, _ in log) == sorted(names)
    assert clean(net) == []


@pytest.mark.parametrize("seconds", [4, 1234567.5, 123456.7, 1e-7])
def test_a_limit(clock, seconds):
    net = action("a").within(seconds).net()
    assert ran(net, clock, {"a": 1e8})[0] == "goal"
    assert clock.now() == seconds
    assert clean(net) == []


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: action("a b"),
        lambda: action(""),
        lambda: action("a").interrupt("a and b"),
        lambda: action("a").interrupt("c", then="restart"),
        lambda: action("a").within(float("nan")),
        lambda: action("a").then("b"),
        lambda: choose({}),
        lambda: choose({"c": 5}),
        lambda: action("a").then(go_to("nowhere")).net(),
        lambda: mark("x").net(),
        lambda: mark("x").then(mark("x"), action("a")).net(),
        lambda: fork(action("a"), go_to("goal")).net(),
        lambda: loop(action("a"), until="!"),
    ],
)
def test_what_is_wrong_is_refused(wrong):
    with pytest.raises(InvalidStateError, match="got"):
        wrong()


# -- text forms --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("a; b; c", ["a", "b", "c"]),
        ("a b\nc", ["a", "b", "c"]),
        ("goto_x; # away\nsay_hi;", ["goto_x", "say_hi"]),
        ("a; <c? b : (not c)? d>; e", ["a", "b", "e"]),
        ("a; <not c? b : c? >; e", ["a", "e"]),
        ("{a; b;} || {d;}; e", ["a", "b", "d", "e"]),
        ("a; GOTO_LABEL1; b; LABEL1; e", ["a", "e"]),
        ("longname_a || longname_b", ["longname_a", "longname_b"]),
        ("a|2; b", ["a", "b"]),
        ("<c? {a; <c? b : not c? d>} : not c? e>", ["a", "b"]),
    ],
)
def test_plans_as_text(clock, text, names):
    outcome, log = ran(parse_plan(text), clock, conditions={"c": True})
    assert outcome == "goal"
    assert sorted(name for name, _ in log) == sorted(names)


def test_inline_rules(clock):
    net = parse_plan("a; ! *if* c *do* r; restart_action !; b")
    outcome, log = ran(net, clock, {"a": 5}, posts=[(2.0, "c")])
    assert (outcome, sorted(n for n, _ in log)) == ("goal", ["a", "a", "a!", "b", "r"])


def test_execution_rules(clock):
    rules = parse_rules(
        "# comment\n*if* c *during* goto *do* r_1; skip_action\n"
        "*if* action_failed *during* say *do* fail_plan\n\n"
    )
    assert [(one.action, one.rule.last) for one in rules] == [
        ("goto", "skip_action"), ("say", "fail_plan"),
    ]  # fmt: skip
    outcome, log = ran(parse_plan("goto_x; say_y", rules), clock, {"goto_x": 5}, [(2.0, "c")])
    assert (outcome, sorted(n for n, _ in log)) == ("goal", ["goto_x", "goto_x!", "r_1", "say_y"])


@pytest.mark.parametrize("parse", [parse_plan, parse_pddl])
def test_a_rule_for_no_action_of_the_plan_warns(parse):
    """It vanished."""
    rules = parse_rules("*if* obstacle *during* gto *do* goal\n*if* b *during* goto *do* goal")
    text = "goto_x; wait_1" if parse is parse_plan else "(goto x)\n(wait 1)"
    with pytest.warns(UserWarning, match="rule for 'gto': .*Did you mean 'goto'") as warned:
        parse(text, rules)
    assert len(warned) == 1


def test_pddl(clock):
    net = parse_pddl("(goto kitchen)\n# comment\n0.0: (say hello you) [1.0]\n")
    assert [name for name, _ in ran(net, clock)[1]] == ["goto_kitchen", "say_hello_you"]


@pytest.mark.parametrize(
    ("text", "line"),
    [("a; <c? b", 1), ("a;\nb; }", 2), ("a\n<c b>", 2), ("", 0), ("a; ! *if* c !", 1),
     ("! *if* c *do* goal !", 1), ("a\n! *if* c *do* r !", 2), ("a; GOTO_LABEL9", 0),
     ("<a and b? c>", 1), ("a ||", 1), ("{" * 80, 1), ("a|x", 1), ("a\n!", 2)],
)  # fmt: skip
def test_wrong_texts(text, line):
    with pytest.raises(PlanError) as caught:
        parse_plan(text, file="x.plan")
    assert caught.value.found[0].line == line


@pytest.mark.parametrize(
    "text",
    [
        "*if* c *while* a *do* goal",
        "*if* c *during* a *do* r",
        "nonsense",
        "*if* ! *during* a *do* goal",
    ],
)
def test_wrong_rules(text):
    with pytest.raises(PlanError) as caught:
        parse_rules(f"# one\n{text}")
    assert caught.value.found[0].line == 2


@given(st.text(alphabet="ab;<>{}:?!|*# \nLGOT_c1", max_size=40))
def test_any_text(text):
    try:
        net = parse_plan(text)
    except PlanError:
        return
    check_plan(understand(net))


def test_a_text_plan_on_the_command_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tour.plan").write_text("wait_1; wait_2\n")
    assert main(["check", "tour.plan"]) == 0
    assert main(["run", "tour.plan", "--time", "virtual", "--plain"]) == 0
    assert "goal after 3.00 s" in capsys.readouterr().out
    (tmp_path / "tour.er").write_text("*if* c *during* wait *do* nothing\n")
    assert main(["check", "tour.plan"]) == 2
    assert "tour.er:1" in capsys.readouterr().err
