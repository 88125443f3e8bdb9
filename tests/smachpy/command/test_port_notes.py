"""`smachpy port` lists changes of values that a state may only read; SMACH let them through."""

from __future__ import annotations

from smachpy.command import main

ITERATES = """import smach

@smach.cb_interface(input_keys=['i', 'nums'], output_keys=[], outcomes=['done'])
def note(ud):
    ud.nums.append(ud.i)
    return 'done'

@smach.cb_interface(['done'], ['nums'], ['nums'])
def may(ud):
    ud.nums.append(1)
    return 'done'

class Foo(smach.State):
    def __init__(self):
        smach.State.__init__(self, ['done'], input_keys=['seen'], io_keys=['mine'])

    def execute(self, userdata):
        userdata.mine.append(2)
        del userdata.seen[0]
        return 'done'
"""


def test_a_change_of_an_input_is_listed_with_its_line(tmp_path, capsys):
    (tmp_path / "old.py").write_text(ITERATES)

    assert main(["port", str(tmp_path / "old.py"), "-o", str(tmp_path / "new.py")]) == 0

    notes = [line for line in capsys.readouterr().err.splitlines() if "an input key only" in line]
    assert notes == [
        f"{tmp_path}/old.py:{line}: {key}: its value is changed, but {key.split('.')[1]!r} is an input key only: declare it as output, too"
        for line, key in [(5, "ud.nums"), (19, "userdata.seen")]
    ]


def test_a_script_in_another_encoding_is_declared_as_what_is_written(tmp_path):
    old, new = tmp_path / "old.py", tmp_path / "new.py"
    for header in ("# -*- coding: latin-1 -*-", "#!/usr/bin/env python\n# vim: set coding=latin1:"):
        old.write_text(f'{header}\nimport rospy\nWORD = "café"\n', encoding="latin-1")
        assert main(["port", str(old), "-o", str(new)]) == 0
        found: dict[str, str] = {}
        exec(compile(new.read_bytes(), str(new), "exec"), found)
        assert found["WORD"] == "café"
        new.unlink()
