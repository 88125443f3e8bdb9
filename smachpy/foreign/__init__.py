"""Machines of other tools, read as mission files: YASMIN's XML, SCXML, behaviours of FlexBE.

Each reader turns the text of a file into the data that a mission file of the same machine has;
`smachpy.files` does all the rest. What cannot be kept is noted. See docs/howto/other_tools.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actionlib_core.inputs.checked_file import read_limited
from smachpy.foreign.draft import MAX_LENGTH, OWN, Draft, Leaf, TooMuchError

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["MAX_LENGTH", "OWN", "SUFFIXES", "Draft", "Leaf", "is_behavior", "read"]

SUFFIXES: Final = (".xml", ".scxml")
"""Ends of names of such files; a behaviour of FlexBE is a `.py`, known by what is in it."""


def is_behavior(path: Path) -> bool:
    """Return whether a file is a behaviour of FlexBE; it is parsed at most, never executed."""
    try:
        content = read_limited(path, MAX_LENGTH)
        if path.suffix != ".py" or b"flexbe_core" not in content:
            return False
        from smachpy.foreign.flexbe import behavior_in
        from smachpy.foreign.literals import parse_python

        return behavior_in(parse_python(content)) is not None
    except (OSError, SyntaxError, ValueError, RecursionError, MemoryError):
        return False


def read(path: Path, text: str, leaf: Leaf, *, is_included: bool = False) -> Draft:
    """Read the text of a file.

    Args:
        path: The file; behaviours and machines that it names are looked for beside it.
        text: What is in it.
        leaf: Says how a mission file names a state.
        is_included: Whether another file names it.

    Returns:
        The data, or problems.
    """
    draft = Draft(path.parent, leaf, is_included=is_included)
    if len(text) > MAX_LENGTH:
        draft.problem((1, 1), f"got {len(text):,} characters; expected at most {MAX_LENGTH:,}.")
        return draft
    try:
        if path.suffix in SUFFIXES:
            _read_xml(draft, text)
        else:
            from smachpy.foreign.flexbe import read as read_behavior

            read_behavior(draft, text)
    except TooMuchError as error:
        draft.problem((1, 1), str(error))
    return draft


def _read_xml(draft: Draft, text: str) -> None:
    from smachpy.foreign import scxml, yasmin
    from smachpy.foreign.xml_text import local, parse, place

    root = parse(draft, text)
    readers = {"StateMachine": yasmin.read, "scxml": scxml.read}
    if root is not None and local(root) in readers:
        readers[local(root)](draft, root)
    elif root is not None:
        expected = "expected <StateMachine>, of YASMIN, or <scxml>"
        draft.problem(place(root), f"got <{local(root)}>; {expected}.")
