"""dynamic_reconfigure.parameter_generator: the functions that a package's `cfg/Name.cfg` calls.

ROS 1's build runs such a file to generate `pkg.cfg.NameConfig`; here it is run when that module is
imported.

Source:
    dynamic_reconfigure/parameter_generator_catkin.py for names and arguments.
"""

from __future__ import annotations

import math
from typing import Any

from smachpy.ros1.names.dynamic_reconfigure.encoding import extract_params

int_t, bool_t, str_t, double_t = "int", "bool", "str", "double"

_NONE = {"int": 0, "double": 0.0, "str": "", "bool": False}
_MIN = {"int": -(2**31), "double": -math.inf, "str": "", "bool": False}
_MAX = {"int": 2**31 - 1, "double": math.inf, "str": "", "bool": True}


class Group:
    """A group of parameters and subgroups."""

    def __init__(self, name: str, type: str = "", state: bool = True) -> None:
        self.name, self.type, self.state = name, type, state
        self.parameters: list[dict[str, Any]] = []
        self.groups: list[Group] = []

    def add(
        self,
        name: str,
        paramtype: str,
        level: int = 0,
        description: str = "",
        default: Any = None,
        min: Any = None,
        max: Any = None,
        edit_method: Any = "",
    ) -> None:
        """Add a parameter."""
        self.parameters.append(
            {
                "name": name,
                "type": paramtype,
                "level": level,
                "description": description,
                "default": _NONE[paramtype] if default is None else default,
                "min": _MIN[paramtype] if min is None else min,
                "max": _MAX[paramtype] if max is None else max,
                "edit_method": edit_method,
            }
        )

    def add_group(self, name: str, type: str = "", state: bool = True) -> Group:
        """Add a group, and return it."""
        self.groups.append(Group(name, type, state))
        return self.groups[-1]

    def to_dict(self) -> dict[str, Any]:
        """Return its description, as in generated modules."""
        return {
            "name": self.name,
            "type": self.type,
            "state": self.state,
            "parameters": self.parameters,
            "groups": [group.to_dict() for group in self.groups],
        }


class ParameterGenerator(Group):
    """The parameters of a node.

    Attributes:
        module: The names and values of the generated module; empty before `generate`.
    """

    def __init__(self) -> None:
        super().__init__("Default")
        self._constants: dict[str, Any] = {}
        self.module: dict[str, Any] = {}

    def const(
        self, name: str, type: str, value: Any, descr: str, cppname: str = ""
    ) -> dict[str, Any]:
        """Return a value of an enumeration."""
        del cppname
        self._constants[name] = value
        return {"name": name, "type": type, "value": value, "description": descr}

    def enum(self, constants: list[dict[str, Any]], description: str) -> dict[str, Any]:
        """Return an enumeration, for the argument `edit_method`."""
        return {"enum": constants, "enum_description": description}

    def generate(self, pkgname: str, nodename: str, name: str) -> int:
        """Make the module; return 0, with which the file then exits."""
        del pkgname, nodename
        description = self.to_dict()
        found = extract_params(description)
        of: dict[str, dict[str, Any]] = {
            key: {one["name"]: one[key] for one in found}
            for key in ("default", "min", "max", "level", "type")
        }
        levels = 0
        for one in found:
            levels |= one["level"]
        self.module = {
            **{f"{name}_{each}": value for each, value in self._constants.items()},
            "config_description": description,
            "extract_params": extract_params,
            "defaults": of.pop("default"),
            **of,
            "all_level": levels,
        }
        return 0


__all__ = ["ParameterGenerator", "bool_t", "double_t", "int_t", "str_t"]
