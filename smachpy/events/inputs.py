"""What crossed a mission's border during its run, as records of its recording.

Records of kind "Crossed" have the fields of `actionlib_core.border.Crossing`; those without content
are left out. `value` is a message in the form of `smachpy.userdata.json_text`. Secrets in it are
masked, and `hidden` is true then. A large one is replaced by `{"$hash", "bytes", "shown"}` unless
all inputs are recorded: the beginning of its SHA-256 sum, the size of its text and what fits of it.

`origin` of the header says what ran: `mission`, its name and arguments as the command that began it
had them; `userdata` at the begin; `code` (`smachpy.events.code`); `inputs`, which of them are
recorded; `t`, the mission's clock at the time of the header's stamp.
"""

from __future__ import annotations

import hashlib
import json
from collections import deque
from typing import TYPE_CHECKING, Any, Final, Literal, NotRequired, TypeAlias, TypedDict, get_args

from actionlib_core import border
from actionlib_core.inputs.checked_data import Number  # noqa: TC001  read at run time
from smachpy.events.code import code_facts
from smachpy.userdata.json_text import encoded
from smachpy.userdata.secret import MASK, is_secret, masked
from smachpy.userdata.shown import Room, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actionlib_core.border import Crossing
    from actionlib_core.clock import Clock

CROSSED: Final = "Crossed"

Which: TypeAlias = Literal["all", "seen", "none"]
WHICH: Final[tuple[str, ...]] = get_args(Which)

LARGE: Final = 10_000
"""Longest text of a message that is recorded whole unless all are [characters of JSON]."""

WAITING: Final = 100_000
"""Number of crossings that wait to be written; later ones are dropped and counted."""

_OF_NODE: Final = frozenset({"asked", "published"})
"""Of the mission's node only: a simulated robot may be in the same process."""

_AT_ONCE: Final = frozenset({"goal", "request", "published", "once"})
"""Programs use the messages that they send again; those that arrive are new."""

_OWN: Final = "/smach/"
"""Part of the names of the topics and services by which missions are shown and operated."""


class Inputs:
    """Collects what crosses the border from now on.

    Args:
        which: "all": large messages are recorded whole; "seen": as hash and summary.
        clock: The mission's.
        node: Full name of its node; "" if it has none yet. Requests to other nodes of this
            process are not its inputs.
        on_news: Called when there is something to take; it must not block.

    Threads: it collects in any thread; `take` may be called from one.
    """

    def __init__(
        self, which: Which, clock: Clock, node: str, on_news: Callable[[], object]
    ) -> None:
        self._is_whole = which == "all"
        self._node = node
        self._on_news = on_news
        self._begun_ns = clock.time_ns() - round(clock.now() * 1e9)
        self._waiting: deque[Crossing | dict[str, Any]] = deque()
        self._lost = 0
        self.close = border.listen(self._note)

    def _note(self, crossing: Crossing) -> None:
        if _OWN in crossing.name or (
            crossing.what in _OF_NODE and self._node and crossing.node != self._node
        ):
            return
        if len(self._waiting) >= WAITING:
            self._lost += 1
            return
        at_once = crossing.what in _AT_ONCE
        self._waiting.append(self._record(crossing) if at_once else crossing)
        self._on_news()

    def take(self, most: int) -> list[dict[str, Any]]:
        """Return the records since the last call, `most` at most."""
        found = []
        for _ in range(min(most, len(self._waiting))):
            one = self._waiting.popleft()
            found.append(one if isinstance(one, dict) else self._record(one))
        if self._lost and found:
            lost, self._lost = self._lost, 0
            last = found[-1]
            found.append({**_common(last["t"], last["stamp_ns"]), "what": "lost", "key": str(lost)})
        return found

    def _record(self, crossing: Crossing) -> dict[str, Any]:
        record = _common(crossing.t, self._begun_ns + round(crossing.t * 1e9))
        for key in ("what", "name", "type", "key", "state", "text"):
            if said := getattr(crossing, key):
                record[key] = said
        if crossing.value is not None:
            value = message_value(crossing.value, crossing.key if crossing.what == "once" else "")
            text = json.dumps(value)
            if MASK in text:
                record["hidden"] = True
            is_whole = self._is_whole or len(text) <= LARGE
            record["value"] = value if is_whole else _outline(masked(crossing.value), text)
        return record


def message_value(message: Any, name: str = "") -> Any:
    """Return a message, or another value with a name, as recordings have it: with masked secrets.

    Left out are the fields that a new message of ROS 1 has anyway: 0, "", false and no items.
    """
    value = encoded(masked(message, name))
    is_message = isinstance(value, dict) and "$msg" in value
    if not is_message or getattr(message, "_wire", "") == "ros2":  # those have defaults
        return value
    return {**value, "fields": _needed(value["fields"])}


def _needed(fields: dict[str, Any]) -> dict[str, Any]:
    short = {key: _needed(one) if isinstance(one, dict) else one for key, one in fields.items()}
    return {key: one for key, one in short.items() if one}


def _common(t: float, stamp_ns: int) -> dict[str, Any]:
    return {"kind": CROSSED, "path": "", "stamp_ns": stamp_ns, "t": t}


def _outline(value: Any, text: str) -> dict[str, Any]:
    digest = hashlib.sha256(text.encode()).hexdigest()[:16]
    return {"$hash": digest, "bytes": len(text), "shown": shown(value, Room())}


class MissionFacts(TypedDict):
    """How a command began a mission; each is missing if it was a program."""

    target: NotRequired[str]
    folder: NotRequired[str]
    words: NotRequired[list[str]]
    inputs: NotRequired[dict[str, str]]
    names: NotRequired[list[str]]
    robot: NotRequired[str]
    time: NotRequired[str]
    seed: NotRequired[int]


class CodeFacts(TypedDict):
    """As `smachpy.events.code.code_facts` returns them."""

    files: NotRequired[dict[str, str]]
    constants: NotRequired[dict[str, str]]
    versions: NotRequired[dict[str, str]]
    hash: NotRequired[str]
    folder: NotRequired[str]
    commit: NotRequired[str]
    dirty: NotRequired[bool]


class OriginFacts(TypedDict):
    """What ran; see above. `namespace` is that of the mission's node, if it was known."""

    t: Number
    namespace: str
    inputs: str
    mission: MissionFacts
    userdata: dict[str, Any]
    code: CodeFacts


def origin_facts(
    clock: Clock,
    namespace: str,
    mission: Mapping[str, Any],
    userdata: Mapping[str, Any],
    which: Which,
) -> dict[str, Any]:
    """Return `origin` of the header."""
    mission = masked(dict(mission))
    given = mission.get("inputs", {})
    hidden = {key: MASK for key in given if is_secret(userdata.get(key))}
    if hidden:  # a key whose own value is a secret, whatever its name
        mission = {**mission, "inputs": {**given, **hidden}}
    return {
        "t": clock.now(),
        "namespace": namespace,
        "inputs": which,
        "mission": encoded(mission),
        "userdata": {key: encoded(masked(value, key)) for key, value in userdata.items()},
        "code": code_facts(),
    }
