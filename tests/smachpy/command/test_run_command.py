"""`smachpy run` as a user types it: real processes, real zenoh."""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from actionlib_core import node, shutdown
from smachpy.command import main
from smachpy.places.maps import OFFICE_MAP
from tests.places import ROOT

pytestmark = pytest.mark.zenoh

SMACHPY = [sys.executable, "-c", "import sys; from smachpy.command import main; sys.exit(main())"]
WAYPOINTS = """\
map: {map}
dock: {{x: 9.8, y: 7.1, yaw: 1.5708}}
low_battery: 0.5
charge_until: 0.7
waypoints:
  - {{name: near, x: 10.8, y: 7.6, yaw: 0.0}}
"""
ROBOT = """\
robot: {max_speed: 2.0, acceleration: 3.0, braking: 3.0, max_turn_rate: 3.0}
battery: {capacity: 1.0, charge: 0.505, charge_power: 1200}
start: {x: 9.8, y: 7.1, yaw: 1.5708}
dock: {x: 9.8, y: 7.1, yaw: 1.5708}
"""


def wait_for_line(process, text):
    """Read the process's output up to a line with `text`."""
    seen = []
    for line in process.stdout:
        seen.append(line)
        if text in line:
            return
    raise AssertionError(f"not printed: {text!r}\n{''.join(seen)}")


def children_of(pid):
    """Return the processes whose parent is `pid`; those of a thread that ends move to another."""
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            _, parent = status.read_text().rpartition(")")[2].split()[:2]
            if int(parent) == pid:
                found.append(int(status.parent.name))
    return found


def is_alive(pid):
    try:
        return "Z" not in Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):  # it ended as it was looked at
        return False


def wait_gone(pid, seconds):
    with contextlib.suppress(ProcessLookupError):
        process = os.pidfd_open(pid)
        try:
            gone, _, _ = select.select([process], [], [], seconds)
        finally:
            os.close(process)
        assert gone, f"process {pid} is still there"


def run(*arguments, **options):
    return subprocess.run(
        [*SMACHPY, *arguments],
        capture_output=True,
        text=True,
        timeout=250,
        stdin=subprocess.DEVNULL,
        **options,
    )


def started(*arguments):
    return running([*SMACHPY, *arguments])


@contextlib.contextmanager
def running(command):
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        stdin=subprocess.DEVNULL,
        text=True,
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()
        process.stdout.close()


@pytest.fixture
def files(tmp_path):
    (tmp_path / "way.yaml").write_text(WAYPOINTS.format(map=OFFICE_MAP))
    (tmp_path / "robot.yaml").write_text(ROBOT)
    return tmp_path


@pytest.fixture
def far(files):
    """Arguments of a patrol that drives for a while."""
    text = WAYPOINTS.format(map=OFFICE_MAP).replace("10.8, y: 7.6", "2.0, y: 3.0")
    (files / "far.yaml").write_text(text.replace("low_battery: 0.5", "low_battery: 0.1"))
    way = f"waypoints={files / 'far.yaml'}"
    return ["run", "patrol", "--start-robot", "--plain", "--out", str(files / "out"), "-i", way]


@pytest.mark.slow
def test_a_patrol_of_two_processes_succeeds_and_leaves_its_pictures(files):
    out = files / "out"
    done = run(
        *("run", "patrol", "--start-robot", "--plain", "--out", str(out)),
        *("-i", f"waypoints={files / 'way.yaml'}", "--config", str(files / "robot.yaml")),
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "RECHARGE/CHARGE  succeeded" in done.stdout
    assert "PATROL: succeeded" in done.stdout
    assert "<svg" in (out / "patrol.svg").read_text()
    assert (out / "patrol_track.png").read_bytes().startswith(b"\x89PNG")
    assert done.stderr == ""


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_stops_the_robot_and_everything_ends_soon(far, number, code):
    with started(*far) as process:
        wait_for_line(process, "move_base")
        (robot,) = children_of(process.pid)
        process.send_signal(number)
        output = process.stdout.read()
        assert process.wait(60) == code, output
        assert "PATROL: preempted" in output
        assert "stopped on request" in output
        assert not is_alive(robot)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_a_mission_that_is_being_built(number, tmp_path, capsys):
    """It was heard when the function had returned, which may compute for a minute."""
    (tmp_path / "slow.py").write_text(
        f"import signal\n\ndef mission():\n    signal.raise_signal({number:d})\n"
        '    print("went on")\n'
    )
    before = [signal.getsignal(each) for each in shutdown.SIGNALS]
    assert main(["run", str(tmp_path / "slow.py")]) == shutdown.EXIT_SIGNAL + number
    assert [signal.getsignal(each) for each in shutdown.SIGNALS] == before
    assert "went on" not in capsys.readouterr().out
    assert not shutdown.requested()


@pytest.mark.slow
def test_a_mission_that_is_killed_takes_its_robot_along(far):
    with started(*far) as process:
        wait_for_line(process, "move_base")
        (robot,) = children_of(process.pid)
        process.kill()
        process.wait()
        wait_gone(robot, 60.0)


@pytest.mark.slow
def test_a_robot_that_is_killed_ends_the_mission(far):
    with started(*far) as process:
        wait_for_line(process, "move_base")
        (robot,) = children_of(process.pid)
        os.kill(robot, signal.SIGKILL)
        output = process.stdout.read()
        assert process.wait(60) == 1
        assert "PATROL: aborted" in output
        assert "LOST" in output


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["run", "patroll"], "Did you mean 'patrol'"),
        (["run", "patrol", "-i", "waypoints=nowhere.yaml"], "nowhere.yaml: got"),
        (["run", "patrol", "-i", "speed=3"], "no such input; expected one of"),
        (["run", "patrol", "-i", "rounds=many"], "expected a whole number"),
        (["run", "patrol", "-i", "speed"], "expected KEY=VALUE"),
        (
            ["run", "patrol", "--start-robot", "--pose", "nan", "0", "0"],
            "got 'nan'; expected a finite",
        ),
        (["run", "patrol", "--start-robot", "--pose", "a", "0", "0"], "got 'a'; expected a finite"),
        (["run", "--ros1", "old.py", "-x", "3"], "or '-- -x 3' if the mission or script itself"),
        (["run", "patrol", "--fats", "--", "3"], "Try 'smachpy run --help'."),
    ],
)
def test_bad_input_is_one_screen_without_traceback(arguments, text, capsys):
    try:
        code = main(arguments)
    except SystemExit as end:  # argparse's own errors
        code = end.code
    assert code == 2
    check_one_screen(capsys.readouterr().err, text)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--server-timeout", "0.3"], "Try --start-robot"),
        (["--start-robot", "--server-timeout", "0.01"], "the robot is not ready after 0.01 s"),
        (["--out", "/dev/null/x"], "expected a folder"),
        (["--start-robot", "--map", "nowhere.yaml"], "nowhere.yaml: got"),
        (["--start-robot", "--pose", "0", "0", "0"], "Try --pose X Y YAW"),
    ],
)
def test_what_goes_wrong_at_the_start_leaves_nothing_running(arguments, text, tmp_path):
    done = run("run", "patrol", *arguments, cwd=tmp_path)
    assert done.returncode == 2, done.stdout + done.stderr
    check_one_screen(done.stderr, text)
    assert done.stderr.count("smachpy: ") == 1


def check_one_screen(message, text):
    assert text in message
    assert "Traceback" not in message
    assert len(message.splitlines()) < 20


def test_a_mission_that_raises_ends_with_1(tmp_path):
    (tmp_path / "broken.py").write_text(
        "import smachpy\n"
        "@smachpy.state(outcomes=['done'])\n"
        "def look(userdata):\n"
        "    return 1 / 0\n"
        "def mission():\n"
        "    sm = smachpy.StateMachine(outcomes=['done'])\n"
        "    with sm:\n"
        "        smachpy.StateMachine.add('LOOK', look)\n"
        "    return sm\n"
    )
    done = run("run", "broken.py", "--plain", cwd=tmp_path)
    assert done.returncode == 1
    assert "division by zero\n    " in done.stderr
    assert "broken.py:4 in look: return 1 / 0\n" in done.stderr
    assert "Traceback" not in done.stderr
    done = run("run", "broken.py", "--plain", "--debug", cwd=tmp_path)
    assert done.returncode == 1
    assert "Traceback" in done.stderr


@pytest.mark.slow
def test_two_robots_of_one_name():
    robot = [sys.executable, "-m", "smachpy", "robot"]
    with running(robot) as first:
        wait_for_line(first, "ready")
        # Of its action, or of its service if the network told of the first robot late.
        second = subprocess.run(robot, capture_output=True, text=True, timeout=250)
        assert second.returncode == 2
        check_one_screen(second.stderr, "two servers")
        third = run("run", "patrol", "--start-robot")
        assert third.returncode == 2
        check_one_screen(third.stderr, "two servers")
        first.send_signal(signal.SIGTERM)
        assert first.wait(60) == 0


@pytest.mark.slow
def test_two_runs_that_bring_their_robots_do_not_meet(monkeypatch):
    """As of a class on one server, or two jobs of a CI: nothing says which network to join."""
    monkeypatch.delenv("SMACHPY_DOMAIN")
    near = ["run", "there_and_back", "--start-robot", "--plain", "--", "10.3", "7.1"]
    with started(*near) as one, started(*near) as other:
        for process in (one, other):
            output = process.stdout.read()
            assert process.wait(60) == 0, output
            assert "network of this run: SMACHPY_DOMAIN=" in output


@pytest.mark.parametrize(
    ("arguments", "own"),
    [
        ([], False),
        (["--start-robot"], True),
        (["--start-robot", "--share"], False),
        (["--start-robot", "--time", "virtual"], False),
    ],
)
def test_only_a_run_that_brings_its_robot_has_a_network_of_its_own(
    monkeypatch, tmp_path, capsys, arguments, own
):
    monkeypatch.setattr(node, "_default", node._Default())  # another test may have joined one
    monkeypatch.delenv("SMACHPY_DOMAIN")
    file = tmp_path / "mission.py"
    file.write_text(
        "import os\nraise OSError('in domain ' + os.environ.get('SMACHPY_DOMAIN', '-'))\n"
    )
    assert main(["run", str(file), *arguments]) == 2
    assert ("in domain -" not in capsys.readouterr().err) == own
    assert "SMACHPY_DOMAIN" not in os.environ


@pytest.mark.parametrize(
    ("robots", "arguments", "own"),
    [
        ("False", [], False),
        ("True", [], True),
        ("True", ["--share"], False),
        ("True", ["--time", "virtual"], False),
        ("'start'", [], True),
        ("'start'", ["--", "--no-start"], False),
        ("'start'", ["--input", "start=false"], False),
    ],
)
def test_a_mission_that_starts_its_robots_has_a_network_of_its_own(
    monkeypatch, tmp_path, capsys, robots, arguments, own
):
    monkeypatch.setattr(node, "_default", node._Default())
    monkeypatch.delenv("SMACHPY_DOMAIN")
    file = tmp_path / "mission.py"
    file.write_text(
        "import os, smachpy\n"
        f"@smachpy.mission(robots={robots})\n"
        "def mission(*, start: bool = True):\n"
        "    raise smachpy.SmachError('in domain ' + os.environ.get('SMACHPY_DOMAIN', '-'))\n"
    )
    assert main(["run", str(file), *arguments]) == 2
    assert ("in domain -" not in capsys.readouterr().err) == own
    assert "SMACHPY_DOMAIN" not in os.environ


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        ("there_and_back", "--robot", "robot_7"),
        ("there_and_back", "--ros-args", "-r", "__ns:=/robot_7", "--"),
        ("rp_action.gotopose", "--", "robot_7", "10.8", "7.6"),
    ],
)
def test_a_robot_is_started_under_the_name_that_the_mission_calls(arguments):
    mission, *more = arguments
    done = run("run", mission, "--start-robot", "--json", *more)
    assert done.returncode == 0, done.stderr
    events = [json.loads(line) for line in done.stdout.splitlines()[1:]]
    assert [event["seq"] for event in events] == list(range(1, len(events) + 1))
    assert events[-1]["outcome"] == "succeeded"


@pytest.mark.slow
def test_names_cannot_be_changed_after_the_mission_s_module_made_its_node(tmp_path):
    (tmp_path / "early.py").write_text(
        "import smachpy\n"
        "from actionlib_core import Publisher\n"
        "from actionlib_core.interfaces.std_msgs.msg import String\n"
        "publisher = Publisher('chatter', String)\n"
        "sm = smachpy.StateMachine(outcomes=['done'])\n"
    )
    done = run("run", "early.py", "--robot", "robot_7", cwd=tmp_path)
    assert done.returncode == 2
    check_one_screen(done.stderr, "names cannot be changed: the mission made its node already")


def test_list_names_the_missions():
    done = run("list")
    assert done.returncode == 0
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    named = [line.split()[0] for line in done.stdout.splitlines() if not line.startswith(" ")]
    assert named == sorted(project["entry-points"]["smachpy.missions"])


def test_list_names_the_plans_of_a_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "200")
    (tmp_path / "tour.plan").write_text("goto_x; wait_2")
    (tmp_path / "bad.pnml").write_text("<pnml>")
    assert main(["list", str(tmp_path)]) == 0
    lines = {line.split()[0]: line for line in capsys.readouterr().out.splitlines() if line}
    assert "Petri net plan of goto, wait." in lines[str(tmp_path / "tour.plan")]
    assert "not available" in lines[str(tmp_path / "bad.pnml")]
    monkeypatch.chdir(tmp_path)
    assert main(["list"]) == 0
    assert "\ntour.plan" in capsys.readouterr().out
    assert main(["list", str(tmp_path / "none")]) == 2


def test_what_a_mission_says_of_itself_cannot_write_to_the_terminal(monkeypatch, capsys):
    named = {"evil\x1b[2J": "turns it \x1b[31mred [bold]and loud"}
    monkeypatch.setattr("smachpy.command.targets.list_missions", lambda: named)
    assert main(["list"]) == 0
    assert "\x1b" not in (said := capsys.readouterr().out)
    assert "red [bold]and loud" in said


def test_the_parameters_of_the_robot_are_listed_and_can_be_read_again(tmp_path):
    from smachpy.command.robot import parameters
    from smachpy.places.robot_file import SimConfig, load_config

    path = tmp_path / "all.yaml"
    path.write_text(parameters())
    assert all(" # " in line for line in parameters().splitlines() if not line.endswith(":"))
    config = load_config(path)
    assert config.robot == SimConfig().robot
    assert config.battery == SimConfig().battery
