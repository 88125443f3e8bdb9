"""A PostgreSQL of a test: Debian's programs, its own folder, on loopback; it refuses to run as root."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tests.free_port import free_port

if TYPE_CHECKING:
    from collections.abc import Sequence

# Safe only for tests: nothing here survives a power loss, but all of it the end of the server.
QUICK = (
    "-c fsync=off -c listen_addresses=127.0.0.1 -c unix_socket_directories= -c max_connections=40"
)
WITHIN_S = 250


def programs() -> Path | None:
    """Return the folder of `initdb` and `postgres`, None when they are not installed."""
    folders = sorted(Path("/usr/lib/postgresql").glob("*/bin"), key=lambda p: int(p.parent.name))
    found = shutil.which("initdb")
    if found is not None:
        folders.append(Path(found).resolve().parent)
    return next((f for f in reversed(folders) if (f / "initdb").exists()), None)


class PostgresServer:
    """One server with one cluster; `start`, `stop` and `kill` may be called again and again.

    Args:
        folder: Where its files are.
        primary: The server that it is a standby of, which runs; None: it is one of its own.
    """

    def __init__(self, folder: Path, primary: PostgresServer | None = None) -> None:
        found = programs()
        assert found is not None, "PostgreSQL is missing: .ci/postgres"
        self._programs = found
        self._folder = folder / "cluster"
        self._log = folder / "log"
        self.port = free_port()
        self._runs = False
        self._as_user: dict[str, Any] = {}
        if os.getuid() == 0:
            folder.chmod(0o777)
            self._as_user = {"user": "nobody", "group": "nogroup", "extra_groups": []}
        if primary is not None:
            copy = ("-X", "stream", "-c", "fast", "-R")  # -R: it follows when it is started
            self._run("pg_basebackup", "-D", self._folder, "-d", primary.url, *copy)
            return
        self._run(
            "initdb",
            "-D",
            self._folder,
            "-U",
            "tests",
            "--auth=trust",
            "-N",
            "-E",
            "UTF8",
            "--locale=C",
        )

    @property
    def url(self) -> str:
        return f"postgresql://tests@127.0.0.1:{self.port}/postgres"

    def start(self) -> None:
        options = f"-p {self.port} {QUICK}"
        self._pg_ctl("start", "-w", "-t", str(WITHIN_S), "-l", self._log, "-o", options)
        self._runs = True

    def stop(self) -> None:
        """End the server as an administrator does who does not wait: connections are ended."""
        self._end("fast")

    def kill(self) -> None:
        """End the server as a crash does; it recovers from its log at the next start."""
        self._end("immediate")

    def promote(self) -> None:
        """Let a standby take over."""
        self._pg_ctl("promote", "-w", "-t", str(WITHIN_S))

    def new_database(self, name: str) -> str:
        """Make an empty database and return its URL."""
        import psycopg

        with psycopg.connect(self.url, autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name}")
        return f"postgresql://tests@127.0.0.1:{self.port}/{name}"

    def _end(self, how: str) -> None:
        if self._runs:
            self._pg_ctl("stop", "-m", how)
            self._runs = False

    def _pg_ctl(self, what: str, *arguments: object) -> None:
        # The server is no child of this process: it outlives the test that has started it.
        self._run("pg_ctl", what, "-s", "-D", self._folder, *arguments)

    def _run(self, program: str, *arguments: object) -> None:
        command: Sequence[Any] = [self._programs / program, *map(str, arguments)]
        done = subprocess.run(
            command,
            cwd=self._folder.parent,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,  # a server would keep a pipe open
            stderr=subprocess.DEVNULL,
            timeout=WITHIN_S,
            check=False,
            **self._as_user,
        )
        assert done.returncode == 0, f"{command}: {self._log.exists() and self._log.read_text()}"
