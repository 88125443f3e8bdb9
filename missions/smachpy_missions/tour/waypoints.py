"""Waypoints: visit the waypoints of a file, with a task at each; skip, loop, resume.

    WAYPOINTS
      BEGIN         starts at the first waypoint, or where the last run was interrupted
      LOCATE        with start=nearest: gets the robot's pose
      NEAREST       and starts at the nearest waypoint
      NEXT          takes the next waypoint, until none is left
      DRIVE         drives there, with several attempts
      DWELL         stays there for a while
      CHOOSE        picks the task: PHOTO, TURN, or a state for each service to wait for
      TICK_OFF      counts the waypoint as done
      SKIP          it was not reached, or its task failed: continues with the next one

Run it: `smachpy run waypoints --start-robot`
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from smachpy import CBState, StateMachine, UserData
from smachpy.places.maps import OFFICE_TOUR
from smachpy.states import MissionError, Progress, Wait, drive_to, locate, pose_of
from smachpy_missions.tour.progress import Trip, TripWatch
from smachpy_missions.tour.resume_file import ResumeFile, fingerprint
from smachpy_missions.tour.tasks import choose_task, task_states
from smachpy_missions.tour.tour_file import load_tour

if TYPE_CHECKING:
    from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseFeedback
    from smachpy import SimpleActionState

BETWEEN_TRIES = 2.0  # [s] first pause between attempts; it doubles each time
# The mission's progress, in userdata and in the resume file: the index of the first waypoint, the
# number of finished visits, the names of skipped waypoints, and how many in a row were skipped.
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
    """Visit the waypoints of a file and run the task at each.

    Args:
        file: The list, YAML or CSV.
        loop: How often to visit all of them; 0: until the mission is stopped.
        tries: Attempts to reach a waypoint.
        on_failure: After that: continue with the next waypoint, or stop.
        start: Start at the first waypoint, or at the nearest one (and visit those before it last).
        resume: Store the progress in this file, and continue from it in the next run.
        photos: The folder for photos.
        floor: The map to check the waypoints against if the file names none.

    Raises:
        InputFileError: the file has problems; each is listed with its line and field.
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
    """Follows the trip and stores the progress.

    Args:
        trip: The waypoints to visit.
        kept: The file for the progress, if any.

    Raises:
        MissionError: the file belongs to another trip.
    """

    def __init__(self, trip: Trip, kept: ResumeFile | None) -> None:
        self.trip = trip
        self.kept = kept
        self.watch = TripWatch()
        if kept is not None:
            kept.load()  # a file of another trip is refused here, before the robot moves

    def begin(self, userdata: UserData) -> str:
        """Start at the beginning, or continue from the stored progress."""
        self.watch = TripWatch()
        saved = None if self.kept is None else self.kept.load()
        userdata.update({**(saved or BEGINNING), "in_vain": 0})
        return "again" if saved else "anew"

    def begin_at_nearest(self, userdata: UserData) -> str:
        """Start with the nearest waypoint."""
        userdata.first = self.trip.nearest(userdata.here)
        return "done"

    def take_next(self, userdata: UserData) -> str:
        """Store the next waypoint in userdata, or return how the trip ended."""
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
        """Update the progress in userdata, if it has changed."""
        here = pose_of(feedback.base_position.pose)
        progress = self.watch.look(self.trip.begun_at(userdata.first), userdata.done, here)
        if progress != userdata.progress:
            userdata.progress = progress

    def note_pace(self, _userdata: UserData, status: int, _result: object) -> None:
        """Add a finished drive to the measured pace."""
        self.watch.end_leg(arrived=status == GoalStatus.SUCCEEDED)

    def tick_off(self, userdata: UserData) -> str:
        """Count the waypoint as done."""
        userdata.in_vain = 0
        return self._go_on(userdata)

    def skip(self, userdata: UserData) -> str:
        """Count the waypoint as skipped; the next one is due."""
        userdata.skipped = [*userdata.skipped, userdata.waypoint.name]
        userdata.in_vain += 1
        return self._go_on(userdata)

    def _go_on(self, userdata: UserData) -> str:
        userdata.done += 1
        if self.kept is not None:
            self.kept.save({key: userdata[key] for key in BEGINNING})
        return "done"


def drive(guide: Guide, tries: int) -> SimpleActionState:
    """Return the state that drives to the waypoint, with several attempts."""
    return drive_to(
        "waypoint",
        feedback_cb=guide.show_progress,
        result_cb=guide.note_pace,
        input_keys=["first", "done", "progress"],
        output_keys=["progress"],
        retry=(tries, BETWEEN_TRIES, ["aborted"]),
    )
