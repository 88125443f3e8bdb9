"""What identifies a program: git may be slow, or hang."""

from __future__ import annotations

import subprocess

import pytest

from smachpy.events import code


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
