# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message

class SmachContainerInitialStatusCmd(_Message):
    path: str  # of the container in the machine
    initial_states: list[str]  # labels to begin with next time
    local_data: str  # userdata to set, as JSON text
    def __init__(
        self,
        path: str | None = None,
        initial_states: _Collection[str] | None = None,
        local_data: str | None = None,
    ) -> None: ...

class SmachContainerStatus(_Message):
    header: _std_msgs_msg.Header
    path: str  # of the container in the machine, for example /PATROL/DRIVE
    initial_states: list[str]  # labels
    active_states: list[str]  # labels
    local_data: str  # the container's userdata, as JSON text
    info: str  # free text
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        path: str | None = None,
        initial_states: _Collection[str] | None = None,
        active_states: _Collection[str] | None = None,
        local_data: str | None = None,
        info: str | None = None,
    ) -> None: ...

class SmachContainerStructure(_Message):
    header: _std_msgs_msg.Header
    path: str  # of the container in the machine
    children: list[str]  # labels of the states
    internal_outcomes: list[str]  # The transitions: outcome number i of state outcomes_from[i] leads to outcomes_to[i].
    outcomes_from: list[str]
    outcomes_to: list[str]
    container_outcomes: list[str]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        path: str | None = None,
        children: _Collection[str] | None = None,
        internal_outcomes: _Collection[str] | None = None,
        outcomes_from: _Collection[str] | None = None,
        outcomes_to: _Collection[str] | None = None,
        container_outcomes: _Collection[str] | None = None,
    ) -> None: ...
