"""Missions as files: machines in YAML, read, written and described; see docs/mission_files.md."""

from __future__ import annotations

from smachpy.files.reading import MissionFileError, Parameter, load, read
from smachpy.files.reference import resolve
from smachpy.files.schema import schema
from smachpy.files.writing import NotWrittenError, write

__all__ = [
    "MissionFileError",
    "NotWrittenError",
    "Parameter",
    "load",
    "read",
    "resolve",
    "schema",
    "write",
]
