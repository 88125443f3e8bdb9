"""What identifies a program: git may be slow, or hang."""

from __future__ import annotations

import subprocess
import sys

import pytest

from smachpy.events import code
from smachpy.userdata import secret


@pytest.mark.parametrize(
    ("hangs_in", "found"), [("rev-parse", ("", False)), ("status", ("1234abcd", True))]
)
def test_a_git_that_hangs_is_not_waited_for(tmp_path, monkeypatch, hangs_in, found):
    """A mission did not begin: git waited for a disk of the network."""
    git = tmp_path / "git"
    git.write_text(f'#!/bin/sh\ncase "$*" in *{hangs_in}*) exec sleep 60;; esac\necho 1234abcd\n')
    git.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    real, limits = subprocess.run, []

    def run(command, *, timeout, **rest):
        limits.append(timeout)
        return real(command, timeout=0.05 if hangs_in in command else 60.0, **rest)

    monkeypatch.setattr(code.subprocess, "run", run)
    assert code._git(tmp_path) == found
    assert set(limits) == {code.GIT_S}


def test_constants_of_a_program_behind_a_link_are_found(tmp_path, monkeypatch):
    """`runs reproduce` did not tell that one of them had changed."""
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "linked_constants.py").write_text("LOW = 0.3\n")
    (tmp_path / "link").symlink_to("real")
    monkeypatch.syspath_prepend(str(tmp_path / "link"))
    import linked_constants

    try:
        assert code.code_facts()["constants"]["linked_constants.LOW"] == "0.3"
    finally:
        del sys.modules[linked_constants.__name__]


CONSTANTS = """
LOW = 0.3
NAMES = ("ann", "bob")
WIFI_PASSWORD = "hunter2"
TOKENS = ("hunter2", "x")
PASSWORD_2 = "hunter2"
DATABASE = "postgresql://ann:hunter2@host/db"
CONNECTION = "host=db password=hunter2"
DOOR_CODE = "hunter2"
"""


def test_no_constant_is_a_secret(tmp_path, monkeypatch):
    """They stood in each recording of the program, where nobody looks for them."""
    path = tmp_path / "secretive_constants.py"
    path.write_text(CONSTANTS)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(secret, "_named", {"door_code"})
    secret.is_secret_name.cache_clear()
    import secretive_constants

    try:
        found = code.own_constants({"secretive_constants": path})
    finally:
        del sys.modules[secretive_constants.__name__]
        secret.is_secret_name.cache_clear()
    assert found == {
        "secretive_constants.LOW": "0.3",
        "secretive_constants.NAMES": "('ann', 'bob')",
    }
