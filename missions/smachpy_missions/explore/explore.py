"""Explore: look at everything that can be reached, draw a map of it, come back.

    EXPLORE
      REMEMBER      stores the robot's pose
      LOOK_AROUND   takes the first scan
      SEARCH        runs all children at once; the first to end preempts the others
        LOOK        one frontier after the other (the edge of the seen area), until none is left
          GO        drives there
        MAP         adds every scan to the map; ends if the scanner sends nothing
        BATTERY     ends when the battery is low
      SAVE          writes the map in the format of ROS map_server
      COME_BACK     drives to the stored pose
      REPORT        succeeded, or incomplete

Run it: `smachpy run explore --start-robot`
"""

from __future__ import annotations

from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING

import smachpy
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState, LaserScan
from actionlib_core.pubsub.topic import Subscriber
from smachpy import (
    CBState,
    Concurrence,
    Iterator,
    MonitorState,
    State,
    StateMachine,
    UserData,
)
from smachpy.base.log import logwarn
from smachpy.places.maps import OFFICE_EXPLORER
from smachpy.states import (
    SIGNAL_TIMEOUT,
    MissionError,
    Pose2D,
    Progress,
    drive_back,
    drive_to,
    locate,
    pose_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterator as Items

    from smachpy_missions.explore.seen_map import Frontier

IN_VAIN = 8  # after this many unreachable places in a row something is wrong with the robot
POSES_KEPT = 50  # a scan takes the pose with the nearest stamp: scans and odometry arrive unsorted
MAX_STEP = 0.2  # [s] a pose is extrapolated over at most this time


@smachpy.mission(world=OFFICE_EXPLORER)
def explore(
    map_file: str | Path = "explored.yaml",
    most: int = 0,
    smallest: float = 1.0,
    low_battery: float = 0.2,
) -> StateMachine:
    """Look at everything that can be reached, save a map of it, come back.

    Args:
        map_file: The map to write; the image beside it has the same name.
        most: Look at this many frontiers at most; 0: at all of them.
        smallest: Ignore edges of the seen area that are shorter than this [m].
        low_battery: Come back below this charge, 0 to 1.

    Raises:
        MissionError: an argument is out of range.
    """
    path = Path(map_file)
    if path.suffix not in {".yaml", ".yml"}:
        raise MissionError(f"map_file: got {str(path)!r}; expected a name that ends with .yaml.")
    if most < 0:
        raise MissionError(f"most: got {most}; expected 0 (all) or more.")
    if not smallest > 0.0:
        raise MissionError(f"smallest: got {smallest:g}; expected more than 0 [m].")
    if not 0.0 <= low_battery < 1.0:
        raise MissionError(f"low_battery: got {low_battery:g}; expected 0 or more, less than 1.")
    search = Search(path, most, smallest)
    sm = StateMachine(["succeeded", "incomplete", "aborted", "preempted"], name="EXPLORE")
    sm.register_start_cb(lambda _userdata, _initial: search.begin())
    with sm:
        sm.add("REMEMBER", locate(), {"valid": "LOOK_AROUND", "invalid": "aborted"})
        sm.add(
            "LOOK_AROUND",
            MonitorState(
                "scan",
                LaserScan,
                search.first_look,
                max_checks=1,
                input_keys=["here"],
                timeout=SIGNAL_TIMEOUT,
            ),
            {"valid": "SEARCH", "invalid": "aborted"},
        )
        ends = {"all_seen": "SAVE", "blind": "SAVE", "battery_low": "SAVE"}
        sm.add("SEARCH", look_and_map(search, low_battery), ends)
        saving = CBState(search.save, outcomes=["saved", "failed"])
        sm.add("SAVE", saving, {"saved": "COME_BACK", "failed": "COME_BACK"})
        sm.add("COME_BACK", drive_back(), {"succeeded": "REPORT"}, {"home": "here"})
        sm.add("REPORT", CBState(search.report, outcomes=["succeeded", "incomplete"]))
    return sm


def look_and_map(search: Search, low_battery: float) -> Concurrence:
    """Drive to frontiers while another branch maps and a third one watches the battery."""
    both = Concurrence(
        outcomes=["all_seen", "blind", "battery_low", "preempted"],
        default_outcome="blind",
        output_keys=["progress"],
        outcome_map={
            "all_seen": {"LOOK": "all_seen"},
            "battery_low": {"LOOK": "preempted", "BATTERY": "invalid"},
        },
        child_termination_cb=lambda _outcomes: True,
    )
    look = Iterator(
        outcomes=["preempted"],
        input_keys=[],
        output_keys=["progress"],
        it=search.frontiers,
        it_label="frontier",
        exhausted_outcome="all_seen",
    )
    with look:
        go = drive_to("frontier", output_keys=["progress"], on_exit=search.note)
        Iterator.set_contained_state("GO", go, loop_outcomes=["succeeded", "aborted"])
    battery = MonitorState(
        "battery", BatteryState, lambda _, message: message.percentage >= low_battery
    )
    with both:
        both.add("LOOK", look)
        both.add("MAP", Mapper(search))
        both.add("BATTERY", battery)
    return both


class Search:
    """The state of the search: what has been seen, and where to look next.

    An object instead of userdata, because the map is large and changes with every scan: userdata
    would have to be written, checked and recorded each time.

    Args:
        path: The map file to write.
        most: The largest number of frontiers; 0: no limit.
        smallest: Shorter edges are ignored [m].

    Threads: `add` runs in the mapper's thread, everything else in the thread that drives.
    """

    def __init__(self, path: Path, most: int, smallest: float) -> None:
        self.path = path
        self.most = most
        self.smallest = smallest
        self.begin()

    def begin(self) -> None:
        """Start a new run with an empty map."""
        # Imported here: `smachpy list` imports this module, and numpy and scipy are slow to import.
        from smachpy_missions.explore.seen_map import SeenMap

        self.seen = SeenMap(smallest=self.smallest)
        self.here: Pose2D | None = None
        self.reached = self.saved = self.finished = False
        self.looks = 0

    def add(self, scan: LaserScan, pose: Pose2D) -> None:
        """Add a scan made at `pose`."""
        self.seen.add(scan, pose)
        self.here = pose

    def first_look(self, userdata: UserData, scan: LaserScan) -> bool:
        """Add the first scan; False if it shows no free floor at all."""
        self.add(scan, userdata.here)
        return self.seen.area() > 0.0

    def frontiers(self) -> Items[Frontier]:
        """Yield the best frontier until none is left; the next one after the drive has ended."""
        in_vain = 0
        while in_vain < IN_VAIN and not 0 < self.most <= self.looks:
            frontier = None if self.here is None else self.seen.best_frontier(self.here)
            if frontier is None:
                break
            self.reached = False
            yield frontier
            self.seen.leave(frontier, reached=self.reached)
            self.looks += 1
            in_vain = 0 if self.reached else in_vain + 1
        self.finished = in_vain < IN_VAIN

    def note(self, userdata: UserData, outcome: str) -> None:
        """Store whether the frontier was reached; report how much has been seen."""
        self.reached = outcome == "succeeded"
        text = f"{self.looks + 1} looks, {self.seen.area():.0f} m² seen"
        userdata.progress = Progress(None, None, text)

    def save(self, _userdata: UserData) -> str:
        """Write the map."""
        from smachpy_missions.explore.map_file import write_map

        try:
            write_map(self.path, self.seen.occupancy())
        except OSError as error:
            logwarn(f"{self.path}: {error.strerror or error}; the map is not saved")
            return "failed"
        self.saved = True
        return "saved"

    def report(self, _userdata: UserData) -> str:
        """Return the outcome: was everything seen, and the map saved?"""
        return "succeeded" if self.saved and self.finished else "incomplete"


class Mapper(State):
    """Adds every scan to the map. Outcomes: 'blind', 'preempted'.

    Args:
        search: Holds the map.
    """

    def __init__(self, search: Search) -> None:
        super().__init__(outcomes=["blind", "preempted"])
        self._search = search

    def execute(self, userdata: UserData) -> str:
        """Add scans until a preempt; return 'blind' if none came for five seconds.

        Blocks: until one of the two.
        """
        del userdata
        wake = self.clock().event("a scan")
        poses: deque[Odometry] = deque(maxlen=POSES_KEPT)
        scans: deque[LaserScan] = deque(
            maxlen=1
        )  # mapping may be slower than the scanner: newest wins

        def on_scan(scan: LaserScan) -> None:
            scans.append(scan)
            wake.set()

        forget = self.on_preempt(wake.set)
        try:
            with Subscriber("odom", Odometry, poses.append), Subscriber("scan", LaserScan, on_scan):
                while wake.wait(SIGNAL_TIMEOUT) and not self.preempt_requested():
                    wake.clear()
                    if scans and poses:
                        scan = scans.pop()
                        self._search.add(scan, pose_at(poses, scan))
        finally:
            forget()
        return "preempted" if self.preempt_requested() else "blind"


def pose_at(poses: deque[Odometry], scan: LaserScan) -> Pose2D:
    """Return the pose at the scan's stamp: the nearest pose, extrapolated with its twist."""
    stamp = scan.header.stamp.to_sec()
    # A copy: odometry is appended in another thread meanwhile.
    nearest = min(tuple(poses), key=lambda pose: abs(pose.header.stamp.to_sec() - stamp))
    late = min(max(stamp - nearest.header.stamp.to_sec(), -MAX_STEP), MAX_STEP)
    twist = nearest.twist.twist
    # Half of the turn before the step and half after it: on an arc, a single turn before or after
    # would put the end of the step beside the arc.
    turn = twist.angular.z * late / 2
    here = pose_of(nearest.pose.pose).then(Pose2D(0.0, 0.0, turn))
    return here.then(Pose2D(twist.linear.x * late, 0.0, turn))
