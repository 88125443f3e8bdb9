"""YASMIN's machines in XML, as `yasmin_factory` and `yasmin_editor` have them.

Source: yasmin_factory 5 (https://github.com/uleroboticsgroup/yasmin).
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from smachpy.foreign.draft import Part
from smachpy.foreign.xml_text import identifier, local, needed, place

if TYPE_CHECKING:
    from collections.abc import Mapping
    from xml.etree.ElementTree import Element

    from smachpy.foreign.draft import Draft

STATES: Final = ("State", "StateMachine", "Concurrence", "OrthogonalState", "JoinState", "Region")
OTHERS: Final = (
    *("Transition", "Remap", "ParamRemap", "Param", "Key", "Default"),
    *("FinalOutcome", "OutcomeMap", "Item"),
)
TYPES: Final = {
    **dict.fromkeys(("str", "string"), "text"),
    **dict.fromkeys(("int", "integer"), "whole"),
    **dict.fromkeys(("float", "double"), "number"),
    **dict.fromkeys(("bool", "boolean"), "flag"),
}
FLAGS: Final = {
    **dict.fromkeys(("true", "1", "yes", "on"), True),
    **dict.fromkeys(("false", "0", "no", "off"), False),
}


def read(draft: Draft, root: Element) -> None:
    """Read a machine from its root element."""
    reader = _Reader(draft, root)
    parameters, scope = Part(place(root)), dict[str, Any]()
    for each in root.iterfind("Param"):
        name = needed(draft, each, "name")
        about = Part(place(each), help=each.get("description", ""))
        kind = each.get("default_type", "str").strip().lower()
        about["type"] = TYPES.get(kind, "list" if kind.startswith("list") else "any")
        if each.get("default_value") is not None:
            about["default"] = reader.value(each, "default_value", "default_type")
        parameters.put(name, about, place(each))
        scope[name] = f"${{{name}}}"
    top = reader.machine(root, scope)
    if parameters:
        top["parameters"] = parameters
    if draft.is_included:
        top |= reader.keys
    draft.finish(top, root.get("name"), root.get("description"))


class _Reader:
    def __init__(self, draft: Draft, root: Element) -> None:
        self._draft = draft
        self._joins: dict[str, int] = {}
        for each in root.iter("JoinState"):
            name = each.get("sync_id", "")
            self._joins[name] = self._joins.get(name, 0) + 1
        for each in root.iter():
            if local(each) not in {*STATES, *OTHERS}:
                draft.note(place(each), f"<{local(each)}>, which is not known")
        # All states of YASMIN share one blackboard; here a machine has the keys that it names.
        keys = {each.get("name", "") for each in root.iter("Key")}
        keys |= {each.get("new", "") for each in root.iter("Remap")}
        shared = sorted(keys - {""})
        draft.spend(len(shared) * sum(1 for each in root.iter() if local(each) in STATES))
        self.keys = {"input_keys": shared, "output_keys": shared} if shared else {}

    def value(self, element: Element, name: str, type_name: str) -> Any:
        """Return the value of an attribute, which has its type in another one."""
        text, kind = element.get(name, ""), element.get(type_name, "str").strip().lower()
        try:
            if TYPES.get(kind) == "flag":
                return FLAGS[text.strip().lower()]
            made = {"text": str, "whole": int, "number": float}.get(TYPES.get(kind, ""), json.loads)
            return made(text)
        except (ValueError, KeyError, RecursionError):
            problem = (
                f"<{local(element)}>: {name}: got {text!r}; expected a value of type {kind!r}."
            )
            self._draft.problem(place(element), problem)
            return None

    def machine(self, element: Element, scope: Mapping[str, Any]) -> Part:
        """Return the section of a machine.

        Args:
            element: It.
            scope: Its parameters: name -> value, or the text that stands for it.
        """
        part = Part(place(element), outcomes=element.get("outcomes", "").split())
        self._defaults(element, part)
        if element.get("start_state"):
            part["initial"] = element.get("start_state")
        part["states"] = self._states(element, scope, with_transitions=True)
        return part

    def _defaults(self, element: Element, part: Part) -> None:
        given = Part(place(element))
        for each in element:
            if local(each) == "Key" and each.get("default_value") is not None:
                value = self.value(each, "default_value", "default_type")
                given.put(needed(self._draft, each, "name"), value, place(each))
            elif local(each) == "Default":
                value = self.value(each, "value", "type")
                given.put(needed(self._draft, each, "key"), value, place(each))
        if given:
            part["userdata"] = given

    def _states(
        self, element: Element, scope: Mapping[str, Any], *, with_transitions: bool
    ) -> Part:
        states = Part(place(element))
        for each in element:
            if local(each) not in STATES:
                continue
            name = needed(self._draft, each, "name")
            entry = self._entry(each, scope)
            renamed = Part(place(each))
            for one in each.iterfind("Remap"):
                renamed.put(
                    needed(self._draft, one, "old"), needed(self._draft, one, "new"), place(one)
                )
            if renamed:
                entry["remapping"] = renamed
            self._transitions(each, entry, with_transitions)
            self._draft.add_state(states, name, entry, place(each))
        return states

    def _transitions(self, element: Element, entry: Part, with_transitions: bool) -> None:
        on = Part(place(element))
        is_join = local(element) == "JoinState"
        for each in element.iterfind("Transition"):
            outcome, target = (needed(self._draft, each, name) for name in ("from", "to"))
            if is_join and outcome == element.get("outcome", "joined"):
                outcome = "done"
            on.put(outcome, target, place(each))
        if is_join:  # a barrier for which too few can come
            on["aborted"] = "preempted"
        if with_transitions:
            entry["on"] = on
        elif "state" in entry and on:
            entry["outcomes"] = list(on)

    def _entry(self, element: Element, scope: Mapping[str, Any]) -> Part:
        """Return a state, without what its container does with it."""
        where, kind = place(element), local(element)
        own = {
            each.get("name", ""): self.value(each, "default_value", "default_type")
            for each in element.iterfind("Param")
            if each.get("default_value") is not None
        }
        arguments = Part(where)
        for name, value in own.items():
            arguments[name] = value
        for each in element.iterfind("ParamRemap"):
            old, new = needed(self._draft, each, "old"), needed(self._draft, each, "new")
            if new in scope:
                arguments.put(old, scope[new], place(each))
            elif old not in own:
                self._draft.note(place(each), f"the parameter {old!r}: {new!r} has no value")
        if kind == "JoinState":
            name = element.get("sync_id", "") or needed(self._draft, element, "name")
            parties = self._joins.get(element.get("sync_id", ""), 2)
            return Part(where, state="barrier", **{"with": Part(where, name=name, parties=parties)})
        if kind == "State":
            name = needed(self._draft, element, "class").replace("::", "/").rpartition("/")[2]
            entry = Part(where, state=self._draft.leaf(identifier(name)))
            entry["help"] = element.get("description", "")
            self._note_defaults(element)
            if arguments:
                entry["with"] = arguments
            return entry
        file = element.get("file_path") or element.get("file_name")
        if file:
            return Part(where, mission=file, **{"with": arguments})
        if kind in {"StateMachine", "Region"}:
            inner, name = self.machine(element, arguments), "machine"
        else:
            inner, name = self._concurrence(element, arguments), "concurrence"
        inner |= self.keys
        return Part(where, **{name: inner})

    def _note_defaults(self, element: Element) -> None:
        if element.find("Default") is not None or any(
            each.get("default_value") is not None for each in element.iterfind("Key")
        ):
            self._draft.note(place(element), "the default of a key of a single state")

    def _concurrence(self, element: Element, scope: Mapping[str, Any]) -> Part:
        rules, default = Part(place(element)), element.get("default_outcome", "")
        for each in element.iterfind("OutcomeMap"):
            rule = Part(place(each))
            for item in each.iterfind("Item"):
                state, outcome = (needed(self._draft, item, name) for name in ("state", "outcome"))
                rule.put(state, outcome, place(item))
            rules.put(needed(self._draft, each, "outcome"), rule, place(each))
        declared = element.get("outcomes", "").split()
        outcomes = dict.fromkeys([*declared, *rules, *([default] if default else [])])
        part = Part(place(element), outcomes=list(outcomes), outcome_map=rules)
        part["default_outcome"] = default or needed(self._draft, element, "default_outcome")
        self._defaults(element, part)
        part["states"] = self._states(element, scope, with_transitions=False)
        return part
