"""Before a wheel or an editable installation: writes the typed stubs of all interfaces."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class StubsHook(BuildHookInterface[Any]):
    """Runs `.ci/stubs`, in a Python that sees no other packages."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Write the stubs; a source archive has none, as the build from it writes them."""
        del version, build_data
        if self.target_name == "wheel":
            script = Path(self.root, ".ci", "stubs")
            subprocess.run([sys.executable, "-I", "-S", script], check=True)  # noqa: S603  our own
