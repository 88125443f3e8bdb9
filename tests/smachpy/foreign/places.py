"""Files of other tools for tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from smachpy import load
from smachpy.files import MissionFileError

_FUZZ = Path(__file__).parents[2] / "fuzz"
ROUNDS = {
    "xml": (_FUZZ / "rounds.xml").read_text(),
    "scxml": (_FUZZ / "rounds.scxml").read_text(),
    "py": (_FUZZ / "rounds_sm.py.txt").read_text(),
}


def save(folder, text, name="m.xml"):
    """Write a file."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def refused(path):
    """Return the error of a file, without the name of the file."""
    with pytest.raises(MissionFileError) as caught:
        load(path)
    return str(caught.value).replace(f"{path}:", "")
