"""Reads and writes PNML files, in the dialect of PNP (JARP, PNPgenerator) and in PNML 2009.

Sources: the loader of PetriNetPlans 1.4; ISO/IEC 15909-2:2011, place/transition nets.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

from actionlib_core.inputs.checked_file import read_limited
from smachpy.exceptions import InvalidStateError
from smachpy.pnp.foreign import excess, is_place_transition_net, priorities, tokens
from smachpy.pnp.foreign import local as _tag
from smachpy.pnp.net import Arc, Net, Place, Transition
from smachpy.pnp.problems import PlanProblem, raise_errors

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

    from smachpy.pnp.labels import Severity

Dialect: TypeAlias = Literal["pnp", "2009"]

NAMESPACE: Final = "http://www.pnml.org/version-2009/grammar/pnml"
PT_NET: Final = "http://www.pnml.org/version-2009/grammar/ptnet"
MAX_TOKENS: Final = 1000
"""Tokens of one place or arc: more is a mistake or an attack, as markings list each token."""

LARGEST_FILE: Final = 2_000_000
"""Largest file of a plan in any form [bytes]."""

_LINE: Final = "{smachpy}line"  # in a namespace, as the file may have an attribute "line"
_PLAN_NAME: Final = "PLAN NAME:"
# Characters outside the production `Char` of XML 1.0; the standard library writes them as they are.
_NOT_XML: Final = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@dataclass
class _ReadNet:
    """The parts of a net that were read so far."""

    file: str
    dialect: Dialect = "pnp"
    name: str = ""
    places: dict[str, Place] = field(default_factory=dict)
    transitions: dict[str, Transition] = field(default_factory=dict)
    arcs: list[tuple[Arc, Element]] = field(default_factory=list)
    references: dict[str, str] = field(default_factory=dict)
    problems: list[PlanProblem] = field(default_factory=list)
    excess: set[tuple[str, str]] = field(default_factory=set)

    def problem(
        self,
        severity: Severity,
        rule: str,
        element: Element | int,
        message: str,
        hint: str = "",
    ) -> None:
        line = element if isinstance(element, int) else int(element.get(_LINE, "0"))
        what = "" if isinstance(element, int) else _name_of(element)
        self.problems.append(PlanProblem(rule, severity, message, what, self.file, line, hint))


def read_pnml(file: Path | str) -> tuple[Net, tuple[PlanProblem, ...]]:
    """Read a net.

    Returns:
        The net, and the warnings about the file.

    Raises:
        PlanError: the file cannot be read, or is not a net; all problems at once.
    """
    path = Path(file)
    try:
        data = read_limited(path, LARGEST_FILE)
    except OSError as error:
        why = error.strerror or type(error).__name__
        raise_errors([PlanProblem("file", "error", f"{why}; expected a plan.", "", str(file))])
        raise
    return parse_pnml(data, name=path.name.partition(".")[0], file=str(file))


def parse_pnml(
    data: bytes | str, *, name: str = "plan", file: str = ""
) -> tuple[Net, tuple[PlanProblem, ...]]:
    """Read a net from the text of a file; arguments and errors as for `read_pnml`.

    Args:
        data: The text, or bytes in the encoding that their XML declaration names.
        name: The name of the plan, unless it is in a comment "PLAN NAME:".
        file: The file, for the problems.
    """
    found = _ReadNet(file, name=name)
    root = _parse(data, found)
    if root is not None:
        _read_root(root, found)
    raise_errors(found.problems)
    arcs = _checked_arcs(found)
    raise_errors(found.problems)
    net = Net(
        found.name, tuple(found.places.values()), tuple(found.transitions.values()), arcs, file
    )
    return net, tuple(found.problems)


def _parse(data: bytes | str, found: _ReadNet) -> Element | None:
    """Return the root of the XML, with the line of each element; None if it is not XML."""
    from xml.etree.ElementTree import ParseError, TreeBuilder

    # The standard parser expands entities, by which a small file can fill the memory.
    from defusedxml.common import DefusedXmlException
    from defusedxml.ElementTree import DefusedXMLParser

    class WithLines(TreeBuilder):
        def start(self, tag: Any, attrs: Any) -> Any:
            return super().start(tag, {**attrs, _LINE: str(parser.parser.CurrentLineNumber)})

    parser = DefusedXMLParser(target=WithLines())
    try:
        parser.feed(data)
        root: Element = parser.close()
    except ParseError as error:
        line = error.position[0] if hasattr(error, "position") else 0
        found.problem("error", "xml", line, f"is no XML: {error}; expected PNML.")
    except DefusedXmlException as error:
        text = f"has entities, which are not read: {type(error).__name__}; expected plain PNML."
        found.problem("error", "xml", parser.parser.CurrentLineNumber, text)
    except (LookupError, ValueError) as error:
        found.problem("error", "xml", 1, f"cannot be decoded: {error}; expected PNML.")
    else:
        return root
    return None


def _read_root(root: Element, found: _ReadNet) -> None:
    if _tag(root) != "pnml":
        found.problem("error", "xml", root, f"got <{_tag(root)}>; expected <pnml>.")
        return
    nets = [child for child in root if _tag(child) == "net"]
    if len(nets) != 1:
        found.problem("error", "xml", root, f"got {len(nets)} nets; expected one.")
        return
    # PNP's dialect has no pages.
    if _namespace(root) == NAMESPACE or any(_tag(child) == "page" for child in nets[0]):
        found.dialect = "2009"
    kind = nets[0].get("type", "")
    if not is_place_transition_net(kind):
        text = f"type: got {kind!r}; expected a place/transition net, {PT_NET!r}."
        found.problem("error", "xml", nets[0], text)
    if found.dialect == "2009":
        own = _text_below(nets[0], "name", found)
        found.name = own.strip() or found.name
    _read_nodes(nets[0], found, 0)
    for element in priorities([e for e in nets[0].iter() if _tag(e) == "transition"])[:1]:
        text = "priority: differs from that of others, and is ignored: the first in the file fires."
        found.problem("warning", "xml", element, text)


_MAX_PAGE_DEPTH: Final = 50  # pages may contain pages; the reader is recursive


def _read_nodes(parent: Element, found: _ReadNet, depth: int) -> None:
    if depth > _MAX_PAGE_DEPTH:
        found.problem("error", "xml", parent, f"got more than {_MAX_PAGE_DEPTH} pages deep.")
        return
    _report_excess(parent, found)
    for element in parent:
        tag = _tag(element)
        if tag in {"place", "transition", "arc", "referencePlace", "referenceTransition"}:
            _read_node(element, tag, found)
        elif tag == "page":
            _read_nodes(element, found, depth + 1)
        elif tag == "comment":
            text = _text_below(element, None, found).strip()
            if text.startswith(_PLAN_NAME):
                found.name = text.removeprefix(_PLAN_NAME).strip() or found.name


def _report_excess(element: Element, found: _ReadNet) -> None:
    """Report what a plan cannot mean: errors at each element, warnings at the first of a kind."""
    for severity, message, hint in excess(element):
        if severity == "error":
            found.problem(
                "error", "arc" if _tag(element) == "arc" else "xml", element, message, hint
            )
        elif (_tag(element), message) not in found.excess:
            found.excess.add((_tag(element), message))
            found.problem(
                severity, "arc" if _tag(element) == "arc" else "xml", element, message, hint
            )


def _read_node(element: Element, tag: str, found: _ReadNet) -> None:
    _report_excess(element, found)
    identity = element.get("id")
    line = int(element.get(_LINE, "0"))
    if not identity and tag != "arc":
        found.problem("error", "id", element, f"got a <{tag}> without id; expected one.")
        return
    identity = identity or ""
    if tag == "arc":
        _read_arc(element, found)
        return
    if identity in found.places or identity in found.transitions or identity in found.references:
        found.problem("error", "id", element, "got its id a second time; expected unique ids.")
        return
    if tag.startswith("reference"):
        found.references[identity] = element.get("ref", "")
    elif tag == "place":
        marked = _number(element, ("initialMarking",), 0, found)
        found.places[identity] = Place(identity, _label(element, found), marked, line)
    else:
        found.transitions[identity] = Transition(identity, _label(element, found), line)


def _read_arc(element: Element, found: _ReadNet) -> None:
    source, target = element.get("source", ""), element.get("target", "")
    if not (source and target):
        text = f"got source {source!r}, target {target!r}; expected the ids of two nodes."
        found.problem("error", "arc", element, text)
        return
    # PNP ignores an arc that stands above one of its nodes; `_checked_arcs` reports it.
    late = source not in found.places and source not in found.transitions
    late = late or (target not in found.places and target not in found.transitions)
    if late and found.dialect == "pnp":
        element.set("late", "1")
    weight = _number(element, ("inscription", "weight", "multiplicity"), 1, found)
    if weight == 0:
        text = "inscription: got 0; expected at least 1. It moves no token, and is left out."
        found.problem("warning", "number", element, text)
        return
    found.arcs.append((Arc(source, target, weight), element))


def _checked_arcs(found: _ReadNet) -> tuple[Arc, ...]:
    """Return the arcs whose two nodes exist, and record the problems of the others.

    PNP drops an arc that stands above one of its nodes, so it is dropped here too, with a warning.
    """
    # At the end, as in PNML 2009 an arc may stand above its nodes, and so may references to them.
    arcs = []
    for arc, element in found.arcs:
        source = _resolved(arc.source, found)
        target = _resolved(arc.target, found)
        missing = [
            name
            for name in (source, target)
            if name not in found.places and name not in found.transitions
        ]
        if missing:
            text = f"got {missing[0]!r}; expected the id of a place or a transition of the net."
            found.problem("error", "arc", element, text)
        elif (source in found.places) == (target in found.places):
            kind = "places" if source in found.places else "transitions"
            text = f"got an arc between two {kind}; expected a place and a transition."
            if found.dialect == "pnp":
                text += " PNP drops it, and so it is left out here."
            found.problem("warning" if found.dialect == "pnp" else "error", "arc", element, text)
        elif element.get("late"):
            text = "stands above one of its ends; PNP drops it, and so it is left out here."
            hint = "Try to put it behind both."
            found.problem("warning", "arc", element, text, hint)
        else:
            arcs.append(Arc(source, target, arc.weight))
    return tuple(arcs)


def _resolved(name: str, found: _ReadNet) -> str:
    seen: set[str] = set()  # references may form a circle
    while name in found.references and name not in seen:
        seen.add(name)
        name = found.references[name]
    return name


def _number(element: Element, names: tuple[str, ...], default: int, found: _ReadNet) -> int:
    """Return the number in the first child or attribute of these names, or `default`."""
    name = names[0]
    if any(_tag(child) == name for child in element):
        text = _text_below(element, name, found).strip()
    else:
        given = [(name, element.get(name, "")) for name in names if element.get(name)]
        # TAPAAL's arcs have an interval of time there, of which only the free one may be left out.
        name, text = next((pair for pair in given if not pair[1].startswith("[")), ("", ""))
        if not name:
            return default
    number = tokens(text)
    if number is not None and number <= MAX_TOKENS:
        return number
    least = 0 if name == "initialMarking" else 1
    expected = f"a whole number from {least} to {MAX_TOKENS}"
    if name == "initialMarking" and "," in text:
        expected += ", of one colour"
    found.problem("error", "number", element, f"{name}: got {text!r}; expected {expected}.")
    return default


def _label(element: Element, found: _ReadNet) -> str:
    return _text_below(element, "name", found) or element.get("name", "")


def _text_below(element: Element, tag: str | None, found: _ReadNet) -> str:
    """Return the text of `element`'s child `tag`; it is in that child's `value` or `text`."""
    holder = element
    if tag is not None:
        holders = [child for child in element if _tag(child) == tag]
        if not holders:
            return ""
        holder = holders[0]
    # PNP writes <value>, PNML 2009 <text>.
    for child in holder:
        if _tag(child) in {"value", "text"}:
            text = "".join(child.itertext())
            if not text and tag == "name":
                found.problem(
                    "note", "xml", element, "has an empty name, which ends PNP's own loader."
                )
            return text
    return ""


def _namespace(element: Element) -> str:
    return str(element.tag).partition("}")[0].lstrip("{")


def _name_of(element: Element) -> str:
    tag = _tag(element)
    identity = element.get("id")
    if tag == "arc":
        ends = f"{element.get('source', '?')} -> {element.get('target', '?')}"
        return f"arc {identity!r} ({ends})" if identity else f"arc {ends}"
    return f"{tag} {identity!r}" if identity else f"<{tag}>"


# -- writing ---------------------------------------------------------------------------------------


def pnml_text(net: Net, *, dialect: Dialect = "pnp") -> str:
    """Return a net as the text of a file; reading that gives the same net.

    Raises:
        InvalidStateError: a name has a character that XML does not allow.
    """
    from xml.etree import ElementTree as ET

    is_pnp = dialect == "pnp"
    holds = "value" if is_pnp else "text"
    root = ET.Element("pnml", {} if is_pnp else {"xmlns": NAMESPACE})
    kind = "PTNet" if is_pnp else PT_NET
    outer = ET.SubElement(root, "net", {"id": "plan", "type": kind})
    if is_pnp:
        comment = ET.SubElement(ET.SubElement(outer, "comment"), "text")
        ET.SubElement(comment, "value").text = f"{_PLAN_NAME} {net.name}"
        page = outer
    else:
        ET.SubElement(ET.SubElement(outer, "name"), "text").text = net.name
        page = ET.SubElement(outer, "page", {"id": _free_id(net, "page")})

    def add(parent: Element, tag: str, text: str) -> None:
        ET.SubElement(ET.SubElement(parent, tag), holds).text = text

    for place in net.places:
        element = ET.SubElement(page, "place", {"id": place.id})
        add(element, "name", place.name or " ")  # an empty name ends PNP's own loader
        if place.tokens:
            add(element, "initialMarking", str(place.tokens))
    for transition in net.transitions:
        element = ET.SubElement(page, "transition", {"id": transition.id})
        add(element, "name", transition.name or " ")
    # One arc for two between the same nodes: not all tools add their weights.
    weights: Counter[tuple[str, str]] = Counter()
    for arc in net.arcs:
        weights[arc.source, arc.target] += arc.weight
    for number, ((source, target), weight) in enumerate(weights.items(), 1):
        ends = {"source": source, "target": target}
        element = ET.SubElement(page, "arc", {"id": _free_id(net, f"a{number}"), **ends})
        if weight > 1:
            add(element, "inscription", str(weight))
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode")
    odd = _NOT_XML.search(text)
    if odd is not None:
        raise InvalidStateError(
            f"net {net.name!r}: got {odd[0]!r} in it; expected characters that XML allows."
        )
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def write_pnml(net: Net, file: Path | str, *, dialect: Dialect = "pnp") -> Path:
    """Write a net to a file.

    Raises:
        OSError: it cannot be written.
    """
    path = Path(file)
    path.write_text(pnml_text(net, dialect=dialect), encoding="utf-8")
    return path


def _free_id(net: Net, wanted: str) -> str:
    while wanted in net.place_numbers or wanted in net.transition_numbers:
        wanted += "_"
    return wanted
