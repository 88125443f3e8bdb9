"""The plugin in test sessions of its own: fixtures, options, coverage, xdist."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import smachpy
from smachpy.command import main
from smachpy.testing import MissionTestCase, mission_kit, session
from smachpy.testing import cli as testing_cli
from smachpy.testing.coverage import Coverage

pytest_plugins = ["pytester"]

# Most of these start further Pythons, which a busy computer takes its time for.
pytestmark = pytest.mark.timeout(900)

TESTS = """
import pytest
from smachpy import CBState, State, StateMachine

class Wait(State):
    def __init__(self):
        super().__init__(["done", "failed", "preempted"])
    def execute(self, ud):
        return "preempted" if self.sleep(10) else "done"

def machine():
    sm = StateMachine(["done", "failed", "preempted"], name="M")
    with sm:
        sm.add("A", Wait(), {"done": "B"})
        sm.add("B", Wait())
    return sm

def test_done(mission):
    mission(machine()).assert_outcome("done")

@pytest.mark.parametrize("state", ["A", "B"])
def test_preempt(mission, state):
    mission.preempt(on=state)
    mission(machine()).assert_outcome("preempted")
"""

OPTIONS = ["-p", "no:cacheprovider"]
ALIAS = "import sys; from smachpy.command import main; sys.exit(main(sys.argv[1:]))"


def test_the_fixtures_need_no_conftest(pytester):
    pytester.makepyfile(TESTS)
    pytester.runpytest_inprocess(*OPTIONS).assert_outcomes(passed=3)


def test_pytest_takes_no_imported_interface_for_a_test_class(pytester):
    pytester.makepyfile("""
from actionlib_core.interfaces import define_service
from actionlib_core.interfaces.actionlib.msg import TestAction, TestFeedback, TestGoal
from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose as TestNavigation

TestService = define_service("test_msgs/TestService", "---\\n")
from actionlib_core.interfaces.ros2.std_srvs.srv import Trigger as TestTrigger

def test_it(mission, action_server):
    action_server("dig", TestAction)
""")
    result = pytester.runpytest_inprocess(*OPTIONS, "-W", "error")
    result.assert_outcomes(passed=1, warnings=0)


@pytest.mark.parametrize("workers", [[], ["-n", "1"]])
def test_an_exploration_that_a_limit_has_ended_is_in_the_summary(pytester, workers):
    pytester.makepyfile(
        TESTS
        + """
def test_cut(mission):
    mission.explore(machine, max_runs=2).assert_ok()

def test_all(mission):
    assert mission.explore(machine).exhaustive
"""
    )
    result = pytester.runpytest_inprocess(*OPTIONS, *workers, "-k", "cut or all")
    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(
        ["*explorations that did not try everything*",
         "*::test_cut: /M: explored 2 runs, not all there are: max_runs"]
    )  # fmt: skip
    assert "test_all: " not in result.stdout.str()


def test_pytest_does_not_parse_the_packages_of_the_plugin(pytester, monkeypatch):
    """What it parses for its asserts while a thread of ours parses fails in Python 3.11."""
    monkeypatch.setenv("PYTHONPATH", str(Path(smachpy.__file__).parents[1]))  # as installed
    pytester.makepyfile(
        """
        def test_loader():
            import smachpy.checks.source as module
            assert type(module.__loader__).__name__ == "SourceFileLoader"
        """
    )
    pytester.runpytest_subprocess(*OPTIONS).assert_outcomes(passed=1)


def test_a_failing_assertion_shows_the_diff_and_not_our_code(pytester):
    pytester.makepyfile(
        TESTS + "\n\ndef test_path(mission):\n    mission(machine()).assert_path(['B'])\n"
    )
    result = pytester.runpytest_inprocess(*OPTIONS)
    result.assert_outcomes(passed=3, failed=1)
    result.stdout.fnmatch_lines(
        ["*AssertionError: path (- expected, + got):", "*+ /M/A", "*picture: *M-1.svg"]
    )


def test_coverage_table_and_json(pytester):
    pytester.makepyfile(TESTS)
    result = pytester.runpytest_inprocess(
        *OPTIONS,
        "--mission-coverage",
        "--mission-coverage-json=c.json",
        "--mission-coverage-html=c.html",
    )
    assert result.ret == 0
    result.stdout.fnmatch_lines(
        ["*mission coverage*", "machine*runs*states*preempts*", "/M *3 *3/3*2/2*"]
    )
    result.stdout.fnmatch_lines(["*outcomes not run: */M/A -failed->*"])
    (machine,) = json.loads((pytester.path / "c.json").read_text())["machines"]
    assert machine["runs"] == 3
    assert machine["states"] == {
        "run": 3,
        "total": 3,
        "missed": [],
        "times": {"/M/A": 3, "/M/B": 2, "/M": 3},
    }
    assert machine["preempts"]["run"] == 2
    page = (pytester.path / "c.html").read_text()
    assert "<svg" in page
    assert "/M/A" in page


@pytest.mark.parametrize(("least", "code"), [(50, 0), (90, 1)])
def test_coverage_fail_under(pytester, least, code):
    pytester.makepyfile(TESTS)
    result = pytester.runpytest_inprocess(*OPTIONS, f"--mission-coverage-fail-under={least}")
    assert result.ret == code
    if code:
        result.stdout.fnmatch_lines(
            [f"FAIL mission coverage: /M: * %; expected at least {least} %"]
        )


def test_coverage_of_nothing_fails(pytester):
    pytester.makepyfile("def test_nothing(): pass")
    result = pytester.runpytest_inprocess(*OPTIONS, "--mission-coverage-fail-under=1")
    assert result.ret == 1
    result.stdout.fnmatch_lines(["no mission ran"])


def test_coverage_is_merged_over_workers(pytester, monkeypatch):
    # Without the other plugins here a worker starts in a fifth of the time.
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    pytester.makepyfile(TESTS)
    result = pytester.runpytest_inprocess(
        *OPTIONS,
        *("-p", "xdist", "-p", "smachpy.testing.plugin"),
        *("-n", "1", "--mission-coverage", "--mission-coverage-json=c.json"),
    )
    assert result.ret == 0
    (machine,) = json.loads((pytester.path / "c.json").read_text())["machines"]
    assert machine["runs"] == 3
    assert machine["preempts"]["run"] == 2


def test_what_several_workers_measured_is_added_up():
    with mission_kit() as mission:
        run = mission(machine_of_tests())
    workers = [Coverage(), Coverage()]
    total = Coverage()
    for coverage in workers:
        coverage.add(run)
        total.merge(Coverage.from_json(coverage.to_json()))
    (machine,) = total.summary()["machines"]
    assert machine["runs"] == 2
    assert machine["states"]["times"] == {"/M": 2, "/M/A": 2, "/M/B": 2}


def machine_of_tests():
    space = {}
    exec(TESTS, space)
    return space["machine"]()


def test_a_seed_for_all_missions(pytester):
    pytester.makepyfile(
        "def test_seed(mission):\n    assert mission.seed == mission.clock.seed == 7"
    )
    pytester.runpytest_inprocess(*OPTIONS, "--mission-seed=7").assert_outcomes(passed=1)


def test_unittest_runs_it(pytester):
    (pytester.path / "test_u.py").write_text(
        TESTS
        + "\nfrom smachpy.testing import MissionTestCase\n"
        + "class Test(MissionTestCase):\n"
        + "    def test(self):\n"
        + "        self.assertEqual(self.mission(machine()).duration, 20)\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "unittest", "test_u"],
        cwd=pytester.path,
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "Ran 1 test" in done.stderr


OUTSIDE = """
from smachpy.testing import MissionTestCase, mission_kit
from test_machine import machine

class Test(MissionTestCase):
    def test(self):
        print("case", self.mission.seed)
        self.assertEqual(self.mission(machine()).duration, 20)

    def test_seed(self):
        self.assertNotEqual(self.mission.seed, 9)

class TestOwn(MissionTestCase):
    seed = 5

    def test(self):
        self.assertEqual(self.mission.seed, 5)

def test_kit():
    with mission_kit() as mission:
        print("kit", mission.seed)
        mission(machine())
"""


def test_the_options_hold_without_the_fixtures_too(pytester):
    pytester.makepyfile(test_machine=TESTS.partition("def test_done")[0], test_outside=OUTSIDE)
    result = pytester.runpytest_inprocess(
        *OPTIONS, "--mission-coverage-json=no/such/c.json", "--mission-seed=3", "-s"
    )
    result.assert_outcomes(passed=4)
    result.stdout.fnmatch_lines(["*case 3*", "*kit 3*", "/M *2 *"])
    (machine,) = json.loads((pytester.path / "no/such/c.json").read_text())["machines"]
    assert machine["runs"] == 2
    again = pytester.runpytest_inprocess(*OPTIONS, "--mission-seed=8", "--mission-seeds=3", "-s")
    again.assert_outcomes(passed=3, failed=1)
    out = again.stdout.str()
    assert re.findall(r"case (\d+)", out) == ["8", "9", "10"]
    assert re.findall(r"Test.test_seed: mission seed (\d+)", out) == ["9"]
    plain = pytester.runpytest_inprocess(*OPTIONS, "-s")
    plain.stdout.fnmatch_lines(["*case None*"])


ASYNC = """
import unittest
from smachpy.testing import MissionTestCase
from test_machine import machine

class Test(MissionTestCase, unittest.IsolatedAsyncioTestCase):
    async def test(self):
        print("first", self.mission.seed)
        self.assertEqual(self.mission(machine()).duration, 20)

    def test_plain(self):
        self.mission(machine())

class TestOther(unittest.IsolatedAsyncioTestCase, MissionTestCase):
    async def test(self):
        print("last", self.mission.seed)
        self.assertEqual(self.mission(machine()).duration, 20)
"""


def test_async_tests_of_unittest_run_with_all_seeds(pytester):
    pytester.makepyfile(test_machine=TESTS.partition("def test_done")[0], test_async=ASYNC)
    result = pytester.runpytest_inprocess(*OPTIONS, "--mission-seeds=3", "-s")
    result.assert_outcomes(passed=3)
    out = result.stdout.str()
    assert re.findall(r"first (\d+)", out) == ["0", "1", "2"]
    assert re.findall(r"last (\d+)", out) == ["0", "1", "2"]


NO_FAILURES = """
import unittest
import pytest
from smachpy.testing import MissionTestCase

class Test(MissionTestCase):
    @unittest.skip("why")
    def test_decorated(self):
        pass

    def test_skips(self):
        self.skipTest("why")

    def test_skips_as_pytest(self):
        pytest.skip("why")

    def test_skips_once(self):
        if self.mission.seed == 0:
            self.skipTest("why")

    def test_skips_last(self):
        if self.mission.seed == 2:
            self.skipTest("why")

    @unittest.expectedFailure
    def test_expected(self):
        self.fail()
"""

FAILURES = """
import unittest
import pytest
from smachpy.testing import MissionTestCase

class Test(MissionTestCase):
    def test_fails_after_a_skip(self):
        if self.mission.seed == 0:
            self.skipTest("why")
        self.fail()

    def test_fails_after_a_skip_of_pytest(self):
        if self.mission.seed == 0:
            pytest.skip("why")
        self.fail()

    @unittest.expectedFailure
    def test_fails_not_with_one_seed(self):
        self.assertEqual(self.mission.seed, 1)

    def test_in_a_part(self):
        with self.subTest(), self.subTest():
            self.assertNotEqual(self.mission.seed, 1)

    def test_in_its_cleanup(self):
        self.addCleanup(self.assertNotEqual, self.mission.seed, 1)
"""


def test_a_seed_with_which_a_test_does_not_run_hides_no_other_one(pytester, caplog):
    pytester.makepyfile(NO_FAILURES)
    result = pytester.runpytest_inprocess(*OPTIONS, "--mission-seeds=3", "-s")
    result.assert_outcomes(passed=2, skipped=3, xfailed=1)
    assert not caplog.messages
    pytester.makepyfile(FAILURES)
    result = pytester.runpytest_inprocess(*OPTIONS, "--mission-seeds=3", "-s")
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    told = dict(re.findall(r"Test[.](test_\w+): mission seed (\d)", "\n".join(caplog.messages)))
    assert told == {
        "test_fails_after_a_skip": "1",
        "test_fails_after_a_skip_of_pytest": "1",
        "test_fails_not_with_one_seed": "1",
        "test_in_a_part": "1",
        "test_in_its_cleanup": "1",
    }
    names = set(re.findall(r"^FAILED .*::(test_\w+)", result.stdout.str(), re.MULTILINE))
    assert names | {"test_in_a_part"} == set(told)


def test_a_result_of_unittest_has_what_each_seed_gave():
    class Test(MissionTestCase):
        def test_fails(self):
            assert self.mission.seed == 4

        def test_skips(self):
            self.skipTest("why")

    around = session.Session((4, 5, 6))
    session.begin(around)
    try:
        result = Test("test_fails").run()
        assert (result.testsRun, len(result.failures)) == (2, 1)
        result = Test("test_skips").run()
        assert (result.testsRun, len(result.skipped), result.errors) == (3, 1, [])
    finally:
        session.end(around)


def test_the_command_line_alias(pytester):
    pytester.makepyfile(test_m=TESTS)
    done = subprocess.run(
        [sys.executable, "-c", ALIAS, "test", "test_m.py", "-q", "-k", "done", *OPTIONS],
        cwd=pytester.path,
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )
    assert "1 passed" in done.stdout, done.stderr


def test_the_alias_warns_of_nothing_where_the_package_is_installed(tmp_path):
    facts = tmp_path / "plugged-1.0.dist-info"  # names its modules, as a wheel's files do
    facts.mkdir()
    (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: plugged\nVersion: 1.0\n")
    (facts / "RECORD").write_text("smachpy/__init__.py,,\n")
    (facts / "entry_points.txt").write_text("[pytest11]\nplugged = smachpy.base.log\n")
    (tmp_path / "test_m.py").write_text("def test_it(): pass\n")
    done = subprocess.run(
        [sys.executable, "-m", "smachpy.command", "test", "test_m.py"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )
    assert "plugged-1.0" in done.stdout
    assert "1 passed in" in done.stdout
    assert "Warning" not in done.stdout


@pytest.mark.parametrize(
    ("words", "got"),
    [
        (["-k", "x", "f.py"], ["-k", "x", "f.py"]),
        (["-q", "f.py", "--debug"], ["-q", "f.py", "--debug"]),
        (["--mission-coverage"], ["--mission-coverage"]),
        (["f.py", "--", "-g.py"], ["f.py", "--", "-g.py"]),
        (["f.py", "--help"], ["f.py", "--help"]),
        ([], []),
    ],
)
def test_the_alias_hands_every_word_to_pytest(monkeypatch, words, got):
    seen = []
    monkeypatch.setattr(testing_cli, "run_pytest", lambda words: seen.append(list(words)) or 5)
    assert main(["test", *words]) == 5
    assert seen == [got]


def test_the_help_of_the_alias_is_short(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["test", "--help"])
    assert ended.value.code == 0
    assert "All words are passed to pytest" in capsys.readouterr().out


def test_loading_the_plugin_loads_neither_network_nor_numbers():
    code = (
        "import sys, smachpy.testing.plugin\n"
        "heavy = {'zenoh', 'numpy', 'rosbags', 'smachpy.testing.kit', 'actionlib_core.node'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=250, check=True
    )
    assert done.stdout.strip() == "[]"


SEEDED = """

def order(mission):
    seen = []
    tasks = [mission.clock.spawn(lambda n=n: seen.append(n), name=n) for n in "abc"]
    for task in tasks:
        task.join()
    return "".join(seen)

def test_order(mission):
    print(mission.seed, order(mission))

def test_server(action_server):
    pass

def test_without():
    pass
"""


def test_every_test_of_a_mission_is_repeated_with_many_seeds(pytester):
    pytester.makepyfile(SEEDED)
    result = pytester.runpytest_inprocess(*OPTIONS, "--mission-seeds=4", "-s")
    result.assert_outcomes(passed=9)
    orders = dict(re.findall(r"(\d) ([abc]{3})", result.stdout.str()))
    assert sorted(orders) == ["0", "1", "2", "3"]
    assert len(set(orders.values())) > 1
    again = pytester.runpytest_inprocess(*OPTIONS, "--mission-seeds=2", "--mission-seed=2", "-s")
    again.assert_outcomes(passed=5)
    found = dict(re.findall(r"(\d) ([abc]{3})", again.stdout.str()))
    assert found == {seed: orders[seed] for seed in ("2", "3")}


def test_seeds_are_at_least_one(pytester):
    pytester.makepyfile(SEEDED)
    for count in ("0", "-1"):
        result = pytester.runpytest_inprocess(*OPTIONS, f"--mission-seeds={count}")
        assert result.ret == pytest.ExitCode.USAGE_ERROR
        told = f"*--smachpy-seeds: got {count}; expected 1 or more.*"
        result.stderr.fnmatch_lines([told])


def test_a_test_may_choose_its_seed(pytester):
    pytester.makepyfile(
        "import pytest\n\n@pytest.fixture\ndef mission_seed():\n    return 5\n\n"
        "def test_it(mission):\n    assert mission.seed == 5\n"
    )
    pytester.runpytest_inprocess(*OPTIONS).assert_outcomes(passed=1)


def test_a_projects_own_fixture_called_mission_does_not_disturb_the_servers(pytester):
    pytester.makeconftest(
        "import pytest\n@pytest.fixture\ndef mission():\n    return {'name': 'of the project'}\n"
    )
    pytester.makepyfile(
        """
        import smachpy
        from actionlib_core.interfaces.actionlib.msg import TestAction

        def test_ours(mission, smachpy_mission, action_server):
            robot = action_server("test", TestAction)
            robot.default_result()
            state = smachpy.SimpleActionState("test", TestAction)
            sm = smachpy.StateMachine(outcomes=["succeeded", "aborted", "preempted"])
            sm.add("GO", state)
            smachpy_mission(sm).assert_outcome("succeeded")
            assert mission["name"] == "of the project"
        """
    )
    pytester.runpytest_subprocess("-p", "no:cacheprovider").assert_outcomes(passed=1)


@pytest.mark.parametrize("option", ["--smachpy-seed", "--mission-seed"])
def test_options_have_the_name_of_the_package_and_their_former_one(pytester, option):
    pytester.makepyfile("def test_seed(mission_seed):\n    assert mission_seed == 7\n")
    done = pytester.runpytest_subprocess("-p", "no:cacheprovider", f"{option}=7")
    done.assert_outcomes(passed=1)
