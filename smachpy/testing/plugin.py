"""The pytest plugin: fixtures for missions, and mission coverage. It needs no conftest.

It imports neither the network nor the drawing: pytest loads plugins in every session, also where
no mission is tested. The fixtures import them when a test uses one.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from smachpy.testing import session

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from smachpy.testing.coverage import Coverage
    from smachpy.testing.kit import MissionKit
    from smachpy.testing.servers import ScriptedActionServer, ScriptedService, ScriptedTopic

OWN = ("smachpy", "actionlib_core", "smachpy_viz", "smachpy_missions", "smachpy_programs")
WORKER_KEY = "smachpy_mission_coverage"
CUT_KEY = "smachpy_cut_exploration"
MAX_CUT_LINES = 20  # lines of the summary


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("smachpy", "smachpy: robot missions")
    group.addoption(
        "--smachpy-seed",
        "--mission-seed",
        dest="mission_seed",
        type=int,
        help="seed of the missions' thread interleaving",
    )
    group.addoption(
        "--smachpy-seeds",
        "--mission-seeds",
        dest="mission_seeds",
        type=int,
        metavar="COUNT",
        help="run each test of a mission with this many seeds (from 0, or --smachpy-seed)",
    )
    group.addoption(
        "--smachpy-rate",
        "--mission-rate",
        dest="mission_rate",
        type=float,
        help="virtual seconds per real second, to watch missions",
    )
    group.addoption(
        "--smachpy-ros1",
        "--ros1",
        dest="ros1",
        action="store_true",
        help="tests and missions are scripts for ROS 1: provide rospy, smach and so on",
    )
    group.addoption(
        "--smachpy-coverage",
        "--mission-coverage",
        dest="mission_coverage",
        action="store_true",
        help="measure what the tests cover of missions",
    )
    group.addoption(
        "--smachpy-coverage-fail-under",
        "--mission-coverage-fail-under",
        dest="mission_coverage_fail_under",
        type=float,
        metavar="PERCENT",
        help="fail when a machine's coverage is lower",
    )
    group.addoption(
        "--smachpy-coverage-json",
        "--mission-coverage-json",
        dest="mission_coverage_json",
        metavar="FILE",
        help="write the coverage as JSON",
    )
    group.addoption(
        "--smachpy-coverage-html",
        "--mission-coverage-html",
        dest="mission_coverage_html",
        metavar="FILE",
        help="write tables and heat pictures as HTML",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Check the options; start measuring if asked to.

    Raises:
        pytest.UsageError: the number of seeds is below 1.
    """
    # pytest parses the modules of a plugin's package when they are imported, in any thread, to
    # rewrite their asserts; parsing in two threads at once fails in Python 3.11 ("AST constructor
    # recursion depth mismatch").
    rewritten: set[str] = getattr(config.pluginmanager.rewrite_hook, "_must_rewrite", set())
    rewritten.difference_update(OWN)
    count = config.getoption("mission_seeds")
    if count is not None and count < 1:
        raise pytest.UsageError(f"--smachpy-seeds: got {count}; expected 1 or more.")
    wanted = (
        "mission_coverage",
        "mission_coverage_fail_under",
        "mission_coverage_json",
        "mission_coverage_html",
    )
    cut = _Cut()
    config.pluginmanager.register(cut, "smachpy-cut-explorations")
    measuring: _Measuring | None = None
    if any(config.getoption(name) for name in wanted):
        from smachpy.testing.coverage import Coverage

        measuring = _Measuring(config, Coverage())
        config.pluginmanager.register(measuring, "mission-coverage")
    if config.getoption("ros1"):
        from smachpy import ros1

        ros1.install(Path(str(config.rootpath)) / "conftest.py")
        config.add_cleanup(ros1.uninstall)
    made = session.Session(
        _seeds(config) or (config.getoption("mission_seed"),),
        config.getoption("mission_rate"),
        None if measuring is None else measuring.coverage.add,
        cut.add,
    )
    session.begin(made)
    config.add_cleanup(lambda: session.end(made))


def _seeds(config: pytest.Config) -> tuple[int, ...]:
    """Return the seeds of `--mission-seeds`."""
    first: int = config.getoption("mission_seed") or 0
    return tuple(range(first, first + (config.getoption("mission_seeds") or 0)))


class _Cut:
    """Lists the explorations that a limit has ended: their tests pass, but say less."""

    def __init__(self) -> None:
        self._found: list[str] = []

    def add(self, text: str) -> None:
        """Note an exploration of the present test."""
        self._found.append(text)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        """Attach the explorations of a test to its report, which xdist passes on."""
        self._found.clear()
        try:
            return (yield)
        finally:
            item.user_properties += [(CUT_KEY, text) for text in self._found]

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        """Show the list."""
        reports = (report for some in terminalreporter.stats.values() for report in some)
        lines = [
            f"{report.nodeid}: {text}"
            for report in reports
            if getattr(report, "when", "") == "call"
            for name, text in report.user_properties
            if name == CUT_KEY
        ]
        if lines:
            terminalreporter.section("explorations that did not try everything")
            for line in lines[:MAX_CUT_LINES]:
                terminalreporter.write_line(line)
            if len(lines) > MAX_CUT_LINES:
                terminalreporter.write_line(f"and {len(lines) - MAX_CUT_LINES} more")


class _Measuring:
    """Collects the coverage of this process, and that of xdist's workers."""

    def __init__(self, config: pytest.Config, coverage: Coverage) -> None:
        self.coverage = coverage
        self._config = config

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        """Add the coverage of a worker."""
        from smachpy.testing.coverage import Coverage

        found = getattr(node, "workeroutput", {}).get(WORKER_KEY)
        if found is not None:
            self.coverage.merge(Coverage.from_json(found))

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """In a worker, pass the coverage on; else write it and compare it with the minimum."""
        output = getattr(self._config, "workeroutput", None)
        if output is not None:
            output[WORKER_KEY] = self.coverage.to_json()
            return
        self._write()
        if session.exitstatus == pytest.ExitCode.OK and self._below():
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def _write(self) -> None:
        file = self._config.getoption("mission_coverage_json")
        if file:
            _open(file).write_text(json.dumps(self.coverage.summary(), indent=2) + "\n", "utf-8")
        file = self._config.getoption("mission_coverage_html")
        if file:
            from smachpy.testing.coverage_page import write_page

            write_page(self.coverage, _open(file))

    def _below(self) -> list[str]:
        least = self._config.getoption("mission_coverage_fail_under")
        if least is None:
            return []
        if not self.coverage.machines:
            return [f"mission coverage: no mission ran; expected at least {least:g} %"]
        return [
            f"mission coverage: {machine.name}: {machine.percent:.0f} %; "
            f"expected at least {least:g} %"
            for machine in self.coverage.machines
            if machine.percent < least
        ]

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        """Show the table."""
        if getattr(self._config, "workeroutput", None) is not None:
            return
        terminalreporter.section("mission coverage")
        terminalreporter.write_line(self.coverage.table())
        for line in self._below():
            terminalreporter.write_line(f"FAIL {line}", red=True)


def _open(file: str) -> Path:
    """Return a file's path, after creating its folder."""
    path = Path(file)
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Repeat the tests that use a mission with many seeds, if asked to."""
    count = metafunc.config.getoption("mission_seeds")
    if count is not None and "mission_seed" in metafunc.fixturenames:
        seeds = _seeds(metafunc.config)
        metafunc.parametrize("mission_seed", seeds, ids=[f"seed{seed}" for seed in seeds])


@pytest.fixture
def mission_seed(request: pytest.FixtureRequest) -> int | None:
    """The seed of `mission`; override it to choose one for some tests."""
    seed: int | None = request.config.getoption("mission_seed")
    return seed


@pytest.fixture
def smachpy_mission(
    tmp_path_factory: pytest.TempPathFactory,
    mission_seed: int | None,
) -> Iterator[MissionKit]:
    """Run machines in virtual time, on a network in memory, beside scripted servers."""
    from smachpy.testing.kit import MissionKit

    around = session.current()
    with MissionKit(
        seed=mission_seed,
        rate=around.rate,
        folder=lambda: tmp_path_factory.mktemp("mission"),
        on_run=around.on_run,
    ) as kit:
        yield kit


@pytest.fixture
def mission(smachpy_mission: MissionKit) -> MissionKit:
    """Start missions: `smachpy_mission`, by a name that a project may have for itself, too."""
    return smachpy_mission


@pytest.fixture
def action_server(smachpy_mission: MissionKit) -> Callable[[str, Any], ScriptedActionServer]:
    """Offer an action with scripted replies: `action_server("dock", DockAction)`."""
    return smachpy_mission.action_server


@pytest.fixture
def service_server(smachpy_mission: MissionKit) -> Callable[[str, Any], ScriptedService]:
    """Offer a service with scripted replies: `service_server("dock", Trigger)`."""
    return smachpy_mission.service_server


@pytest.fixture
def topic(smachpy_mission: MissionKit) -> Callable[[str, Any], ScriptedTopic]:
    """Publish on a topic and record its messages: `topic("battery", BatteryState)`."""
    return smachpy_mission.topic
