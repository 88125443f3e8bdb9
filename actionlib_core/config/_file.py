"""The reader of configuration files: YAML to the dataclasses of `config`, problems with lines."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final, TypeVar

from actionlib_core.config import ALL_NAMES, AccessRule, Config, Mapped, Ros2, Tls
from actionlib_core.exceptions import ConfigError
from actionlib_core.inputs.checked_file import REQUIRED, CheckedFile

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from actionlib_core.inputs.checked_file import Problem, Section

T = TypeVar("T")

# Paths in these fields are relative to the configuration file.
_FILES: Final = frozenset({"ca", "certificate", "key", "password_file", "users_file"})


def read_config_file(path: Path) -> Config:
    """Return the configuration in a file.

    Raises:
        ConfigError: it cannot be read or has errors; the text lists all with line and field.
    """
    file = CheckedFile(path, _error, may_be_empty=True)
    config = _config(file.top, path.parent)
    file.check()
    assert config is not None  # otherwise there is a problem
    return config


def _error(problems: Sequence[Problem]) -> ConfigError:
    parts = [(f"line {p.line}" if p.line else "", p.field, p.text) for p in problems]
    return ConfigError(problems[0].file, *(": ".join(filter(None, part)) for part in parts))


def _config(top: Section, folder: Path) -> Config | None:
    tls = _record(Tls, top.section("tls"), folder)
    rules = [_record(AccessRule, row, folder) for row in top.rows("access", ())]
    networks = _add_wire(top, _all(_ros2(section, folder) for section in _networks(top)))
    return _record(Config, top, folder, tls=tls, access=_all(rules), ros2=networks)


def _networks(top: Section) -> Sequence[Section]:
    networks = top.value("ros2", ())
    if isinstance(networks, dict):  # one network needs no list
        return [top.section("ros2")]
    if not isinstance(networks, list | tuple):
        example = "lines such as 'router: tcp/robot.local:7447'"
        top.problem("ros2", f"{example}, or a list of networks")
    return top.rows("ros2", ())


def _ros2(section: Section, folder: Path) -> Ros2 | None:
    names = section.section("map")
    mapped = _all(_mapped(name, names.section(name), folder) for name in names)
    return _record(Ros2, section, folder, map=mapped)


def _mapped(name: str, section: Section, folder: Path) -> Mapped | None:
    fields = section.section("fields")
    pairs = tuple((here, fields.text(here, REQUIRED, may_be_blank=True)) for here in fields)
    return _record(Mapped, section, folder, name=name, fields=pairs)


def _add_wire(top: Section, networks: tuple[Ros2, ...]) -> tuple[Ros2, ...]:
    """Add the names in `wire` to the only network, or to a new one.

    It is a short form of `ros2.names`: `ros2` for all names, or a mapping of names to `ros2`.
    """
    wire = top.value("wire")
    if "wire" not in top:
        return networks
    if wire == "ros2":
        names: tuple[str, ...] = (ALL_NAMES,)
    elif isinstance(wire, dict) and wire:
        lines = top.section("wire")
        names = tuple(name for name in lines if lines.text(name, REQUIRED, ("ros2",)))
    else:
        top.problem("wire", "'ros2', or lines of 'name: ros2'")
        return networks
    if len(networks) > 1:
        got = f"got {len(networks)} networks of ROS 2"
        chosen = all(network.names or network.robot for network in networks)
        way_out = (
            "Try without 'wire': 'names' and 'robot' say already what is on each."
            if chosen
            else "Try 'names' or 'robot' in each instead of 'wire'."
        )
        top.report("wire", f"{got}; expected one. {way_out}")
        return networks
    network = networks[0] if networks else Ros2()
    try:
        return (replace(network, names=(*network.names, *names)),)
    except ConfigError as error:
        for problem in error.problems:
            top.report("wire", problem.partition(": ")[2])
        return networks


def _record(kind: type[T], section: Section, folder: Path, **given: object) -> T | None:
    """Make a record of what is in a section; its class checks it further."""
    values = section.values(kind, **given)
    for name in _FILES & values.keys():
        values[name] = values[name] and str(folder / values[name])
    section.close()
    try:
        return kind(**values)
    except ConfigError as error:
        section.report_each(error.problems)
        return None


def _all(made: Iterable[T | None]) -> tuple[T, ...]:
    return tuple(record for record in made if record is not None)
