"""What an error text suggests."""

from __future__ import annotations

from actionlib_core.inputs.suggest import did_you_mean


def test_did_you_mean():
    assert did_you_mean("String", ["string", "int8"]) == " Did you mean 'string'?"
    assert (
        did_you_mean("wate", ["wait", "water", "x"], most=2) == " Did you mean 'water' or 'wait'?"
    )
    assert did_you_mean("xyz", ["string"]) == ""
