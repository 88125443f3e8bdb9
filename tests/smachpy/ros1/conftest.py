from __future__ import annotations

import shutil

import pytest

from tests.places import ROOT

SCRIPTS = ROOT / "tests" / "ros1_scripts"


@pytest.fixture(scope="session")
def scripts(tmp_path_factory):
    """Return a folder with the scripts of tests/ros1_scripts.

    Those of Python 2 are kept as `.py2`, so that no tool takes them for Python 3; here they are
    `.py`, as robots have them.
    """
    folder = tmp_path_factory.mktemp("scripts")
    for path in SCRIPTS.rglob("*.py*"):
        if path.suffix in {".py", ".py2"}:
            target = (folder / path.relative_to(SCRIPTS)).with_suffix(".py")
            target.parent.mkdir(exist_ok=True)
            shutil.copyfile(path, target)
    return folder
