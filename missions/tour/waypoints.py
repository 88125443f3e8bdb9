"""Waypoints: follow a list from a file, with something to do at each; skip, loop, resume.

    WAYPOINTS
      BEGIN         at the first waypoint, or at the one that was interrupted
      LOCATE        with start=nearest: where is the robot?
      NEAREST       and begins there
      NEXT          takes the next waypoint, until all are behind
      DRIVE         there; tries a few times
      DWELL         stays there for a while
      CHOOSE        the waypoint's task: PHOTO, TURN, or a state for each service to wait for
      TICK_OFF      it is done
      SKIP          it cannot be reached, or its task failed: goes on with the next

Run it: `smachpy run waypoints --start-robot`
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from missions.tour.progress import Trip, TripWatch
from missions.tour.resume_file import ResumeFile, fingerprint
from missions.tour.tasks import choose_task, task_states
from missions.tour.tour_file import load_tour
from smachpy import CBState, StateMachine, UserData
from smachpy.sim.maps import OFFICE_TOUR
from smachpy.states import MissionError, Progress, Wait, drive_to, locate, pose_of

if TYPE_CHECKING:
    from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseFeedback
    from smachpy import SimpleActionState

BETWEEN_TRIES = 2.0  # [s] it doubles each time
# How far the mission got, in userdata and in the file: the index of the waypoint it began with,
# visits that are behind it, names of those that were skipped, how many of them in a row.
BEGINNING = {"first": 0, "done": 0, "skipped": [], "in_vain": 0}


def waypoints(
    file: str | Path = OFFICE_TOUR,
    loop: int = 1,
    tries: int = 2,
    on_failure: Literal["next", "stop"] = "next",
    start: Literal["first", "nearest"] = "first",
    resume: str | Path | None = None,
    photos: str | Path = "photos",
    floor: str | Path | None = None,
) -> StateMachine:
    """Follow the waypoints of a file; at each, do what the file says.

    Args:
        file: The list, YAML or CSV.
        loop: How often to follow it; 0: until the mission is stopped.
        tries: How often to try to get to a waypoint.
        on_failure: After that, go on with the next waypoint, or stop.
        start: Begin at the first waypoint, or at the nearest and come to the first after the last.
        resume: Keep in this file how far it got, and go on from there the next time.
        photos: The folder for photos.
        floor: The map to check the waypoints against when the file names none.

    Raises:
        InputFileError: the file is wrong; with the line and field of every problem.
        MissionError: `loop` or `tries` is too small, or `resume` belongs to another list.
    """
    for name, value, least in (("loop", loop, 0), ("tries", tries, 1)):
        if value < least:
            raise MissionError(f"{name}: got {value}; expected {least} or more.")
    tour = load_tour(Path(file), None if floor is None else Path(floor))
    trip = Trip(tour.waypoints, loop)
    kept = ResumeFile(Path(resume), fingerprint(trip), BEGINNING) if resume else None
    guide = Guide(trip, kept)
    failed = "SKIP" if on_failure == "next" else "aborted"
    tasks = task_states(trip.waypoints, Path(photos), tour.map)
    sm = StateMachine(["succeeded", "incomplete", "aborted", "preempted"], name="WAYPOINTS")
    with sm:
        sm.add(
            "BEGIN",
            CBState(guide.begin, outcomes=["anew", "again"], output_keys=BEGINNING),
            {"anew": "LOCATE" if start == "nearest" else "NEXT", "again": "NEXT"},
        )
        if start == "nearest":
            nearest = CBState(
                guide.begin_at_nearest,
                outcomes=["done"],
                input_keys=["here"],
                output_keys=["first"],
            )
            sm.add("LOCATE", locate(), {"valid": "NEAREST", "invalid": "aborted"})
            sm.add("NEAREST", nearest, {"done": "NEXT"})
        sm.add(
            "NEXT",
            CBState(
                guide.take_next,
                outcomes=["drive", "all_visited", "some_skipped", "none_reached"],
                input_keys=BEGINNING,
                output_keys=["waypoint", "dwell", "progress"],
            ),
            {
                "drive": "DRIVE",
                "all_visited": "succeeded",
                "some_skipped": "incomplete",
                "none_reached": "aborted",
            },
        )
        sm.add("DRIVE", drive(guide, tries), {"succeeded": "DWELL", "aborted": failed})
        sm.add("DWELL", Wait(), {"done": "CHOOSE"}, {"seconds": "dwell"})
        sm.add(
            "CHOOSE",
            CBState(choose_task, outcomes=["nothing", *tasks], input_keys=["waypoint"]),
            {"nothing": "TICK_OFF", **{label: label for label in tasks}},
        )
        for label, state in tasks.items():
            sm.add(label, state, {"succeeded": "TICK_OFF", "aborted": failed})
        for label, ending in (("TICK_OFF", guide.tick_off), ("SKIP", guide.skip)):
            keys = ["done", "skipped", "in_vain"]
            ends = CBState(
                ending, outcomes=["done"], input_keys=["waypoint", "first"], io_keys=keys
            )
            sm.add(label, ends, {"done": "NEXT"})
    return sm


class Guide:
    """Knows the trip, and keeps how far it got.

    Args:
        trip: Where to go.
        kept: The file to keep it in, if any.

    Raises:
        MissionError: the file belongs to another trip.
    """

    def __init__(self, trip: Trip, kept: ResumeFile | None) -> None:
        self.trip = trip
        self.kept = kept
        self.watch = TripWatch()
        if kept is not None:
            kept.load()  # refused now, before anything moves

    def begin(self, userdata: UserData) -> str:
        """Set out, or go on."""
        self.watch = TripWatch()
        saved = None if self.kept is None else self.kept.load()
        userdata.update({**(saved or BEGINNING), "in_vain": 0})
        return "again" if saved else "anew"

    def begin_at_nearest(self, userdata: UserData) -> str:
        """Begin with the waypoint that is nearest."""
        userdata.first = self.trip.nearest(userdata.here)
        return "done"

    def take_next(self, userdata: UserData) -> str:
        """Take the next waypoint, if there is one."""
        total = self.trip.total
        if userdata.done == total and self.kept is not None:
            self.kept.forget()
        if userdata.in_vain >= len(self.trip.waypoints):
            return "none_reached"
        if userdata.done == total:
            userdata.progress = Progress(1.0, 0.0, f"{total}/{total}")
            return "some_skipped" if userdata.skipped else "all_visited"
        trip = self.trip.begun_at(userdata.first)
        userdata.waypoint = waypoint = trip.waypoint(userdata.done)
        userdata.dwell = waypoint.dwell
        userdata.progress = self.watch.set_out(trip, userdata.done)
        return "drive"

    def show_progress(self, userdata: UserData, feedback: MoveBaseFeedback) -> None:
        """Say how far the trip is, whenever that is something new."""
        here = pose_of(feedback.base_position.pose)
        progress = self.watch.look(self.trip.begun_at(userdata.first), userdata.done, here)
        if progress != userdata.progress:
            userdata.progress = progress

    def note_pace(self, _userdata: UserData, status: int, _result: object) -> None:
        """Remember how long a drive took that came to its end."""
        self.watch.end_leg(arrived=status == GoalStatus.SUCCEEDED)

    def tick_off(self, userdata: UserData) -> str:
        """The waypoint is done: the next one is due."""
        userdata.in_vain = 0
        return self._go_on(userdata)

    def skip(self, userdata: UserData) -> str:
        """The waypoint could not be done: the next one is due all the same."""
        userdata.skipped = [*userdata.skipped, userdata.waypoint.name]
        userdata.in_vain += 1
        return self._go_on(userdata)

    def _go_on(self, userdata: UserData) -> str:
        userdata.done += 1
        if self.kept is not None:
            self.kept.save({key: userdata[key] for key in BEGINNING})
        return "done"


def drive(guide: Guide, tries: int) -> SimpleActionState:
    """Drive to the waypoint, trying several times."""
    return drive_to(
        "waypoint",
        feedback_cb=guide.show_progress,
        result_cb=guide.note_pace,
        input_keys=["first", "done", "progress"],
        output_keys=["progress"],
        retry=(tries, BETWEEN_TRIES, ["aborted"]),
    )
