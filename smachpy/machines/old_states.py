"""Objects that programs for ROS 1 add as states; used only while their mistakes are accepted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from smachpy.base.slips import accepts
from smachpy.machines.state import State

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["adopt_slips", "as_state"]


class Delegate(State):
    """Runs an object that has a state's methods but is not a `State`.

    Args:
        thing: The object.
    """

    def __init__(self, thing: Any) -> None:
        def names(kind: str) -> Any:
            return getattr(thing, f"get_registered_{kind}", tuple)() or ()

        super().__init__(names("outcomes"), names("input_keys"), names("output_keys"))
        self._thing = thing

    def execute(self, ud: Any) -> Any:
        """Run the object."""
        return self._thing.execute(ud)

    def request_preempt(self) -> None:
        """Ask the object to stop as well."""
        super().request_preempt()
        ask = getattr(self._thing, "request_preempt", None)
        if ask is not None:
            ask()


def as_state(state: Any, label: object) -> Any:
    """Return `state`, or a state that runs it if it only has a state's methods."""
    if isinstance(state, State | type) or not callable(getattr(state, "execute", None)):
        return state
    problem = f"{label}: state: got {state!r}, which is no State but has its methods;"
    if not accepts(f"{problem} expected a subclass of State."):
        return state
    return Delegate(state)


def adopt_slips(
    label: str, state: State, transitions: Mapping[str, str | None]
) -> dict[str, str | None]:
    """Return transitions as SMACH understood them.

    A state without outcomes gets those that have a transition.
    """
    # Some programs write the string 'None' for "no transition".
    given = {o: None if target == "None" else target for o, target in transitions.items()}
    if given and not state.get_registered_outcomes():
        name = type(state).__name__
        problem = f"{label}: outcomes of {name}: got none; expected {sorted(map(str, given))}."
        if accepts(problem):
            state.register_outcomes(given)
    return given
