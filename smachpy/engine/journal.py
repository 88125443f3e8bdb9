"""What a run writes down before it does it, and where a resumed run goes on.

Every run has a journal. That of a durable mission is `smachpy.durable.recorder.Recorder`, which has
the same methods; the others have `NO_JOURNAL`, which keeps nothing and remembers nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from actionlib_core.resources import Policy
    from smachpy.engine.frame import Frame
    from smachpy.engine.visit import Origin, Override


class RunJournal:
    """The journal of a run that is not durable; its methods are the hooks of one that is.

    A run that is resumed in another process is entered again down to the states that were active;
    on the way the journal says where its containers and states were.

    A `step` is a compiled child, a `smachpy.engine.step.Step`; that module imports this one.

    Attributes:
        run: The run's name in recordings and viewers; "" has none.
        is_durable: Whether another process may go on with the run.

    Threads: any thread of the run.
    """

    run = ""
    is_durable = False

    @property
    def is_taken_over(self) -> bool:
        """Whether another process goes on with the run already, and follows its goals."""
        return False

    # -- the run and its children --------------------------------------------------------------

    def attach(self, root: Frame) -> tuple[Any, ...] | None:
        """Record the run that begins in `root`, or resume it.

        Returns:
            The fields of the event `Recovered` for a resumed run; None for a new one.
        """

    def finish(self, outcome: str) -> None:
        """Write that the run ends."""

    def enter(self, frame: Frame, step: Any) -> str | None:
        """Write that `step` begins; return its outcome if it had ended before the resume."""

    def execute(self, frame: Frame, step: Any, userdata: Any) -> Any:  # noqa: ARG002
        """Execute `step`, or its option `resume` instead; write and return the outcome."""
        return step.execute(userdata)

    def retried(self, frame: Frame, attempt: int, wait: float, reason: str) -> None:
        """Write that attempt number `attempt` has ended, and the next begins in `wait` [s]."""

    def asked(self, frame: Frame, origin: Origin) -> bool:  # noqa: ARG002
        """Note that the container of `frame` was asked to stop; `commit` writes it.

        Returns:
            Whether the journal will pass the request on itself, once all states that were active
            have been entered again: a state that is not entered yet could not cancel its goal.
        """
        return False

    def has_served(self, path: str) -> bool:  # noqa: ARG002
        """Note that the container at `path` gets the present request to stop, to pass it on.

        Returns:
            Whether it has got it before the resume, and begun another child since: that one is not
            asked.
        """
        return False

    def holds_back(self, path: str) -> bool:  # noqa: ARG002
        """Return whether the journal will pass the present request on to the container at `path`.

        It does so once all states that were active have been entered again, as for `asked`.
        """
        return False

    def passes(self, path: str) -> bool:  # noqa: ARG002
        """Return whether the present request to stop goes to the child at `path`.

        It does not if the child has withdrawn it before the resume.
        """
        return True

    def recalled(self, path: str) -> None:
        """Note that the child at `path` withdraws the requests to stop that it has got."""

    def asked_one(
        self,
        frame: Frame,
        step: Any,
        override: Override | None,
        left: Mapping[str, str] | None = None,
    ) -> None:
        """Note that an operator asked the child of `step` to stop, with the override.

        A resumed run asks it again.

        Args:
            frame: Where it runs.
            step: The child.
            override: What follows instead.
            left: Where the next run of the child goes on: path of a machine -> label.
        """

    def commit(self) -> None:
        """Write what was only noted, as the run's lock was held: requests to stop.

        They are told before that, and do not wait for a slow disk or database. What is written next
        comes after them in any case.

        Blocks: for the disk, or the database; never call it with the run's lock held.
        """

    def stopped(self) -> None:
        """Write that an emergency stop holds the machine: a resumed run is stopped, too."""

    def released(self) -> None:
        """Write that no emergency stop holds the machine any more."""

    # -- resources -----------------------------------------------------------------------------

    def take(
        self,
        resource: str,
        path: str,
        policy: Policy,
        stop: Callable[[str], object],
    ) -> str | None:
        """Take a resource from the missions of other processes, or wait for it.

        Who waits calls it again, or `give`.

        Args:
            resource: Its full name.
            path: The state that needs it; it has it from the states of this process already.
            policy: What to do while another mission holds it.
            stop: Asks the state to stop, for the one that is given as text; it does not block.

        Returns:
            Who is in the way, for people; None if the mission holds the resource.
        """

    def former_holder(self, resource: str, path: str) -> str | None:
        """Return the state that held a resource before the resume and is about to take it again.

        None if there is none, or it is the state at `path`.
        """

    def give(self, resource: str) -> None:
        """Give a resource back to the missions of other processes, or wait no longer."""

    # -- the position before the resume --------------------------------------------------------

    def must_return(self, path: str) -> bool:  # noqa: ARG002
        """Return whether the state at `path` was active before the resume, and is not back yet."""
        return False

    def has_begun(self, path: str) -> bool:  # noqa: ARG002
        """Return whether children of the container at `path` had begun before the resume."""
        return False

    def resumed_label(self, frame: Frame) -> str | None:
        """Return the child in which the state machine of `frame` resumes; None if it starts."""

    def wanted_label(self, frame: Frame) -> str | None:
        """Return the child to which a request leads that was made before the resume, or None."""

    def ending(self, frame: Frame) -> Sequence[Any] | None:
        """Return the fields of the `Ending` for which the clean-up of `frame` began, or None."""

    def cleaned_up(self, frame: Frame, step: Any) -> None:
        """Write that the clean-up `step` is over, and the exception before it is raised now.

        A resumed run goes on with the state that has raised it, which may be repaired by then.
        """

    def item(self, frame: Frame, number: int) -> int:  # noqa: ARG002
        """Compare an item of the iterator of `frame` with the position before the resume.

        Returns:
            < 0: the item was done. 0: it was the current one, and is in the userdata. > 0: it is
            new.
        """
        return 1

    def check_items(self, frame: Frame, count: int) -> None:
        """Check that there are at least as many items as before the resume."""

    def resumed_plan(self, frame: Frame) -> tuple[Sequence[str], Mapping[str, Any]] | None:
        """Return where the plan of `frame` resumes; None if it starts.

        Returns:
            The ids of the places that hold tokens, and label -> visit of each action that runs or
            has ended, with the fields: outcome (None while it runs); begun_ns [ns since the epoch];
            stopping (a transition has asked it to stop); again (it starts again after that).
        """

    def attempt(self, frame: Frame) -> tuple[int, float]:  # noqa: ARG002
        """Return the number of the first attempt, and the rest of the pause before it [s]."""
        return 1, 0.0

    def time_left(self, frame: Frame, seconds: float) -> float:  # noqa: ARG002
        """Return the rest of a timeout that began with the attempt [s]."""
        return seconds

    def halted(self, path: str) -> None:
        """Write that the timeout of the child at `path` stops: it, or a state in it, is held."""

    def went_on(self, path: str) -> None:
        """Write that it goes on."""

    def goes_on(self, frame: Frame) -> bool:  # noqa: ARG002
        """Return whether the child of `frame` left something to resume: a child or a goal."""
        return True

    def decide(self, frame: Frame, userdata: Any) -> Any:
        """Return the outcome that `resume` gives the child of `frame`; None to execute it."""

    # -- plans ---------------------------------------------------------------------------------

    def fired(
        self,
        frame: Frame,
        transitions: Sequence[str],
        marking: Sequence[str],
        ends: Sequence[str],
        begins: Sequence[str],
    ) -> None:
        """Write that transitions of the plan of `frame` have fired.

        Args:
            frame: The frame of the plan.
            transitions: Their ids.
            marking: The ids of the places that hold tokens now.
            ends: The labels of actions that must stop if they run.
            begins: The labels of actions that begin.
        """

    def note_conditions(self, frame: Frame) -> None:
        """Write the values of the conditions of the plan of `frame`, if they have changed."""

    # -- values, goals and side effects --------------------------------------------------------

    def check_value(self, frame: Frame, path: str, key: str, value: Any) -> None:
        """Raise if the state at `path` writes a `value` that the journal cannot keep."""

    def goal_of(self, frame: Frame) -> dict[str, Any] | None:
        """Return the goal that the state had sent before the resume, or None.

        Its fields: id, action, taken_ns and begun_ns (when a server acknowledged it and when it
        accepted it, which is later if goals wait there [ns since the epoch]), and, if it had
        ended, status, text, result and preempted (the state had been asked to stop); stopped: the
        end of the process had cancelled it.
        """

    def goal_sent(self, frame: Frame, action: str, goal_id: str) -> None:
        """Write that a goal is about to be sent."""

    def goal_taken(self, frame: Frame, goal_id: str, *, begun: bool) -> None:
        """Write that a server has the goal, and whether it has accepted it."""

    def goal_done(
        self, frame: Frame, goal_id: str, status: str, text: str, result: Any, *, preempted: bool
    ) -> None:
        """Write how the goal ended, and whether its state had been asked to stop."""

    def met(self, frames: Sequence[Frame]) -> None:
        """Write, at once for all, that the states of `frames` have met in their present visits."""

    def has_met(self, frame: Frame) -> bool:  # noqa: ARG002
        """Return whether the state of `frame` had met the others before the resume."""
        return False

    def once(self, frame: Frame, key: str, call: Callable[[], Any]) -> Any:  # noqa: ARG002
        """Return the result of `call` for `key` in this visit; call it only the first time."""
        return call()


NO_JOURNAL = RunJournal()
