"""What the tests over real Zenoh share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actionlib_core.clock import RealClock
from tests.ros2_robot import Ros2Robot

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture
def robot() -> Iterator[Ros2Robot]:
    made = Ros2Robot(RealClock())
    try:
        yield made
    finally:
        made.close()
