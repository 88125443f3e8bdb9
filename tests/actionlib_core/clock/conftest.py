from __future__ import annotations

import pytest

from actionlib_core.clock import RealClock, VirtualClock


@pytest.fixture(params=["real", "virtual"])
def any_clock(request):
    if request.param == "real":
        yield RealClock()
    else:
        with VirtualClock() as clock:
            yield clock
