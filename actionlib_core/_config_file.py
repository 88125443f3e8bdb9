"""The reader of configuration files: YAML to the dataclasses of `config`, problems with lines."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, MutableMapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin, get_type_hints

from actionlib_core.config import ALL_NAMES, Config, Mapped, Ros2
from actionlib_core.exceptions import ConfigError
from actionlib_core.suggest import did_you_mean
from actionlib_core.yaml_text import YamlTextError, load_yaml

if TYPE_CHECKING:
    from pathlib import Path

# Paths in these fields are relative to the configuration file.
_FILE_FIELDS = frozenset({"ca", "certificate", "key", "password_file", "users_file"})
# Of these, a file may have one instead of a list, or a mapping by name.
_OR_MAPPING = {
    Ros2: ("not a network", "lines such as 'router: tcp/robot.local:7447', or a list of networks"),
    Mapped: ("not a mapping", "lines of 'name: {...}'"),
}
_EXPECTED = {float: "a number", int: "a whole number", bool: "true or false"}


def read_config_file(path: Path) -> Config:
    """Return the configuration in a file.

    Raises:
        ConfigError: it cannot be read or has errors; the text lists all with line and field.
    """
    try:
        data = load_yaml(path.read_text(encoding="utf-8"), "rt")
    except OSError as error:
        raise ConfigError(str(path), f"cannot be read: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise ConfigError(str(path), "not YAML: it is no UTF-8 text.") from error
    except YamlTextError as error:
        where = f"line {error.line}: " if error.line else ""
        raise ConfigError(str(path), f"{where}not YAML: {error.reason}.") from error
    reader = _Reader(path.parent)
    # Before the record is read, whose class has no field `wire`.
    names = reader.take_wire(data) if isinstance(data, MutableMapping) else ()
    config = Config() if data is None else reader.read_record(Config, data, "")
    if isinstance(config, Config) and names:
        config = reader.put_on_ros2(config, names)
    if reader.problems:
        raise ConfigError(str(path), *reader.problems)
    assert isinstance(config, Config)
    return config


class _Reader:
    """Converts plain YAML data to dataclasses, and collects the problems."""

    def __init__(self, folder: Path) -> None:
        self.problems: list[str] = []
        self._folder = folder
        self._line = self._wire_line = 1  # of the value that is being read, and of `wire`

    def take_wire(self, data: MutableMapping[str, Any]) -> tuple[str, ...]:
        """Remove `wire` from the data; return the names that it puts on ROS 2.

        It is a short form of `ros2.names`: `ros2` for all names, or a mapping of names to `ros2`.
        """
        if "wire" not in data:
            return ()
        self._go_to(data, "wire")
        self._wire_line = self._line
        wire = data.pop("wire")
        if wire == "ros2":
            return (ALL_NAMES,)
        if not isinstance(wire, Mapping) or not wire:
            self._report("wire", "unknown", wire, "'ros2', or lines of 'name: ros2'")
            return ()
        for name, value in wire.items():
            self._go_to(wire, name)
            if value != "ros2":
                self._report(f"wire.{name}", "unknown", value, "'ros2'")
        return tuple(str(name) for name in wire)

    def put_on_ros2(self, config: Config, names: tuple[str, ...]) -> Config:
        """Add names to the file's only ROS 2 network, or to a new one."""
        self._line = self._wire_line
        if len(config.ros2) > 1:
            count = f"{len(config.ros2)} networks of ROS 2"
            self._report("wire", "ambiguous", count, "one. Try 'names' or 'robot' in each")
            return config
        network = config.ros2[0] if config.ros2 else Ros2()
        try:
            network = dataclasses.replace(network, names=(*network.names, *names))
        except ConfigError as error:
            place = f"line {self._line}: "
            self.problems += [
                f"{place}{text.replace('names', 'wire', 1)}" for text in error.problems
            ]
        return dataclasses.replace(config, ros2=(network,))

    def read_record(self, kind: type, data: object, where: str, **given: str) -> object:
        """Make a `kind` from `data` and `given`; return None when a problem was found."""
        if not isinstance(data, Mapping):
            return self._report(where, "not a mapping", data, "lines of 'field: value'")
        before = len(self.problems)
        line = self._line
        hints = {name: hint for name, hint in get_type_hints(kind).items() if name not in given}
        values: dict[str, Any] = {**given}
        for key, value in data.items():
            self._go_to(data, key)
            path = f"{where}.{key}" if where else str(key)
            if key in hints:
                values[key] = self._read(hints[key], value, path)
            else:
                known = [*hints, "wire"] if kind is Config else hints
                self._report_unknown(path, str(key), sorted(known))
        for name in _required(kind) - {*data, *given}:
            self._report(f"{where}.{name}", "missing", None, "a value")
        if len(self.problems) > before:
            return None
        try:
            return kind(**values)
        except ConfigError as error:
            self._line = line
            self.problems += [self._place(data, where, text) for text in error.problems]
            return None

    def _read(self, hint: Any, value: object, path: str) -> object:
        if dataclasses.is_dataclass(hint) and isinstance(hint, type):
            return self.read_record(hint, value, path)
        if get_origin(hint) is tuple:
            return self._read_tuple(get_args(hint)[0], value, path)
        if get_origin(hint) is Literal:
            choices = sorted(get_args(hint))
            return value if value in choices else self._report(path, "unknown", value, choices)
        return self._read_scalar(hint, value, path)

    def _read_tuple(self, item: Any, value: object, path: str) -> object:
        if not isinstance(value, Mapping):
            if get_origin(item) is tuple:
                return self._report(path, "not a mapping", value, "lines of 'field: field'")
            return self._read_sequence(item, value, path)
        if item is Ros2:  # one network needs no list
            only = self.read_record(item, value, path)
            return None if only is None else (only,)
        if item is Mapped:
            return self._read_mapped(value, path)
        if get_origin(item) is tuple:  # pairs
            return tuple(
                (str(key), self._read(str, text, f"{path}.{key}")) for key, text in value.items()
            )
        return self._read_sequence(item, value, path)

    def _read_mapped(self, data: Mapping[str, Any], path: str) -> object:
        """Read entries whose keys are their names."""
        result = []
        for name, entry in data.items():
            self._go_to(data, name)
            result.append(self.read_record(Mapped, entry, f"{path}.{name}", name=str(name)))
        return tuple(result)

    def _read_sequence(self, hint: Any, value: object, path: str) -> object:
        if isinstance(value, str) or not isinstance(value, Sequence):
            what, expected = _OR_MAPPING.get(hint, ("not a list", "a list"))
            return self._report(path, what, value, expected)
        result = []
        for index, item in enumerate(value):
            self._go_to(value, index)
            result.append(self._read(hint, item, f"{path}[{index}]"))
        return tuple(result)

    def _read_scalar(self, hint: Any, value: object, path: str) -> object:
        if hint is float and isinstance(value, (int, float)) and not isinstance(value, bool):
            try:
                return float(value)
            except OverflowError:
                return self._report(path, "too large", value, "a number")
        if hint in {bool, int} and type(value) is hint:
            return value
        if hint is str and isinstance(value, str):
            if path.rpartition(".")[2] in _FILE_FIELDS:
                return str(self._folder / value)
            return str(value)
        return self._report(path, "wrong type", value, _EXPECTED.get(hint, "a text"))

    def _report(self, path: str, what: str, value: object, expected: object) -> object:
        self.problems.append(
            f"line {self._line}: {path or 'file'}: {what}: got {_plain(value)!r}; "
            f"expected {expected}."
        )
        return None

    def _report_unknown(self, path: str, key: str, known: list[str]) -> None:
        self.problems.append(
            f"line {self._line}: {path}: unknown field: got {key!r}; expected one of {known}."
            f"{did_you_mean(key, known)}"
        )

    def _go_to(self, data: object, key: object) -> None:
        position = getattr(data, "lc", None)
        if position is not None:
            self._line = position.data[key][0] + 1

    def _place(self, data: Mapping[str, Any], where: str, problem: str) -> str:
        """Add the line to a problem that the dataclass itself has found."""
        key = problem.partition(":")[0].partition(".")[0].partition("[")[0]
        if key in data:
            self._go_to(data, key)
        elif not where:
            return problem
        return f"line {self._line}: {problem}"


def _required(kind: type) -> set[str]:
    return {
        field.name
        for field in dataclasses.fields(kind)
        if field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
    }


def _plain(value: object) -> object:
    """Convert ruamel.yaml's containers to Python's, for the error text."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in value]
    return value
