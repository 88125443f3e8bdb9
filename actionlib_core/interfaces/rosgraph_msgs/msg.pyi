# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message
from actionlib_core.time import Duration as _Duration
from actionlib_core.time import Time as _Time

class Clock(_Message):
    """Simulated time."""

    clock: _Time
    def __init__(
        self,
        clock: _Time | float | None = None,
    ) -> None: ...

class Log(_Message):
    """One log record."""

    DEBUG: _Final = 1
    INFO: _Final = 2
    WARN: _Final = 4
    ERROR: _Final = 8
    FATAL: _Final = 16
    header: _std_msgs_msg.Header
    level: int  # one of the constants
    name: str  # of the node
    msg: str  # the text
    file: str  # source file
    function: str  # in the source
    line: int  # in the file
    topics: list[str]  # that the node publishes
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        level: int | None = None,
        name: str | None = None,
        msg: str | None = None,
        file: str | None = None,
        function: str | None = None,
        line: int | None = None,
        topics: _Collection[str] | None = None,
    ) -> None: ...

class TopicStatistics(_Message):
    topic: str
    node_pub: str
    node_sub: str
    window_start: _Time
    window_stop: _Time
    delivered_msgs: int
    dropped_msgs: int
    traffic: int
    period_mean: _Duration
    period_stddev: _Duration
    period_max: _Duration
    stamp_age_mean: _Duration
    stamp_age_stddev: _Duration
    stamp_age_max: _Duration
    def __init__(
        self,
        topic: str | None = None,
        node_pub: str | None = None,
        node_sub: str | None = None,
        window_start: _Time | float | None = None,
        window_stop: _Time | float | None = None,
        delivered_msgs: int | None = None,
        dropped_msgs: int | None = None,
        traffic: int | None = None,
        period_mean: _Duration | float | None = None,
        period_stddev: _Duration | float | None = None,
        period_max: _Duration | float | None = None,
        stamp_age_mean: _Duration | float | None = None,
        stamp_age_stddev: _Duration | float | None = None,
        stamp_age_max: _Duration | float | None = None,
    ) -> None: ...
