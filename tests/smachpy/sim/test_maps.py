from __future__ import annotations

import filecmp
import shutil
import subprocess
import sys

from smachpy.places import maps


def test_the_office_is_what_its_script_draws(tmp_path):
    script = shutil.copy(maps.FOLDER / "make_office.py", tmp_path)
    subprocess.run([sys.executable, script], check=True)
    for name in ("office.pgm", "office.yaml"):
        assert filecmp.cmp(tmp_path / name, maps.FOLDER / name, shallow=False), name
