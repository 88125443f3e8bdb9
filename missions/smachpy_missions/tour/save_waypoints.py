"""Save waypoints while driving: press Enter wherever the robot should come back to.

    python -m smachpy_missions.tour.save_waypoints my_waypoints.yaml

Drive the robot by `cmd_vel` (or by hand, or with goals). Enter saves its current pose; text typed
before Enter is the name. A text on the topic `save_waypoint` does the same from another program.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actionlib_core import shutdown
from actionlib_core.clock import current_clock
from actionlib_core.config import load_config
from actionlib_core.exceptions import ActionlibError, WaitTimeoutError
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.names import parse_arguments
from actionlib_core.node import Node
from actionlib_core.process.output import run_program
from actionlib_core.pubsub.topic import Subscriber
from smachpy.states import MissionError, Waypoint
from smachpy.states.localising import Localiser
from smachpy_missions.explore.map_file import write_atomically
from smachpy_missions.tour.tour_file import load_tour

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actionlib_core.names import NameArguments

TOPIC: Final = "save_waypoint"
FIRST_POSE: Final = 5.0  # [s] to receive the first odometry message
_FORMATS: Final = (".yaml", ".yml", ".csv")
# Names that need no quotes in a CSV file.
_PLAIN: Final = re.compile(r"[\w()/.:-]([\w()/.: -]*[\w()/.:-])?", re.ASCII)


class WaypointSaver:
    """Appends the robot's current pose to a waypoint file on request.

    The file is complete after each waypoint: it is replaced as a whole.

    Args:
        path: The file to write; its suffix selects YAML or CSV.
        node: The node in the robot's namespace.
        report: Called with one line per waypoint that was saved, or could not be.
        map_file: Written to a YAML file, so that missions check the waypoints against this map.

    Raises:
        MissionError: the file exists already, or its suffix is unknown.

    Threads: `save` may be called from any thread; `report` is called in the thread of `save`.
    """

    def __init__(
        self,
        path: Path,
        node: Node,
        report: Callable[[str], object],
        map_file: Path | None = None,
    ) -> None:
        if path.suffix.lower() not in _FORMATS:
            raise MissionError(f"{path}: got {path.suffix!r}; expected a file name in {_FORMATS}.")
        if path.exists():
            raise MissionError(f"{path}: got a file that exists; expected the name of a new one.")
        self.waypoints: list[Waypoint] = []
        self._path = path
        self._report = report
        self._map_file = map_file
        self._lock = threading.Lock()
        self._located = node.clock.event("the robot's first pose")
        self._localiser = Localiser(node=node, changed=self._on_news)
        self._requests = Subscriber(TOPIC, String, lambda text: self.save(text.data), node=node)

    def wait_for_robot(self) -> None:
        """Wait for the robot's first pose.

        Raises:
            WaitTimeoutError: none came within 5 s.

        Blocks: until then.
        """
        if not self._located.wait(FIRST_POSE):
            _, problem = self._localiser.pose()
            hint = "" if self._localiser.heard else " Try: smachpy robot"
            raise WaitTimeoutError(
                f"topic 'odom': got no pose in the map within {FIRST_POSE:g} s: {problem}.{hint}"
            )

    def save(self, name: str = "") -> None:
        """Save the current pose; without a name it gets a number."""
        with self._lock:
            here, problem = self._localiser.pose()
            if here is None:
                self._report(f"not saved: {problem}")
                return
            number = len(self.waypoints) + 1
            waypoint = Waypoint(name.strip() or f"waypoint {number}", here)
            rows = [*self.waypoints, waypoint]
            try:
                write_atomically(self._path, waypoints_text(self._path, rows, self._map_file))
            except OSError as error:
                self._report(f"not saved: {self._path}: {error.strerror or error}")
                return
            self.waypoints = rows
            x, y, yaw = waypoint.pose
            self._report(f"{number} {waypoint.name}: x {x:.2f} m, y {y:.2f} m, yaw {yaw:.2f} rad")

    def close(self) -> None:
        """Leave the network."""
        self._localiser.close()
        self._requests.unregister()

    def _on_news(self) -> None:
        if not self._located.is_set() and self._localiser.pose()[0] is not None:
            self._located.set()


def waypoints_text(path: Path, waypoints: Sequence[Waypoint], map_file: Path | None) -> str:
    """Return the text of a waypoint file, as CSV or YAML depending on the path's suffix."""
    rows = [(w.name, *(f"{value:.3f}" for value in w.pose)) for w in waypoints]
    if path.suffix.lower() == ".csv":
        return "".join(f"{','.join(row)}\n" for row in [("name", "x", "y", "yaw"), *_cells(rows)])
    lines = ["# Saved while the robot was driven: x [m], y [m], yaw [rad] in the map frame."]
    if map_file is not None:
        lines.append(f"map: {_quoted(os.path.relpath(map_file, path.parent))}")
    lines.append("waypoints:")
    lines += [f"  - {{name: {_quoted(n)}, x: {x}, y: {y}, yaw: {yaw}}}" for n, x, y, yaw in rows]
    return "\n".join(lines) + "\n"


def _cells(rows: Sequence[tuple[str, ...]]) -> list[tuple[str, ...]]:
    """Return the rows of a CSV file; names with special characters are quoted."""
    return [
        (name if _PLAIN.fullmatch(name) else '"' + name.replace('"', '""') + '"', *numbers)
        for name, *numbers in rows
    ]


def _quoted(text: str) -> str:
    """Return a text as a YAML scalar on one line."""
    if text.isprintable():
        return "'" + text.replace("'", "''") + "'"
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    escaped = "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in escaped)
    return f'"{escaped}"'


def _read_lines(saver: WaypointSaver, end: Callable[[], object]) -> None:
    """Save a waypoint for each line typed; the end of the input ends the program."""
    rest = b""
    # os.read, not sys.stdin: at exit, the interpreter would wait for the lock of the buffer that a
    # blocked readline holds.
    while piece := os.read(sys.stdin.fileno(), 4096):
        *lines, rest = (rest + piece).split(b"\n")
        for line in lines:
            saver.save(line.decode(errors="replace"))
    end()


def main(argv: Sequence[str] | None = None) -> int:
    """Save waypoints until Ctrl-C or Ctrl-D; returns the exit code.

    Blocks: until then.
    """
    parser = argparse.ArgumentParser(
        prog="python -m smachpy_missions.tour.save_waypoints",
        description="Save where the robot is: by Enter (after a name, if you like), or by a text "
        f"on the topic {TOPIC}. Ctrl-D or Ctrl-C ends it.",
    )
    parser.add_argument("file", type=Path, help="the waypoint file to write: .yaml or .csv")
    parser.add_argument("--map", type=Path, metavar="FILE", help="to be named in a YAML file")
    parser.add_argument(
        "--namespace", help="of the robot, robot_1 say (default: the configuration's)"
    )
    parser.add_argument("--no-keys", action="store_true", help="listen to the topic only")
    try:
        names = parse_arguments(sys.argv[1:] if argv is None else argv)
        return _serve(parser.parse_args(names.rest), names)
    except (MissionError, ActionlibError) as error:
        print(f"save_waypoints: {error}", file=sys.stderr)
        return 2


def _serve(args: argparse.Namespace, names: NameArguments) -> int:
    config = load_config()
    space = config.namespace if args.namespace is None else args.namespace
    with (
        shutdown.handle_signals() as ending,
        Node("save_waypoints", namespace=space, config=config, arguments=names) as node,
    ):
        saver = WaypointSaver(args.file, node, lambda line: print(line, flush=True), args.map)
        try:
            saver.wait_for_robot()
            how = "" if args.no_keys else "[NAME] Enter saves where the robot is; "
            print(f"{how}topic {node.resolve(TOPIC)}; Ctrl-C ends it", flush=True)
            if not args.no_keys:
                clock = current_clock()
                clock.spawn(
                    lambda: _read_lines(saver, lambda: ending.request("the input ended")),
                    name="keys",
                )
            ending.event().wait()
        finally:
            saver.close()
        if saver.waypoints:
            count = len(load_tour(args.file).waypoints)  # what missions will read
            print(f"{args.file}: {count} waypoint{'s' if count > 1 else ''}")
    return 0


if __name__ == "__main__":
    sys.exit(run_program("save_waypoints", main))
