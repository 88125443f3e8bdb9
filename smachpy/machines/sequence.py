"""A state machine whose states follow each other in the order in which they are added."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from smachpy.machines.construction import construction_method
from smachpy.machines.problems import Problems
from smachpy.machines.state_machine import StateMachine

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from typing import Unpack

    from smachpy.introspection import Kind
    from smachpy.machines.state import State, StateOptions

__all__ = ["Sequence"]


class Sequence(StateMachine):
    """States one after another: `connector_outcome` leads to the state added next.

    Args:
        outcomes: Outcomes.
        connector_outcome: Outcome that connects the states.
        input_keys: Keys copied from the parent's userdata when it starts.
        output_keys: Keys copied to the parent's userdata when it ends.
        name: Name of the machine when it is the root.
        userdata_type: A dataclass or TypedDict: the userdata has its fields, and their defaults.
        **options: See `StateOptions`.
    """

    _smachpy_kind: ClassVar[Kind] = "sequence"

    def __init__(
        self,
        outcomes: Iterable[str],
        connector_outcome: str,
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        *,
        name: str | None = None,
        userdata_type: type | None = None,
        **options: Unpack[StateOptions],
    ) -> None:
        problems = Problems(type(self).__name__)
        with problems:
            super().__init__(
                outcomes, input_keys, output_keys, name=name, userdata_type=userdata_type, **options
            )
        self._smachpy.connector_outcome = problems.word("connector_outcome", connector_outcome)
        problems.raise_all()

    @construction_method
    def add(  # type: ignore[override]  # as in SMACH: no constants
        self: Sequence,
        label: str,
        state: State,
        transitions: Mapping[str, str | None] | None = None,
        remapping: Mapping[str, str] | None = None,
    ) -> State:
        """Add a state after the previous one; the arguments are those of `StateMachine.add`.

        An explicit transition for the connector outcome takes precedence over the connection.
        """
        return self._smachpy_add(label, state, transitions, remapping, None)

    def _smachpy_add(
        self,
        label: str,
        state: State,
        transitions: Mapping[str, str | None] | None,
        remapping: Mapping[str, str] | None,
        constants: Mapping[str, Any] | None,
    ) -> State:
        super()._smachpy_add(label, state, transitions, remapping, constants)
        if self._smachpy.transitions[label].get(self._smachpy.connector_outcome) is None:
            self._smachpy.follow_connectors = (label, (self._smachpy.connector_outcome,))
        return state
