"""Messages made from userdata and written to it, for action and service states."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from smachpy.actions.interface import adopt_interface
from smachpy.exceptions import did_you_mean
from smachpy.userdata.readonly import writable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from smachpy.base.problems import Problems
    from smachpy.machines.state import State


@dataclass(frozen=True, slots=True)
class UserCallback:
    """A user's function with its own extra arguments."""

    function: Callable[..., Any] | None
    args: tuple[Any, ...]
    kwargs: dict[str, Any]

    @classmethod
    def of(
        cls,
        problems: Problems,
        name: str,
        ours: tuple[str, ...],
        function: Callable[..., Any] | None,
        args: Iterable[Any],
        kwargs: Mapping[str, Any] | None,
    ) -> UserCallback:
        """Check the function and copy its extra arguments.

        Args:
            problems: Gets the problems.
            name: Name of the argument by which the function was given.
            ours: Names of the arguments that come before the extra ones.
            function: The function, or None.
            args: Its extra arguments.
            kwargs: Its extra keyword arguments.
        """
        more = problems.values(f"{name}_args", args)
        named = problems.mapping(f"{name}_kwargs", kwargs, "name -> value")
        call = f"{name}({', '.join(ours)}, *{name}_args, **{name}_kwargs)"
        problems.function(name, function, call, len(ours) + len(more), named)
        return cls(function, more, named)

    def __call__(self, *ours: Any) -> Any:
        """Call the function; return None if there is none."""
        if self.function is None:
            return None
        return self.function(*ours, *self.args, **self.kwargs)


@dataclass(frozen=True, slots=True)
class Outgoing:
    """Builds the message that a state sends: from a message or key, then fields, then a callback.

    Attributes:
        name: Prefix of the arguments' names: "goal", "request".
        message_class: Its class.
        given: The initial message, or None.
        key: Userdata key of the initial message, or None.
        slots: Fields that are set from userdata keys of the same name.
        callback: Called with userdata and message; may return another message.
    """

    name: str
    message_class: Any
    given: Any
    key: str | None
    slots: tuple[str, ...]
    callback: UserCallback

    def problems(self) -> list[str]:
        """Return the problems of the arguments."""
        problems = _slot_problems(self.name, self.slots, self.message_class)
        if self.given is not None and not isinstance(self.given, self.message_class):
            expected = self.message_class._type
            problems.append(
                f"{self.name}: got {self.given!r}; expected a message of type {expected}."
            )
        return problems

    def declare(self, state: State) -> None:
        """Register the keys that are read."""
        # The outcomes of this callback are not the state's: it only changes the message.
        state.register_input_keys([*([] if self.key is None else [self.key]), *self.slots])
        adopt_interface(state, self.callback.function, outcomes=False)

    def build(self, ud: Any) -> Any:
        """Return the message of this run, which shares nothing with userdata or other runs."""
        # Deep copies: a later write to userdata, or a callback that changes its argument, must not
        # change the state's template or a message that is being sent.
        if self.key is not None:
            message = copy.deepcopy(writable(ud[self.key]))
        elif self.given is not None:
            message = copy.deepcopy(self.given)
        else:
            message = self.message_class()
        for slot in self.slots:
            setattr(message, slot, copy.deepcopy(writable(ud[slot])))
        if self.callback.function is not None:
            made = self.callback(ud, message)
            message = copy.deepcopy(writable(message if made is None else made))
        return message


@dataclass(frozen=True, slots=True)
class Incoming:
    """Stores the message that a state receives: in a key, and its fields in keys of their names.

    Attributes:
        name: Prefix of the arguments' names: "result", "response".
        message_class: Its class.
        key: Userdata key that gets the message, or None.
        slots: Fields that are written to userdata keys of the same name.
        callback: Called with it; may return the outcome.
    """

    name: str
    message_class: Any
    key: str | None
    slots: tuple[str, ...]
    callback: UserCallback

    def problems(self) -> list[str]:
        """Return the problems of the arguments."""
        return _slot_problems(self.name, self.slots, self.message_class)

    def declare(self, state: State) -> None:
        """Register the keys that are written, and the interface of the callback."""
        state.register_output_keys([*([] if self.key is None else [self.key]), *self.slots])
        adopt_interface(state, self.callback.function)

    def store(self, ud: Any, message: Any) -> None:
        """Write the message to userdata."""
        if self.key is not None:
            ud[self.key] = message
        for slot in self.slots:
            ud[slot] = getattr(message, slot)


def _slot_problems(name: str, slots: tuple[str, ...], message_class: Any) -> list[str]:
    known = message_class.__slots__
    return [
        f"{name}_slots: got {slot!r}; expected fields of {message_class._type}: {list(known)}."
        f"{did_you_mean(slot, known)}"
        for slot in slots
        if slot not in known
    ]
