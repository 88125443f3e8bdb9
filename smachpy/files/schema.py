"""The JSON Schema of mission files: editors complete and check with it as one types."""

from __future__ import annotations

from typing import Any, get_args

from actionlib_core.resources import POLICIES
from smachpy.files.reading import KINDS, OPTIONS, TYPES
from smachpy.machines.state_machine import Reenter

TEXTS: dict[str, Any] = {"type": "array", "items": {"type": "string"}}
SECONDS: dict[str, Any] = {
    "anyOf": [{"type": "number", "minimum": 0}, {"$ref": "#/$defs/parameter"}]
}


def schema() -> dict[str, Any]:
    """Return the schema; `smachpy/files/mission.schema.json` is the same as text."""
    options: dict[str, Any] = {
        "timeout": SECONDS | {"description": "longest run [s]"},
        "timeout_outcome": {"type": "string"},
        "preempt_timeout": {"anyOf": [SECONDS, {"const": "inherit"}, {"type": "null"}]},
        "retry": {
            "anyOf": [
                {"type": "integer", "minimum": 1},
                _object(
                    {
                        "attempts": {"type": "integer", "minimum": 1},
                        "backoff": {"type": "number", "minimum": 0},
                        "on": TEXTS,
                    }
                ),
            ]
        },
        "resume": {"type": "string", "description": "skip:OUTCOME or ask"},
        "idempotent": {"type": "boolean"},
        "transient": TEXTS,
        "success": TEXTS,
        "resource": {
            "anyOf": [
                {"type": "string"},
                _object({"name": {"type": "string"}, "policy": {"enum": list(POLICIES)}}, ["name"]),
            ],
            "description": "what it needs for itself while it executes",
        },
    }
    assert tuple(options) == OPTIONS
    names = {"type": "object", "additionalProperties": {"type": "string"}}
    states = {"type": "object", "additionalProperties": {"$ref": "#/$defs/state"}}
    shared = {
        "outcomes": TEXTS,
        "input_keys": TEXTS,
        "output_keys": TEXTS,
        "userdata": {"type": "object"},
        **options,
    }
    machine = {
        **shared,
        "initial": {"type": "string"},
        "reenter": {"enum": list(get_args(Reenter))},
        "states": states,
        "cleanup": states | {"maxProperties": 1},
    }
    wanted = {"type": "object", "additionalProperties": {"anyOf": [{"type": "string"}, TEXTS]}}
    rule = {
        "anyOf": [
            _object({"any": wanted}, ["any"]),
            _object({"need": {"type": "integer", "minimum": 1}, "of": wanted}, ["need", "of"]),
            wanted,
        ]
    }
    case = _object({"when": {"type": "string"}, "to": {"type": "string"}}, ["to"])
    confirmed = _object(
        {
            "to": {"type": "string"},
            "confirm": {"type": "integer", "minimum": 1},
            "otherwise": {"type": "string"},
            "question": {"type": "string"},
        },
        ["to", "confirm"],
    )
    target = {
        "anyOf": [
            {"type": ["string", "null"]},
            {"type": "array", "items": case, "minItems": 1},
            confirmed,
        ]
    }
    state = {
        **{key: {"type": "string"} for key in ("state", "mission", "plan")},
        "machine": _object(machine, ["outcomes", "states"]),
        "sequence": _object(
            machine | {"connector": {"type": "string"}}, ["outcomes", "connector", "states"]
        ),
        "concurrence": _object(
            {
                **shared,
                "default_outcome": {"type": "string"},
                "outcome_map": {"type": "object", "additionalProperties": rule},
                "stop_others": {"anyOf": [{"type": "boolean"}, TEXTS]},
                "states": states,
                "cleanup": states | {"maxProperties": 1},
            },
            ["outcomes", "default_outcome", "states"],
        ),
        "iterator": _object(
            {
                **shared,
                "items": {},
                "items_from": {"type": "string"},
                "item_key": {"type": "string"},
                "exhausted": {"type": "string"},
                "loop_outcomes": TEXTS,
                "break_outcomes": TEXTS,
                "final_outcomes": names,
                "each": states | {"minProperties": 1, "maxProperties": 1},
                "cleanup": states | {"maxProperties": 1},
            },
            ["outcomes", "each"],
        ),
        "with": {"type": "object"},
        "on": {"type": "object", "additionalProperties": target},
        "remapping": names,
        "constants": {"type": "object"},
        "help": {"type": "string"},
        "outcomes": TEXTS,
        "input_keys": TEXTS,
        "output_keys": TEXTS,
        **options,
    }
    parameter = _object(
        {
            "type": {"enum": list(TYPES)},
            "default": {},
            "unit": {"type": "string"},
            "help": {"type": "string"},
        }
    )
    top = {
        "smachpy": {"const": 1},
        "name": {"type": "string"},
        "help": {"type": "string"},
        "parameters": {"type": "object", "additionalProperties": parameter},
        **machine,
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "smachpy mission",
        **_object(top, ["outcomes", "states"]),
        "$defs": {
            "state": _object(state) | {"oneOf": [{"required": [kind]} for kind in KINDS]},
            "parameter": {"type": "string", "pattern": r"^\$\{\w+\}$"},
        },
    }


def _object(properties: dict[str, Any], required: list[str] | None = None) -> dict[str, Any]:
    needed = {"required": required} if required else {}
    return {
        "type": "object",
        "properties": properties,
        "additionalProperties": False,
        **needed,
    }
