"""Real rclpy, in processes of its own Python; `.ci/rclpy` installs it."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.places import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator

ENVIRONMENTS = ROOT / ".venv-rclpy"
DISTROS = ("jazzy", "kilted")
CHILD = Path(__file__).parent / "programs" / "child.py"
DOMAINS = 230  # of Fast DDS, so that test runs on one machine do not meet


class Rclpy:
    """A process with rclpy of one distribution, over shared memory only: it opens no port.

    Args:
        distro: One of `DISTROS`.
        folder: Where it may write its log.
    """

    def __init__(self, distro: str, folder: Path) -> None:
        self.distro = distro
        environment = {k: v for k, v in os.environ.items() if not k.startswith(("ROS", "PYTHON"))}
        self._child = subprocess.Popen(
            [ENVIRONMENTS / distro / "bin" / "python", CHILD],
            env={
                **environment,
                "FASTDDS_BUILTIN_TRANSPORTS": "SHM",
                "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
                "ROS_DOMAIN_ID": str(1 + os.getpid() % DOMAINS),
                "ROS_LOG_DIR": str(folder),
            },
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    @property
    def share(self) -> Path:
        """The folder of its packages: definitions, and descriptions with their hashes."""
        return ENVIRONMENTS / self.distro / "share"

    def ask(self, command: str, *arguments: Any) -> Any:
        """Return what the child answers; see there."""
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        self._child.stdin.write(json.dumps([command, *arguments]) + "\n")
        self._child.stdin.flush()
        answer = self._child.stdout.readline()
        assert answer, f"rclpy has ended over {command} {arguments}"
        return json.loads(answer)

    def close(self) -> None:
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        self._child.stdin.close()
        assert self._child.wait(60) == 0
        self._child.stdout.close()


@pytest.fixture(scope="session", params=DISTROS)
def rclpy(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Rclpy]:
    """A process with rclpy, of one distribution after the other."""
    if not (ENVIRONMENTS / request.param / "installed").exists():
        pytest.skip("needs rclpy; try: .ci/rclpy")
    process = Rclpy(request.param, tmp_path_factory.mktemp("rclpy"))
    yield process
    process.close()
