"""XML of other tools: parsed without entities, with the place of each element."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

from smachpy.foreign.draft import MAX_DEPTH, TooMuchError

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

    from smachpy.foreign.draft import Draft, Place

MAX_ELEMENTS: Final = 20_000
"""Most elements of a file."""

_PLACE: Final = "{smachpy}place"  # in a namespace, as the file may have such an attribute


def parse(draft: Draft, text: str) -> Element | None:
    """Return the root element; None if there is none, which is a problem then."""
    from xml.etree.ElementTree import ParseError, TreeBuilder

    # The standard parser expands entities, by which a small file can fill the memory.
    from defusedxml.common import DefusedXmlException
    from defusedxml.ElementTree import DefusedXMLParser

    class WithPlaces(TreeBuilder):
        depth = elements = 0

        def start(self, tag: Any, attrs: Any) -> Any:
            self.depth, self.elements = self.depth + 1, self.elements + 1
            if self.depth > MAX_DEPTH:
                raise TooMuchError(f"got more than {MAX_DEPTH} elements inside each other.")
            if self.elements > MAX_ELEMENTS:
                raise TooMuchError(f"got more than {MAX_ELEMENTS:,} elements.")
            here = parser.parser
            where = f"{here.CurrentLineNumber} {here.CurrentColumnNumber + 1}"
            return super().start(tag, {**attrs, _PLACE: where})

        def end(self, tag: Any) -> Any:
            self.depth -= 1
            return super().end(tag)

    parser = DefusedXMLParser(target=WithPlaces())
    try:
        parser.feed(text)
        root: Element = parser.close()
    except ParseError as error:
        line, column = getattr(error, "position", (1, 0))
        reason = str(error).partition(":")[0]
        draft.problem((line, column + 1), f"not XML: {reason}.")
    except DefusedXmlException:
        here = parser.parser
        text = "got an entity or a DOCTYPE with one; expected XML without."
        draft.problem((here.CurrentLineNumber, here.CurrentColumnNumber + 1), text)
    except TooMuchError as error:
        here = parser.parser
        draft.problem((here.CurrentLineNumber, here.CurrentColumnNumber + 1), str(error))
    except (LookupError, ValueError) as error:
        draft.problem((1, 1), f"not XML: {error}.")
    else:
        return root
    return None


def local(element: Element) -> str:
    """Return the name of an element without its namespace."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def place(element: Element) -> Place:
    """Return where an element begins."""
    line, column = element.get(_PLACE, "1 1").split()
    return int(line), int(column)


def needed(draft: Draft, element: Element, name: str) -> str:
    """Return an attribute that must be there; "" if it is not, which is a problem then."""
    value = element.get(name, "").strip()
    if not value:
        draft.problem(place(element), f"<{local(element)}>: got no {name}; expected one.")
    return value


def identifier(text: str) -> str:
    """Return a name as one of Python."""
    name = re.sub(r"\W", "_", text)
    return f"_{name}" if name[:1].isdigit() else name
