"""Print the types of `smachpy_viz.live.wire` in TypeScript, for the page.

    python viz/web/wire_types.py > viz/web/src/core/wire.ts

A test compares the file with this.
"""

from __future__ import annotations

import dataclasses
import json
import types
import typing
from typing import Any, Literal, NotRequired, Required, Union

from smachpy.events import EVENT_KINDS
from smachpy.events.reading import Observation
from smachpy.events.run_state import ProgressFacts
from smachpy_viz.live import wire

COMMON = ("path", "t", "stamp_ns")
"""Fields that events of all kinds have."""


JSON = """export type Json =
  | null
  | boolean
  | number
  | string
  | Json[]
  | { [key: string]: Json };
"""

PLAIN: dict[Any, str] = {
    str: "string",
    int: "number",
    float: "number",
    bool: "boolean",
    None: "null",
    type(None): "null",
    Any: "Json",
    object: "Json",
    dict: "Record<string, Json>",
}


class RunEvent:
    """Stands for `wire.EventRecord`, which is a plain dict in Python."""


class Printer:
    """Collects the types that are mentioned, each once, in the order in which they are met."""

    def __init__(self) -> None:
        self.made: dict[str, str] = {}

    def text(self, hint: Any) -> str:  # noqa: PLR0911  one for each form of type
        """Return the type in TypeScript."""
        origin, args = typing.get_origin(hint), typing.get_args(hint)
        if origin in {typing.Annotated, Required, NotRequired}:
            return self.text(args[0])
        if hint == Observation:
            union = " | ".join(self.text(one) for one in args)
            self.made["Observation"] = (
                f"/** A record of a robot's topic. */\nexport type Observation = {union};\n"
            )
            return "Observation"
        if origin in {Union, types.UnionType}:
            return " | ".join(dict.fromkeys(self.text(one) for one in args))
        if origin is Literal:
            return " | ".join(json.dumps(one) for one in args)
        if origin in {list, tuple} or hint in {list, tuple}:
            return self._array(origin or hint, args)
        if origin is dict:
            return f"Record<string, {self.text(args[1])}>"
        if hint in PLAIN:
            return PLAIN[hint]
        self.interface(hint)
        return str(hint.__name__)

    def _array(self, origin: Any, args: tuple[Any, ...]) -> str:
        if origin is tuple and args and args[-1] is not Ellipsis:
            return f"[{', '.join(self.text(one) for one in args)}]"
        inner = self.text(args[0]) if args else "Json"
        return f"({inner})[]" if " | " in inner and not inner.startswith("[") else f"{inner}[]"

    def interface(self, kind: Any) -> None:
        """Add the interface of a record, after those that it mentions."""
        name = kind.__name__
        if name in self.made:
            return
        self.made[name] = ""  # it may mention itself
        if kind is RunEvent:
            self.made[name] = self.events()
            return
        fields = {_name_of(field, hint): self.text(hint) for field, hint in hints_of(kind).items()}
        lines = [f"  {field}: {text};" for field, text in fields.items()]
        doc = (
            (kind.__doc__ or "").strip().split("\n\n")[0].replace("\n    ", " ").replace("\n", " ")
        )
        del self.made[name]
        self.made[name] = f"/** {doc} */\nexport interface {name} {{\n" + "\n".join(lines) + "\n}\n"

    def events(self) -> str:
        """Return the fields of each kind of event, and an event as one of all kinds."""
        lines = ["/** The fields of each kind of event (`smachpy.events`), besides common ones. */"]
        lines.append("export interface EventFields {")
        for name, kind in EVENT_KINDS.items():
            own = {field: hint for field, hint in hints_of(kind).items() if field not in COMMON}
            if name == "GoalFeedback":
                own["progress"] = NotRequired[ProgressFacts]  # added by the viewer
            texts = [f"{_name_of(field, hint)}: {self.text(hint)}" for field, hint in own.items()]
            lines.append(f"  {name}: {{ {'; '.join(texts)} }};" if texts else f"  {name}: object;")
        return "\n".join(lines) + EVENTS


EVENTS = """
}

export type EventKind = keyof EventFields;

/** An event of one kind; `dropped` events are missing before it. */
export type EventOf<K extends EventKind> = EventFields[K] & {
  kind: K;
  path: string;
  t: number;
  stamp_ns: number;
  seq: number;
  dropped?: number;
};

/** An event of any kind. */
export type RunEvent = { [K in EventKind]: EventOf<K> }[EventKind];
"""


def _name_of(field: str, hint: Any) -> str:
    return f"{field}?" if typing.get_origin(hint) is NotRequired else field


def hints_of(kind: Any) -> dict[str, Any]:
    """Return the fields of a record with their types."""
    hints = typing.get_type_hints(kind, localns={"EventRecord": RunEvent}, include_extras=True)
    if dataclasses.is_dataclass(kind):
        return {field.name: hints[field.name] for field in dataclasses.fields(kind)}
    return hints


def main() -> None:
    """Print the types."""
    printer = Printer()
    answers = {route: printer.text(hint) for route, hint in wire.ANSWERS.items()}
    stream = {name: printer.text(hint) for name, hint in wire.STREAM.items()}
    printer.interface(wire.Failure)
    print("// What the server and its pages tell each other. Made by viz/web/wire_types.py.\n")
    print(
        "export type Json = null | boolean | number | string | Json[] | { [key: string]: Json };\n"
    )
    print("\n".join(printer.made.values()))
    for name, doc, table in (
        ("Answers", "What each route answers, unless it fails.", answers),
        ("StreamData", "The data of each server-sent event.", stream),
    ):
        print(f"/** {doc} */\nexport interface {name} {{")
        print("\n".join(f"  {json.dumps(key)}: {text};" for key, text in table.items()) + "\n}\n")


if __name__ == "__main__":
    main()
