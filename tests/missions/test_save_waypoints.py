from __future__ import annotations

import math
import os
import select
import signal
import subprocess
import sys

import pytest

from actionlib_core.exceptions import WaitTimeoutError
from actionlib_core.interfaces.geometry_msgs.msg import Twist, Vector3
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.std_msgs.msg import Header, String
from actionlib_core.pubsub.topic import Publisher
from smachpy.exceptions import MissionError
from smachpy.places.maps import OFFICE_MAP, OFFICE_TOUR
from smachpy.places.pose import Pose2D
from smachpy_missions.tour.save_waypoints import TOPIC, WaypointSaver, waypoints_text
from smachpy_missions.tour.tour_file import Stop, load_tour


def localised(x, frame):
    message = Odometry(header=Header(frame_id=frame))
    message.pose.pose.position.x, message.pose.pose.orientation.w = x, 1.0
    return message


@pytest.fixture
def said():
    return []


@pytest.mark.parametrize("name", ["w.yaml", "w.csv"])
def test_poses_driven_by_hand_become_a_list_that_missions_read(
    clock, simulation, tmp_path, said, name
):
    path = tmp_path / name
    map_file = OFFICE_MAP if path.suffix == ".yaml" else None
    saver = WaypointSaver(path, simulation.node, said.append, map_file)
    saver.wait_for_robot()
    saver.save("dock, 'south'")
    wheel = Publisher("cmd_vel", Twist, node=simulation.node)
    finger = Publisher(TOPIC, String, node=simulation.node)
    for _ in range(8):
        wheel.publish(Twist(linear=Vector3(x=0.15), angular=Vector3(z=0.4)))
        clock.sleep(0.4)
    clock.sleep(2.0)
    finger.publish(String(data=""))
    clock.sleep(0.1)
    saver.close()
    first, second = load_tour(path).waypoints
    assert (first.name, second.name) == ("dock, 'south'", "waypoint 2")
    assert first.pose[:2] == (9.8, 7.1)
    pose = simulation.robot.body.pose
    assert pose.distance(first.pose) > 0.2
    assert second.pose == pytest.approx(pose, abs=1e-3)
    assert said[0].startswith("1 dock, 'south': x 9.80 m, y 7.10 m")
    assert len(list(tmp_path.iterdir())) == 1


NAMES = [
    "#dock", "a\nb", "a\r\nb", "bell\x07", "\u2028x", "nul\x00", 'say "hi"', "a,b", "back\\slash",
    "it's", "- x: 1", "7", "null", "\U0001f916", "caf\u00e9", "\x1b[31mred",
]  # fmt: skip


@pytest.mark.parametrize("file", ["w.yaml", "w.csv"])
def test_every_name_is_read_as_it_was_saved(tmp_path, file):
    path = tmp_path / file
    saved = [Stop(name, Pose2D(float(i), 2.0, 0.0)) for i, name in enumerate(NAMES)]
    with path.open("w", encoding="utf-8", newline="") as out:
        out.write(waypoints_text(path, saved, None))
    assert list(load_tour(path).waypoints) == saved


def test_an_existing_file_is_never_overwritten(simulation, said):
    with pytest.raises(MissionError, match="got a file that exists; expected the name of a new"):
        WaypointSaver(OFFICE_TOUR, simulation.node, said.append)


def test_the_name_of_the_file_says_its_form(simulation, said, tmp_path):
    with pytest.raises(MissionError, match=r"got '\.txt'; expected a file name in"):
        WaypointSaver(tmp_path / "w.txt", simulation.node, said.append)


def test_without_a_robot_nothing_is_saved(mission, tmp_path, said):
    saver = WaypointSaver(tmp_path / "w.csv", mission.node, said.append)
    saver.save("here")
    with pytest.raises(
        WaitTimeoutError, match="topic 'odom': got no pose in the map within 5 s: no odometry"
    ):
        saver.wait_for_robot()
    saver.close()
    assert said == ["not saved: no odometry has arrived yet"]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("odometry", "why"),
    [
        (Odometry(), "orientation 0 0 0 0"),
        (Odometry(header=Header(frame_id="odom")), "orientation 0 0 0 0"),
        (localised(math.nan, "map"), "got x nan"),
        (localised(1.0, "odom"), "in frame 'odom', and no transform from 'map' to it is known"),
    ],
)
def test_before_the_robot_is_localised_nothing_is_saved(mission, tmp_path, said, odometry, why):
    mission.topic("odom", Odometry).publish(odometry, latch=True)
    saver = WaypointSaver(tmp_path / "w.yaml", mission.node, said.append)
    with pytest.raises(WaitTimeoutError, match=why):
        saver.wait_for_robot()
    saver.save("here")
    saver.close()
    assert why in said[0]
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_gone_is_told_and_the_next_attempt_may_succeed(simulation, tmp_path, said):
    saver = WaypointSaver(tmp_path / "gone" / "w.csv", simulation.node, said.append)
    saver.wait_for_robot()
    saver.save("a")
    (tmp_path / "gone").mkdir()
    saver.save("b")
    saver.close()
    assert said[0].endswith("w.csv: No such file or directory")
    assert said[1].startswith("1 b:")


def read_until(process, text, timeout=60.0):
    """Read standard output until `text` comes; the pipe itself is waited for."""
    said = ""
    while text not in said:
        ready, _, _ = select.select([process.stdout], [], [], timeout)
        piece = os.read(process.stdout.fileno(), 4096).decode() if ready else ""
        assert piece, f"{text!r} did not come; got {said!r}"
        said += piece
    return said


# The program, for which a robot may be found late, as on a busy computer.
PATIENT = """
import sys
from smachpy_missions.tour import save_waypoints

save_waypoints.FIRST_POSE = 60.0
sys.exit(save_waypoints.run_program("save_waypoints", save_waypoints.main))
"""


@pytest.mark.zenoh
@pytest.mark.slow
def test_as_a_program_enter_saves_a_waypoint(tmp_path):
    path = tmp_path / "w.csv"

    def start(*command):
        return subprocess.Popen(
            [sys.executable, *command], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )

    robot = start("-m", "smachpy", "robot", "--child")
    read_until(robot, "ready")
    saver = start("-c", PATIENT, str(path))
    try:
        read_until(saver, "Enter saves")
        saver.stdin.write(b"home\n")
        saver.stdin.flush()
        read_until(saver, "1 home: x 9.80 m")
        saver.send_signal(signal.SIGINT)
        assert saver.wait(60) == 0
    finally:
        for process in (saver, robot):
            process.stdin.close()
            process.wait(60)
            process.stdout.close()
    assert path.read_text() == "name,x,y,yaw\nhome,9.800,7.100,1.571\n"
