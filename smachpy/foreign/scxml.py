"""A part of SCXML: its states, transitions, regions and ends; no executable content.

A state without states inside is a leaf: the events that it waits for are its outcomes.

Source: W3C, State Chart XML (SCXML), 2015, https://www.w3.org/TR/scxml/.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

from smachpy.foreign.draft import Part
from smachpy.foreign.literals import NotPlainError, read_condition, read_value, shown
from smachpy.foreign.xml_text import identifier, local, needed, place

if TYPE_CHECKING:
    from collections.abc import Iterator
    from xml.etree.ElementTree import Element

    from smachpy.foreign.draft import Draft

STATES: Final = ("state", "parallel", "final")
QUIET: Final = ("scxml", *STATES, "transition", "initial", "history", "datamodel", "data")
DONE: Final = "done"


def read(draft: Draft, root: Element) -> None:
    """Read a machine from its root element."""
    reader = _Reader(draft, root)
    for each in root:
        if local(each) == "transition":
            draft.note(place(each), "<transition> of the whole")
    top = reader.machine(root)
    if reader.data:
        top["userdata"] = reader.data
    draft.finish(top, root.get("name"))


class _Reader:
    def __init__(self, draft: Draft, root: Element) -> None:
        self._draft = draft
        self._namespace = root.tag.rpartition("}")[0]
        self._around = {child: parent for parent in root.iter() for child in parent}
        self._ids: dict[str, Element] = {}
        self._roles: dict[Element, dict[str, str]] = {}
        self._events_around: dict[Element, list[str]] = {}
        self.data = Part(place(root))
        for each in root.iter():
            if not self._is_scxml(each):
                continue
            if local(each) in {*STATES, "history"}:
                if local(each) == "final" and not each.get("id"):
                    each.set("id", DONE)
                name = needed(draft, each, "id")
                if name in self._ids:
                    draft.problem(place(each), f"got id {name!r} a second time; expected one.")
                self._ids[name] = each
            elif local(each) == "data":
                self._datum(each)
            elif local(each) not in {*QUIET, "onentry", "onexit", "param"} and not (
                local(each) == "invoke" and self._invoked(each)
            ):
                draft.note(place(each), f"<{local(each)}>")
        shared = list(self.data)
        draft.spend(len(shared) * sum(1 for one in root.iter() if local(one) in STATES))
        self._keys = {"input_keys": shared, "output_keys": shared} if shared else {}

    def _is_scxml(self, element: Element) -> bool:
        return isinstance(element.tag, str) and element.tag.rpartition("}")[0] == self._namespace

    def _children(self, element: Element, *names: str) -> Iterator[Element]:
        return (one for one in element if self._is_scxml(one) and local(one) in names)

    def _datum(self, element: Element) -> None:
        name = needed(self._draft, element, "id")
        text = element.get("expr") or (element.text or "").strip() or "null"
        try:
            self.data.put(name, read_value(text), place(element))
        except NotPlainError:
            what = f"the value of <data> {name!r}, which is no literal: {shown(text)}"
            self._draft.note(place(element), what)

    @staticmethod
    def _invoked(element: Element) -> str:
        """Return the name of the state that an <invoke> names; "" for a document."""
        source = element.get("src", "")
        return source if re.fullmatch(r"\w+", source) else ""

    def _role(self, container: Element, name: str, role: str, at: Element) -> str:
        """Note why a container ends with an outcome; two reasons need two names."""
        known = self._roles.setdefault(container, {}).setdefault(name, role)
        if known != role:
            text = f"got {name!r} for {role} and for {known}; expected two names."
            self._draft.problem(place(at), text)
        return name

    def _resolved(self, state: Element, name: str, at: Element) -> str | None:
        """Return the label or outcome, in the container of a state, that leads to a target."""
        target = self._ids.get(name)
        if target is None:
            self._draft.problem(place(at), f"<transition>: got target {name!r}; expected an id.")
            return None
        container = self._around[state]
        near = self._near(target, container, at)
        if near is None:
            return self._role(container, name, "a target outside", at)
        if local(near) == "final":
            return self._role(container, near.get("id", ""), "an end", at)
        return near.get("id", "")

    def _near(self, target: Element, container: Element, at: Element) -> Element | None:
        """Return what is directly in a container and is the target, or has it in it."""
        near: Element | None = target
        while near is not None and self._around.get(near) is not container:
            near = self._around.get(near)
        is_history = local(target) == "history" and self._around[target] is near
        name, there = target.get("id", ""), None if near is None else near.get("id", "")
        if there not in {None, name} and not is_history:
            text = f"the entry at {name!r}: {there!r} begins where it says"
            self._draft.note(place(at), text)
        return near

    def _events(self, transition: Element, state: Element) -> Iterator[str]:
        """Yield the outcomes that a transition is for."""
        own = state.get("id", "")
        for event in transition.get("event", DONE).split():
            name = event.removesuffix(".*")
            if "*" in name:
                self._draft.note(place(transition), f"the event {event!r}")
            elif name == f"done.state.{own}" or name.startswith("done.invoke"):
                yield DONE
            else:
                yield name.removeprefix(f"{own}.")

    def _cases(self, state: Element) -> dict[str, list[tuple[str, str, Element]]]:
        """Return outcome -> its conditions and targets, of the transitions of a state."""
        found: dict[str, list[tuple[str, str, Element]]] = {}
        for each in self._children(state, "transition"):
            targets = each.get("target", "").split()
            if len(targets) != 1:
                self._draft.note(place(each), f"<transition> with {len(targets) or 'no'} targets")
                continue
            for outcome in self._events(each, state):
                found.setdefault(outcome, []).append((each.get("cond", ""), targets[0], each))
        return found

    def _on(self, state: Element) -> Part:
        """Return the transitions of a state; its ends are its outcomes instead of `done`."""
        on = Part(place(state))
        for outcome, cases in self._cases(state).items():
            rows = []
            for condition, name, at in cases:
                target = self._resolved(state, name, at)
                row = Part(place(at), to=target)
                if condition:
                    row["when"] = read_condition(condition)
                rows.append(row)
                if not condition:
                    break
            else:
                text = f"{outcome!r} if no condition holds: the state begins anew"
                self._draft.note(place(cases[-1][2]), text)
                rows.append(Part(place(cases[-1][2]), to=state.get("id", "")))
            value = rows if len(rows) > 1 else rows[0]["to"]
            for name in (outcome == DONE and self._finals(state)) or [outcome]:
                on.put(name, value, place(cases[0][2]))
        return on

    def machine(self, element: Element) -> Part:
        """Return the section of a machine."""
        states = Part(place(element))
        for each in self._children(element, "state", "parallel"):
            entry, on = self._entry(each)
            entry["on"] = on
            outcomes = self._outcomes(entry)
            for outcome in [one for one in on if one not in outcomes]:  # its states have their own
                text = f"the transition of {outcome!r}, with which it does not end"
                self._draft.note(place(each), text)
                del on[outcome]
            for outcome in outcomes:
                target = None if outcome in on else self._upwards(each, outcome)
                if target is not None:
                    on[outcome] = target
            states.put(each.get("id", ""), entry, place(each))
        part = Part(place(element), outcomes=self._ends(element), states=states)
        if initial := self._initial(element):
            part["initial"] = initial
        for each in self._children(element, "history"):
            part["reenter"] = "deep" if each.get("type") == "deep" else "last"
            text = "<history>: the state goes on where a request to stop has interrupted it"
            self._draft.note(place(each), text)
        return part

    def _initial(self, element: Element) -> str:
        """Return the label with which a machine begins; "" for the first one."""
        given = element.get("initial", "").split()
        for each in self._children(element, "initial"):
            for one in self._children(each, "transition"):
                given += one.get("target", "").split()
        target = self._ids.get(given[0]) if given else None
        near = None if target is None else self._near(target, element, element)
        return near.get("id", "") if near is not None else "".join(given[:1])

    def _finals(self, element: Element) -> list[str]:
        known = () if local(element) == "parallel" else self._children(element, "final")
        return [each.get("id", "") for each in known]

    def _ends(self, element: Element) -> list[str]:
        for name in self._finals(element):
            self._role(element, name, "an end", element)
        return list(dict.fromkeys([*self._finals(element), *self._roles.get(element, {})]))

    @staticmethod
    def _outcomes(entry: Part) -> list[str]:
        return list(entry.get("machine", entry.get("concurrence", entry))["outcomes"])

    def _entry(self, element: Element) -> tuple[Part, Part]:
        """Return a state and its transitions."""
        where = place(element)
        if local(element) == "parallel":
            part = self._concurrence(element)
            return Part(where, concurrence=part), self._on(element)
        if next(self._children(element, *STATES), None) is not None:
            part = self.machine(element)
            part |= self._keys
            return Part(where, machine=part), self._on(element)
        name = element.get("id", "")
        entry = Part(where, state=self._draft.leaf(identifier(name), registered=False))
        for each in self._children(element, "invoke"):
            if self._invoked(each):
                entry["state"] = self._draft.leaf(self._invoked(each))
                given = Part(place(each))
                for one in self._children(each, "param"):
                    given.put(needed(self._draft, one, "name"), self._param(one), place(one))
                entry["with"] = given
        on = self._on(element)
        entry["outcomes"] = [*dict.fromkeys([*on, *self._inherited(self._around[element])])] or [
            DONE
        ]
        return entry, on

    def _param(self, element: Element) -> Any:
        try:
            return read_value(element.get("expr", "null"))
        except NotPlainError:
            text = f"<param>: expr: got {element.get('expr')!r}; expected a literal."
            self._draft.problem(place(element), text)
            return None

    def _inherited(self, around: Element) -> list[str]:
        """Return the events for which a state, and those around it, have transitions."""
        if local(around) not in STATES:
            return []
        if around not in self._events_around:
            found = dict.fromkeys(one for one in self._cases(around) if one != DONE)
            found |= dict.fromkeys(self._inherited(self._around[around]))
            self._events_around[around] = list(found)
        self._draft.spend(len(self._events_around[around]))
        return self._events_around[around]

    def _concurrence(self, element: Element) -> Part:
        states, rules = Part(place(element)), Part(place(element))
        labels = {one.get("id", "") for one in self._children(element, "state", "parallel")}
        ends, stopping = list[str](), list[str]()
        for each in self._children(element, "state", "parallel"):
            entry, on = self._entry(each)
            label = each.get("id", "")
            outcomes = self._outcomes(entry)
            stops = True
            for outcome in outcomes:
                target = on.get(outcome) or self._upwards(each, outcome)
                if isinstance(target, str) and target not in labels:
                    rule = rules.setdefault(target, {"any": {}})["any"]
                    rule.setdefault(label, []).append(outcome)
                    continue
                ends, stops = [DONE], False
                if target is not None:
                    text = f"the transition of {outcome!r} of the region {label}, which ends"
                    self._draft.note(place(each), text)
            if not stops and len(outcomes) > 1:
                self._draft.note(place(each), f"the stop of the other regions at ends of {label}")
            states.put(label, entry, place(each))
            if stops:
                stopping.append(label)
        part = Part(place(element), outcomes=list(dict.fromkeys([*ends, *rules])) or [DONE])
        part |= {"default_outcome": part["outcomes"][0], "outcome_map": rules, "states": states}
        if stopping:
            part["stop_others"] = stopping
        part |= self._keys
        return part

    def _upwards(self, state: Element, outcome: str) -> str | None:
        """Return where an outcome leads for which a state has no transition; None: nowhere."""
        role = self._roles.get(state, {}).get(outcome, "an event")
        if role == "a target outside":
            return self._resolved(state, outcome, state)
        if role == "an end" or outcome == DONE:
            return None
        return self._role(self._around[state], outcome, "an event", state)
