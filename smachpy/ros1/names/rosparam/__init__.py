"""rosparam: parameters from files, and in bulk."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from smachpy.ros1.names.rospy.names import resolve_name
from smachpy.ros1.parameters import ParameterFileError, read_file
from smachpy.ros1.session import session

RosParamException = ParameterFileError


def load_file(
    filename: str, default_namespace: str | None = None, verbose: bool = False
) -> list[tuple[dict[Any, Any], str]]:
    """Return the values of a YAML file and the namespace for them.

    Raises:
        RosParamException: the file cannot be read, or is not a dict.
    """
    del verbose
    return [(read_file(Path(filename)), default_namespace or "/")]


def upload_params(ns: str, values: dict[str, Any], verbose: bool = False) -> None:
    """Set parameters below a namespace."""
    del verbose
    session().parameters.merge(resolve_name(ns), values)


def get_param(param: str) -> Any:
    """Return a parameter's value."""
    return session().parameters.get(resolve_name(param))


def set_param(param: str, value: Any) -> None:
    """Set a parameter."""
    session().parameters.set(resolve_name(param), value)


def list_params(ns: str) -> list[str]:
    """Return the full names of the parameters below a namespace."""
    prefix = resolve_name(ns).rstrip("/") + "/"
    return [name for name in session().parameters.names() if name.startswith(prefix)]
