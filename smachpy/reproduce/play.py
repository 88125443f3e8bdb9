"""The world of a recording around a mission under test: servers, topics, operators, signals."""

from __future__ import annotations

from collections import Counter, defaultdict
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actionlib_core import border
from actionlib_core.exceptions import ActionlibError
from actionlib_core.interfaces import get_action, get_message, get_service
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.node import Node
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.pubsub.topic import Publisher
from smachpy.engine.control import ControlError
from smachpy.engine.preempt import asking
from smachpy.events import (
    Entered,
    GoalFeedback,
    GoalSent,
    Left,
    PreemptRequested,
    QuestionAsked,
    Started,
)
from smachpy.events.inputs import message_value
from smachpy.events.introspection import describe
from smachpy.reproduce.compare import Odd, Said, place
from smachpy.reproduce.world import is_outline
from smachpy.testing.servers import Reply
from smachpy.userdata.json_text import decoded
from smachpy.userdata.shown import literal

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from actionlib_core.action.server import ServerGoalHandle
    from actionlib_core.border import Crossing
    from smachpy.events import Event
    from smachpy.machines.container import Container
    from smachpy.reproduce.world import Act, Answer, RecordedGoal, RecordedService, World
    from smachpy.testing.kit import MissionKit
    from smachpy.testing.servers import ScriptedActionServer, ScriptedService

STEP_S: Final = 1.0
"""The run gets later than its recording by less than this from one event to the next [s]."""

NEAR_S: Final = 5.0
"""Of branches that call one service, each gets its own answer if the calls are so near [s]."""

LATER_S: Final = 0.001
"""A request to stop comes so much later, unless the run makes it itself meanwhile [s]."""

_WAITING: Final = (GoalStatus.PENDING, GoalStatus.RECALLING)
_RUNNING: Final = (GoalStatus.ACTIVE, GoalStatus.PREEMPTING)


_UNANSWERED: Final = frozenset({"ServiceTimeoutError", "NodeError"})
"""Errors of a call that its caller has ended."""


class Aligned:
    """Says when a moment of the recording is due in this run: what has happened ties both.

    Args:
        events: The recorded events of the run.
        kit: The test.
    """

    def __init__(self, events: Iterable[Mapping[str, Any]], kit: MissionKit) -> None:
        self._clock = kit.clock
        self._times: defaultdict[tuple[str, str], list[float]] = defaultdict(list)
        for event in events:
            if event["kind"] in {"Started", "Entered", "GoalSent", "Left"}:
                self._times[event["kind"], event["path"]].append(event["t"])
        self._seen: Counter[tuple[str, str]] = Counter()
        self._left = sorted(  # what has not happened yet, the next one last
            ((t, key, n) for key, times in self._times.items() for n, t in enumerate(times)),
            reverse=True,
        )
        self._offset: float | None = None
        self._newest = 0.0  # the latest recorded event that has come
        self.moved = self._clock.event("the run to come to the next recorded event")

    def on_event(self, event: Event) -> None:
        """Note an event of the run."""
        if not isinstance(event, Started | Entered | GoalSent | Left):
            return
        key = (type(event).__name__, event.path)
        number, self._seen[key] = self._seen[key], self._seen[key] + 1
        times = self._times[key]
        if number >= len(times):
            return
        offset = event.t - times[number]
        is_newest, self._newest = times[number] >= self._newest, max(self._newest, times[number])
        while self._left and self._left[-1][2] < self._seen[self._left[-1][1]]:
            self._left.pop()
        # Code that computed then takes no time now. But a run that has taken another way, and left
        # something out or does something else, keeps its time.
        is_on_the_way = not self._left or self._left[-1][0] > times[number] - STEP_S
        later = 0.0 if self._offset is None else offset - self._offset
        # An event that came before others is of another branch.
        if is_newest and (abs(later) < STEP_S or (later < 0.0 and is_on_the_way)):
            is_earlier = self._offset is None or offset < self._offset - 1e-6
            self._offset = offset
            if is_earlier:
                self.moved.set()

    def wait_until(self, t: float) -> None:
        """Wait until the moment `t` of the recording has come in this run."""
        while self._offset is None or self._clock.now() < t + self._offset - 1e-9:
            left = None if self._offset is None else t + self._offset - self._clock.now()
            self.moved.wait(left)
            self.moved.clear()


class Player:
    """Plays the world of a recording in a test.

    Args:
        kit: The test; it is open.
        world: What the world did.
        events: The recorded events of the run.

    Attributes:
        problems: What could not be played, in words.
        said: What conditions said of messages.
        odd_requests: Requests to services that differ from the recorded ones; `at` is a moment of
            this run.
        count: Number of events until now, besides feedback: not all that was recorded comes again.
    """

    def __init__(self, kit: MissionKit, world: World, events: list[dict[str, Any]]) -> None:
        self.problems: list[str] = []
        self._kit = kit
        self._world = world
        self._clock = kit.clock
        self._aligned = Aligned(events, kit)
        self._events = events
        self._node = Node("world", transport=kit.network.session(), clock=kit.clock)
        self._publishers: dict[str, Publisher] = {}
        self._servers: dict[str, _Server] = {}
        self._services: dict[str, _Service] = {}
        self._questions: dict[str, str] = {}  # path of a state -> service that takes the answer
        self._asked: list[tuple[float, tuple[str, str, str]]] = []  # requests to stop of the run
        self._subscribers: Counter[str] = Counter()
        self._subscribed = kit.clock.event("a subscriber of the recording")
        self.said: list[Said] = []
        self.odd_requests: list[Odd] = []
        self._published: Counter[str] = Counter()
        self._entered: dict[str, int] = {}  # path -> number of the event
        self.count = 0
        self._machine: Container

    def open(self) -> None:
        """Offer the servers and topics that are there when the run begins."""
        for name, action in self._world.actions.items():
            if (
                not action.is_own
                and (kind := self._kind(get_action, action.type, name)) is not None
            ):
                server = self._servers[name] = _Server(self, name, kind, action.goals)
                if action.is_there:
                    server.come()
        for name, service in self._world.services.items():
            if (
                not service.is_own
                and (kind := self._kind(get_service, service.type, name)) is not None
            ):
                self._services[name] = _Service(self, name, kind, service)
        for act in self._world.acts:
            is_new = act.what == "message" and act.name not in self._publishers
            if is_new and (kind := self._kind(get_message, act.type, act.name)) is not None:
                latch = self._world.topics[act.name]
                made = Publisher(f"/{act.name}", kind, latch=latch, node=self._node)
                self._publishers[act.name] = made

    def begin(self, machine: Container) -> Callable[[], None]:
        """Play during the run of `machine` that follows; return a function that ends it."""
        self._machine = machine
        for path in sorted(self._world.breakpoints):
            try:
                machine.control.add_breakpoint(path)
            except ControlError as error:
                self.problems.append(str(error))
        unsubscribe = machine.subscribe(self._on_event)
        topics: defaultdict[str, list[Act]] = defaultdict(list)
        for act in self._world.acts:
            topics[act.name if act.what == "message" else ""].append(act)
        for name, acts in topics.items():
            what = f"the recorded topic {name}" if name else "the recorded world"
            self._clock.spawn(partial(self._play, acts), name=what)
        stop = border.listen(self._note)
        for service in self._services.values():
            service.begin()

        def end() -> None:
            unsubscribe()
            stop()
            self._node.close()

        return end

    def value(self, data: Any, where: str) -> Any:
        """Return a recorded message; None, and a problem, if it cannot be made."""
        if data is None or is_outline(data):  # which the world lists as lacking
            return None
        try:
            return decoded(data, where)
        except (ValueError, ActionlibError) as error:
            self.problems.append(f"{where}: {error}")
            return None

    def note_request(self, name: str, recorded: Any, now: Any) -> None:
        """Note that a service is asked something else than then."""
        states = [
            state.path
            for state in describe(self._machine).walk()
            if f"/{name}".endswith(f"/{dict(state.details).get('service', ' ').strip('/')}")
        ]
        path = max(states, key=lambda one: self._entered.get(one, -1), default="")
        then, is_ = (f"{place(path)}  asks {name} {literal(one)}" for one in (recorded, now))
        self.odd_requests.append(Odd(self._clock.now(), path, then, is_, self.count))

    def wait_until(self, t: float) -> None:
        """Wait until a moment of the recording."""
        self._aligned.wait_until(t)

    @property
    def clock(self) -> Any:
        """The test's clock."""
        return self._clock

    @property
    def kit(self) -> MissionKit:
        """The test."""
        return self._kit

    def _kind(self, find: Callable[[str], Any], type_name: str, name: str) -> Any:
        try:
            return find(type_name)
        except ActionlibError as error:
            self.problems.append(f"{name}: {error}")
            return None

    def _on_event(self, event: Event) -> None:
        if isinstance(event, GoalFeedback):
            return
        self._aligned.on_event(event)
        if self.count in self._world.pauses:
            self._machine.control.pause()
        if isinstance(event, Entered):
            self._entered[event.path] = self.count
        self.count += 1
        if isinstance(event, QuestionAsked):
            self._questions[event.path] = event.service
        elif isinstance(event, PreemptRequested):
            self._asked.append((event.t, (event.source, event.by, event.why)))

    # -- what is done at a time ----------------------------------------------------------------

    def _note(self, crossing: Crossing) -> None:
        if crossing.what == "subscriber":
            self._subscribers[crossing.name] += 1
            self._subscribed.set()
        elif crossing.what == "said":
            value = message_value(crossing.value)
            said = Said(crossing.t, crossing.name, crossing.key, value, crossing.state, self.count)
            self.said.append(said)
        elif crossing.what == "published":
            number, self._published[crossing.name] = (
                self._published[crossing.name],
                self._published[crossing.name] + 1,
            )
            # Nothing is locked there, and the clock is virtual: it may wait.
            joined = self._world.own.get(crossing.name, [])
            if number < len(joined):  # the mission talks to itself
                self._wait_for_subscribers(crossing.name, joined[number])

    def _wait_for_subscribers(self, name: str, count: int) -> None:
        """Wait until those are there that got the message; not for ever: they may never come."""
        until = self._clock.now() + STEP_S
        while self._subscribers[name] < count and self._clock.now() < until:
            self._subscribed.wait(until - self._clock.now())
            self._subscribed.clear()

    def _play(self, acts: list[Act]) -> None:
        for act in acts:
            if act.what == "preempt":
                self._clock.spawn(partial(self._preempt, act), name="a request to stop")
                continue
            self.wait_until(act.t)
            self._do(act)

    def _do(self, act: Act) -> None:
        if act.what == "message":
            self._wait_for_subscribers(act.name, act.subscribers)
            message = self.value(act.value, act.name)
            if message is not None and act.name in self._publishers:
                self._publishers[act.name].publish(message)
        elif act.what == "server" and act.name in self._servers:
            server = self._servers[act.name]
            {"up": server.come, "down": server.die, "cut": server.cut}[act.state]()
        elif act.what == "asked":
            self._clock.spawn(lambda: self._ask(act), name=f"a caller of {act.name}")
        elif act.what == "answer":
            self._clock.spawn(lambda: self._answer(act), name="the operator")
        elif act.what == "resume":
            self._machine.control.resume()
        elif act.what == "step":
            self._machine.control.step()

    def _ask(self, act: Act) -> None:
        kind = self._kind(get_service, act.type, act.name)
        request = self.value(act.value, act.name)
        if kind is not None and request is not None:
            try:
                ServiceProxy(f"/{act.name}", kind, timeout=5.0, node=self._node)(request)
            except ActionlibError as error:  # the caller's, as it may have been then
                self.problems.append(f"{act.name}: {error}")

    def _answer(self, act: Act) -> None:
        from smachpy.states.questions import AnswerQuestion

        service = self._questions.get(act.name)
        if service is None:
            self.problems.append(f"{act.name}: asks nothing; expected a question to answer")
            return
        proxy = ServiceProxy(f"/{service}", AnswerQuestion, timeout=5.0, node=self._node)
        try:
            proxy(answer=act.text, by=str(act.value))
        except ActionlibError as error:
            self.problems.append(f"{act.name}: {error}")

    def _preempt(self, act: Act) -> None:
        self.wait_until(act.t)
        now, origin = self._clock.now(), (act.state, act.text, str(act.value))
        if act.state == "program":
            self._clock.sleep(LATER_S)
        if any(t >= now - STEP_S and known == origin for t, known in self._asked):
            return  # code of the mission has made it
        control = self._machine.control
        why, root = str(act.value), f"/{self._machine_name()}"
        try:
            if act.state in {"signal", "shutdown"}:
                self._kit.shutdown.request(act.text)  # which asks the run
            elif act.state == "operator" and why.startswith("jump to "):
                control.jump(why.removeprefix("jump to "))
            elif act.state == "operator" and why.startswith("force "):
                outcome, _, path = why.removeprefix("force ").partition(" of ")
                control.force_outcome(path, outcome.strip("'"))
            elif act.state == "operator" and why == "pause":
                control.pause(running="cancel")
            elif act.name.count("/") > 1 and act.name != root:
                with asking(act.state, act.text, why):
                    control.preempt(act.name)
            else:
                with asking(act.state, act.text, why):
                    self._machine.request_preempt()
        except ControlError as error:
            self.problems.append(str(error))

    def _machine_name(self) -> str:
        return str(self._events[0]["path"]).strip("/") if self._events else ""


class _Server:
    """The server of one action: it does with each goal what was done with that of the recording."""

    def __init__(self, player: Player, name: str, kind: Any, goals: list[RecordedGoal]) -> None:
        self._player = player
        self._name = name
        self._kind = kind
        self._left = list(goals)
        self._cancels: dict[str, tuple[Any, list[float]]] = {}
        self._life = 0
        self._double: ScriptedActionServer | None = None
        self._is_there = False

    def come(self) -> None:
        """Come, or come back."""
        self._life += 1
        if self._double is None:
            self._double = self._player.kit.action_server(f"/{self._name}", self._kind)
            self._double.choose_by(lambda: Reply(function=self._play))
        elif self._is_there:
            self._double.restore()
        else:
            self._double.come_back()
        self._is_there = True

    def die(self) -> None:
        """Die with all goals."""
        if self._double is not None and self._is_there:
            self._life += 1
            self._is_there = False
            self._double.kill()

    def cut(self) -> None:
        """Lose the network, with the goals going on."""
        if self._double is not None:
            self._double.cut()

    def _play(self, handle: ServerGoalHandle) -> None:
        recorded = self._take(message_value(handle.get_goal()))
        if recorded is None:
            self._player.problems.append(
                f"{self._name}: one goal more than the recording has: nobody knows its answer"
            )
            return
        clock, life = self._player.clock, self._life
        begun, cancelled_at = clock.now(), None
        cancel = _cancel_of(self._double, handle)
        for answer in recorded.answers:
            if answer.of_cancel and cancelled_at is None:
                cancel.wait()
                cancelled_at = clock.now()
            if answer.of_cancel:
                clock.sleep(max(0.0, (cancelled_at or 0.0) + answer.after - clock.now()))
            elif cancelled_at is not None or cancel.wait(
                max(0.0, begun + answer.after - clock.now())
            ):
                # It is cancelled earlier than then: what follows is what followed the cancel.
                cancelled_at = clock.now() if cancelled_at is None else cancelled_at
                if recorded.cancelled is None and self._life == life:
                    self._give(handle, "PREEMPTED", None, "cancelled earlier than recorded")
                    return
                continue
            if self._life != life:
                return
            self._do(handle, answer)

    def _do(self, handle: ServerGoalHandle, answer: Answer) -> None:
        value = self._player.value(answer.value, f"{self._name} {answer.what}")
        if answer.what == "accept":
            if handle.get_goal_status().status in _WAITING:
                handle.set_accepted()
        elif answer.what == "end":
            self._give(handle, answer.state, value, answer.text)
        elif value is not None:
            handle.publish_feedback(value)

    def _take(self, goal: Any) -> RecordedGoal | None:
        """Return the first recorded goal that is equal, else the first one, and use it up."""
        same = next((one for one in self._left if one.value == goal), None)
        found = same or (self._left[0] if self._left else None)
        if found is not None:
            self._left.remove(found)
        return found

    @staticmethod
    def _give(handle: ServerGoalHandle, state: str, result: Any, text: str) -> None:
        """End a goal as it ended then; one that was lost ends by its client, or with its server."""
        status = handle.get_goal_status().status
        if status not in (*_WAITING, *_RUNNING) or state == "LOST":
            return
        if state in {"SUCCEEDED", "ABORTED", "PREEMPTED"} and status in _WAITING:
            handle.set_accepted()
        if state == "REJECTED":
            handle.set_rejected(result, text)
        elif state == "SUCCEEDED":
            handle.set_succeeded(result, text)
        elif state == "ABORTED":
            handle.set_aborted(result, text)
        else:
            if handle.get_goal_status().status == GoalStatus.ACTIVE:
                handle.set_cancel_requested()
            handle.set_canceled(result, text)


def _cancel_of(double: ScriptedActionServer | None, handle: ServerGoalHandle) -> Any:
    assert double is not None
    return double.cancel_of(handle.get_goal_id().id)


class _Service:
    """A service that answers as it did."""

    def __init__(self, player: Player, name: str, kind: Any, recorded: RecordedService) -> None:
        self._player = player
        self._name = name
        self._kind = kind
        self._left = [call for call in recorded.calls if call.state != "ServiceUnavailableError"]
        self._absent = recorded.absent
        self._double: ScriptedService | None = None
        if not recorded.absent:
            self._come()

    def begin(self) -> None:
        """Come and go during the run, if it did."""
        if self._absent:
            self._player.clock.spawn(self._come_and_go, name=f"the server of {self._name}")

    def _come_and_go(self) -> None:
        for number, (_, until) in enumerate(self._absent):
            self._player.wait_until(until)
            later = self._absent[number + 1 :]
            if any(call.t >= until for call in self._left) and not (later and later[0][0] <= until):
                self._come()
                if later:
                    used = [
                        call.t + (call.after or 0.0) for call in self._left if call.t < later[0][0]
                    ]
                    self._player.wait_until(max([until, *used]) + LATER_S)
                    self._leave()

    def _come(self) -> None:
        self._double = self._player.kit.service_server(f"/{self._name}", self._kind)
        self._double.choose_by(lambda: Reply(function=self._answer))

    def _leave(self) -> None:
        if self._double is not None:
            self._double.close()

    def _answer(self, request: Any) -> Any:
        clock = self._player.clock
        value = message_value(request)
        near = self._left[0].t + NEAR_S if self._left else 0.0
        same = next((one for one in self._left if one.request == value and one.t <= near), None)
        call = same or (self._left[0] if self._left else None)
        if call is not None and same is None and not is_outline(call.request):
            self._player.note_request(self._name, call.request, value)
        if call is None:
            self._player.problems.append(f"{self._name}: one request more than the recording has")
            raise RuntimeError("the recording has no such request")
        self._left.remove(call)
        if call.after is None or call.state in _UNANSWERED:
            clock.event(f"the end of the run of {self._name}").wait()
        clock.sleep(call.after or 0.0)
        if call.state == "ServiceLostError" and self._double is not None:
            self._double.kill()
            clock.event(f"the end of the run of {self._name}").wait()
        if call.state:
            raise RuntimeError(call.text)
        response = self._player.value(call.response, f"{self._name} response")
        return self._kind._response_class() if response is None else response
