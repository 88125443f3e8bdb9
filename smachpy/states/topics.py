"""States that publish a message, and that look up a transform."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any, ClassVar, Final

from actionlib_core.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from actionlib_core.interfaces.std_msgs.msg import Header
from actionlib_core.node import get_node
from actionlib_core.pubsub.topic import Publisher
from actionlib_core.time import Time
from smachpy.actions.wakeup import PreemptedError, Wakeup, answer_preempt, call_blocking
from smachpy.base import log
from smachpy.base.context import current_path
from smachpy.base.problems import Problems
from smachpy.exceptions import InvalidStateError
from smachpy.machines.state import State
from smachpy.states.frames import FrameError
from smachpy.states.localising import MAP_FRAME, Transforms
from smachpy.userdata.readonly import writable

if TYPE_CHECKING:
    from typing import Unpack

    from actionlib_core.time import Duration
    from smachpy.actions.interface import UntimedOptions
    from smachpy.events.introspection import Kind
    from smachpy.userdata.user_data import UserData

OUTCOMES: Final = ("succeeded", "aborted", "preempted")
SUBSCRIBER_S: Final = 5.0  # [s] a subscriber that is there is found in a fraction of it
TRANSFORM_S: Final = 5.0  # [s] a robot sends its transforms several times a second


class Publish(State):
    """Publishes a message once somebody listens. Outcomes: 'succeeded', 'aborted', 'preempted'.

    'aborted': there are too few subscribers within `timeout`. Nothing is published then, and the
    log says how many there are.

    Args:
        topic: Name of the topic.
        msg_type: Class of the message.
        message: The message, or a dict of its fields, in which a `Header` may be "auto": stamped
            when it is published; None: the default one.
        key: The userdata key of the message or of a dict of its fields, instead.
        subscribers: How many subscribers to wait for; 0: it publishes at once, and who listens
            later gets nothing unless it latches.
        latch: The message stays on the topic for later subscribers, until the program ends or the
            state is visited again; it waits for none then.
        timeout: Longest wait for the subscribers [s]; None: no limit, 0: it looks once.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
    """

    def __init__(
        self,
        topic: str,
        msg_type: Any,
        message: Any = None,
        *,
        key: str | None = None,
        subscribers: int = 1,
        latch: bool = False,
        timeout: float | Duration | None = SUBSCRIBER_S,
        **options: Unpack[UntimedOptions],
    ) -> None:
        problems = Problems(f"{type(self).__name__} {topic!r}")
        keys = [] if key is None else [problems.word("key", key)]
        with problems:
            super().__init__(OUTCOMES, keys, **options)
        self.__topic = problems.network_name("topic", topic)
        problems.kind_of("msg_type", msg_type, "_slot_types", "a class of messages")
        self.__msg_type = msg_type
        if key is not None and message is not None:
            problems.add("message, key: got both; expected one of them.")
        self.__key = key
        expected = "a number of subscribers, 0 or more"
        self.__subscribers = problems.whole("subscribers", subscribers, 0, expected)
        self.__latch = latch
        self.__timeout_s = problems.seconds("timeout", timeout)
        # A latched message waits for nobody: what differs from the defaults was meant for a wait.
        for name, given, default in (
            ("subscribers", self.__subscribers, (0, 1)),
            ("timeout", self.__timeout_s, (SUBSCRIBER_S,)),
        ):
            if latch and given not in default:
                problems.add(f"latch, {name}: got both; expected one of them.")
        problems.raise_all()
        with problems:
            _as_message("message", msg_type, message)
        problems.raise_all()
        self.__message = copy.deepcopy(message)
        self.__latched: Publisher | None = None

    def execute(self, userdata: UserData) -> str:
        """Wait for the subscribers, and publish.

        Raises:
            InvalidStateError: the value of the key is no such message.
            TypeMismatchError: there are subscribers, but all of them have another type.

        Blocks: until the subscribers are there, `timeout` or a preempt; while a link is full.
        """
        if answer_preempt(self):
            return "preempted"
        where = f"{current_path() or type(self).__name__}: {self.__key or 'message'}"
        given = self.__message if self.__key is None else writable(userdata[self.__key])
        message = _as_message(where, self.__msg_type, given)
        if self.__latch:
            self.__latching().publish(message)
            return "succeeded"
        with Publisher(self.__topic, self.__msg_type) as publisher:
            try:
                if not self.__is_heard(publisher):
                    return "aborted"
            except PreemptedError:
                return "preempted"
            if answer_preempt(self):  # as the subscriber appeared
                return "preempted"
            # Made anew: a header that is "auto" tells when it was published.
            publisher.publish(_as_message(where, self.__msg_type, given))
        return "succeeded"

    def __latching(self) -> Publisher:
        """Return the publisher that keeps the message: the same one at each visit on a node."""
        found = self.__latched
        if found is None or found.node is not get_node() or found.node.closed:
            found = self.__latched = Publisher(self.__topic, self.__msg_type, latch=True)
        return found

    def __is_heard(self, publisher: Publisher) -> bool:
        wanted, longest = self.__subscribers, self.__timeout_s
        if not wanted:
            return True
        call_blocking(
            self,
            lambda: publisher.wait_for_connections(wanted, longest),
            publisher.unregister,
            f"subscribers of {publisher.name}",
        )
        found = publisher.get_num_connections()
        if found >= wanted:
            return True
        if publisher.mismatches and not found:
            raise publisher.mismatches[0]
        log.logwarn(
            f"{current_path() or type(self).__name__}: topic {publisher.name}: got {found} "
            f"subscribers in {longest or 0:g} s; expected {wanted} of type {publisher.type}. "
            f"Nothing was published. Try 'actionlib topic info {publisher.name}'."
        )
        return False

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the topic."""
        kind, details = super().describe_details()
        return kind, (("topic", self.__topic), ("type", self.__msg_type._type), *details)


class LookUpTransform(State):
    """Writes where a frame is to a key. Outcomes: 'succeeded', 'aborted', 'preempted'.

    The value is the pose of `frame` in the frame `into`: a `geometry_msgs/PoseStamped`, to which
    `drive_to` can drive, with the time of the transform. Only transforms that arrive while the
    state runs count, and latched ones.

    'aborted': there is no such transform within `timeout`; the log says which frames there are.

    Args:
        key: The userdata key that gets the pose.
        frame: The frame to look for, "base_link" for example.
        into: The frame of the result.
        tf: The topic of the transforms, if a robot has its own; `/tf` is always read, too, and
            both with `_static` behind their names.
        timeout: Longest wait [s]; None: no limit, 0: it looks once.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
    """

    _smachpy_kind: ClassVar[Kind] = "monitor"

    def __init__(
        self,
        key: str,
        frame: str,
        into: str = MAP_FRAME,
        *,
        tf: str = "tf",
        timeout: float | Duration | None = TRANSFORM_S,
        **options: Unpack[UntimedOptions],
    ) -> None:
        problems = Problems(f"LookUpTransform {frame!r}")
        self.__key = problems.word("key", key)
        with problems:
            super().__init__(OUTCOMES, (), [key], **options)
        self.__frame, self.__into = problems.word("frame", frame), problems.word("into", into)
        self.__topic = problems.network_name("tf", tf)
        self.__timeout_s = problems.seconds("timeout", timeout)
        problems.raise_all()

    def execute(self, userdata: UserData) -> str:
        """Wait for the transform.

        Blocks: until it is known, `timeout` or a preempt.
        """
        with Wakeup(self) as wake:
            longest = self.__timeout_s
            until = None if longest is None else wake.clock.now() + longest
            transforms = Transforms(self.__topic, get_node(), wake.set)
            try:
                while not answer_preempt(self):
                    wake.clear()
                    try:
                        there, stamp_ns = transforms.frames.look_up(self.__into, self.__frame)
                    except FrameError as error:
                        problem = str(error)
                    else:
                        header = Header(stamp=Time.from_nsec(stamp_ns), frame_id=self.__into)
                        pose = Pose(Point(*there[:3]), Quaternion(*there[3:]))
                        userdata[self.__key] = PoseStamped(header, pose)
                        return "succeeded"
                    if until is not None and wake.clock.now() >= until:
                        known = ", ".join(transforms.frames.names()) or "none"
                        log.logwarn(
                            f"{current_path() or type(self).__name__}: no transform from "
                            f"{self.__frame!r} to {self.__into!r} in {longest:g} s: {problem} "
                            f"Frames that are known: {known}."
                        )
                        return "aborted"
                    wake.wait_until(until)
            finally:
                transforms.close()
        return "preempted"

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the frames."""
        kind, details = super().describe_details()
        return kind, (("transform", f"{self.__frame} -> {self.__into}"), *details)


def _as_message(where: str, kind: Any, value: Any) -> Any:
    """Return a message of a class from one, from a dict of its fields, or from None."""
    if isinstance(value, kind):
        return value
    try:
        return kind.from_dict({} if value is None else value)
    except Exception as error:
        raise InvalidStateError(
            f"{where}: got {value!r}; expected a {kind._type}, or a dict of its fields: {error}"
        ) from error
