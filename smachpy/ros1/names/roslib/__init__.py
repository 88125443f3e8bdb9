"""roslib: the parts that scripts use. `load_manifest` does nothing: packages are found anyway."""

from __future__ import annotations

from smachpy.ros1.names.roslib import message as message
from smachpy.ros1.names.roslib import packages as packages

__all__ = ["load_manifest", "message", "packages"]


def load_manifest(package_name: str) -> None:
    """Do nothing: modules and messages are found without it."""
