"""The package imports what is used, and no more."""

from __future__ import annotations

import subprocess
import sys

import pytest

import smachpy.states


def test_every_name_is_there():
    for name in smachpy.states.__all__:
        assert getattr(smachpy.states, name) is not None
    assert set(smachpy.states.__all__) <= set(dir(smachpy.states))
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = smachpy.states.nothing


@pytest.mark.slow
def test_a_file_that_waits_imports_neither_topics_nor_what_drives(tmp_path):
    (tmp_path / "wait.yaml").write_text(
        "outcomes: [done, preempted]\nstates: {A: {state: wait, with: {seconds: 1}}}\n"
    )
    program = (
        "import smachpy, sys; smachpy.load('wait.yaml'); "
        "print([name for name in sys.modules if name in "
        "{'actionlib_core.pubsub.topic', 'smachpy.states.driving', 'importlib.metadata'}])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout == "[]\n"
