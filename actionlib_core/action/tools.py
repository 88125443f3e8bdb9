"""Messages from and to YAML, and action classes by name, as ROS 1's `actionlib_tools.library`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from actionlib_core.exceptions import FieldError
from actionlib_core.inputs.checked_file import read_limited
from actionlib_core.inputs.yaml_text import YamlTextError, load_yaml
from actionlib_core.interfaces import get_action
from actionlib_core.wire.action_types import ActionTypes

if TYPE_CHECKING:
    import os

    from actionlib_core.interfaces._message import Message

M = TypeVar("M", bound="Message")

ACTION = "Action"


def to_yaml(obj: Any) -> str:
    """Return a message, or plain data, as YAML text."""
    if hasattr(obj, "to_yaml"):
        text: str = obj.to_yaml()
        return text
    import io  # here, as few programs need this and ruamel.yaml

    from ruamel.yaml import YAML

    out = io.StringIO()
    YAML(typ="safe", pure=True).dump(obj, out)
    return out.getvalue()


def yaml_msg_str(type_: type[M], yaml_str: str, filename: str | None = None) -> M:
    """Read one message from a YAML mapping; missing fields have their default values.

    Args:
        type_: The message class.
        yaml_str: The text; "" is a message with default values.
        filename: The text's origin, for errors.

    Raises:
        FieldError: it is not YAML, not a mapping, or a field of it does not fit.
    """
    with _From(filename):
        return type_.from_yaml(yaml_str)


def yaml_msg(type_: type[M], filename: str | os.PathLike[str]) -> M:
    """Read one message from a YAML file; see `yaml_msg_str`."""
    return yaml_msg_str(type_, _text_of(filename), str(filename))


def yaml_msgs_str(type_: type[M], yaml_str: str, filename: str | None = None) -> list[M]:
    """Read messages from a YAML list of mappings; see `yaml_msg_str`."""
    with _From(filename):
        try:
            found = load_yaml(yaml_str)
        except YamlTextError as error:
            raise FieldError(f"{type_._type}: malformed YAML: {error}") from error
        entries = [] if found is None else found
        if not isinstance(entries, list):
            raise FieldError(f"{type_._type}: got {entries!r}; expected a YAML list of mappings")
        return [type_.from_dict(entry) for entry in map(_mapping, entries)]


def yaml_msgs(type_: type[M], filename: str | os.PathLike[str]) -> list[M]:
    """Read messages from a YAML file; see `yaml_msgs_str`."""
    return yaml_msgs_str(type_, _text_of(filename), str(filename))


def _text_of(filename: str | os.PathLike[str]) -> str:
    return read_limited(Path(filename)).decode("utf-8")


def _mapping(entry: object) -> dict[str, Any]:
    if not isinstance(entry, dict):
        raise FieldError(f"got {entry!r}; expected a YAML mapping such as '{{field: value}}'")
    return entry


class _From:
    """Adds a file's name to the errors of its text."""

    def __init__(self, filename: str | None) -> None:
        self._filename = filename

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        if isinstance(error, FieldError) and self._filename is not None:
            raise FieldError(f"{self._filename}: {error}") from error


class DynamicAction:
    """The classes of an action, found by its name.

    Args:
        name: "pkg/XAction" or "pkg/X".

    Attributes:
        name: "pkg/X".
        action: XAction.
        goal: XGoal.
        feedback: XFeedback.
        result: XResult.

    Raises:
        InterfaceError: there is no such action, or its definition has errors.
    """

    def __init__(self, name: str) -> None:
        self.name = name.removesuffix(ACTION)
        self.action: Any = get_action(self.name)
        types = ActionTypes.of(self.action)
        self.goal: Any = types.goal
        self.feedback: Any = types.feedback
        self.result: Any = types.result
