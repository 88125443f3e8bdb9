"""roslib, as far as scripts use it: `load_manifest` does nothing, packages are found by folder."""

from __future__ import annotations

from typing import Any

__all__ = ["load_manifest"]


def load_manifest(package_name: str) -> None:
    """Do nothing: modules and messages are found without it."""
