# Written by `actionlib interface stubs`; changes are lost.
from typing import Final as _Final
from actionlib_core.interfaces import Ros2Message as _Ros2Message

class State(_Ros2Message):
    PRIMARY_STATE_UNKNOWN: _Final = 0
    PRIMARY_STATE_UNCONFIGURED: _Final = 1
    PRIMARY_STATE_INACTIVE: _Final = 2
    PRIMARY_STATE_ACTIVE: _Final = 3
    PRIMARY_STATE_FINALIZED: _Final = 4
    TRANSITION_STATE_CONFIGURING: _Final = 10
    TRANSITION_STATE_CLEANINGUP: _Final = 11
    TRANSITION_STATE_SHUTTINGDOWN: _Final = 12
    TRANSITION_STATE_ACTIVATING: _Final = 13
    TRANSITION_STATE_DEACTIVATING: _Final = 14
    TRANSITION_STATE_ERRORPROCESSING: _Final = 15
    id: int
    label: str
    def __init__(
        self,
        id: int | None = None,
        label: str | None = None,
    ) -> None: ...

class Transition(_Ros2Message):
    TRANSITION_CREATE: _Final = 0
    TRANSITION_CONFIGURE: _Final = 1
    TRANSITION_CLEANUP: _Final = 2
    TRANSITION_ACTIVATE: _Final = 3
    TRANSITION_DEACTIVATE: _Final = 4
    TRANSITION_UNCONFIGURED_SHUTDOWN: _Final = 5
    TRANSITION_INACTIVE_SHUTDOWN: _Final = 6
    TRANSITION_ACTIVE_SHUTDOWN: _Final = 7
    TRANSITION_DESTROY: _Final = 8
    TRANSITION_ON_CONFIGURE_SUCCESS: _Final = 10
    TRANSITION_ON_CONFIGURE_FAILURE: _Final = 11
    TRANSITION_ON_CONFIGURE_ERROR: _Final = 12
    TRANSITION_ON_CLEANUP_SUCCESS: _Final = 20
    TRANSITION_ON_CLEANUP_FAILURE: _Final = 21
    TRANSITION_ON_CLEANUP_ERROR: _Final = 22
    TRANSITION_ON_ACTIVATE_SUCCESS: _Final = 30
    TRANSITION_ON_ACTIVATE_FAILURE: _Final = 31
    TRANSITION_ON_ACTIVATE_ERROR: _Final = 32
    TRANSITION_ON_DEACTIVATE_SUCCESS: _Final = 40
    TRANSITION_ON_DEACTIVATE_FAILURE: _Final = 41
    TRANSITION_ON_DEACTIVATE_ERROR: _Final = 42
    TRANSITION_ON_SHUTDOWN_SUCCESS: _Final = 50
    TRANSITION_ON_SHUTDOWN_FAILURE: _Final = 51
    TRANSITION_ON_SHUTDOWN_ERROR: _Final = 52
    TRANSITION_ON_ERROR_SUCCESS: _Final = 60
    TRANSITION_ON_ERROR_FAILURE: _Final = 61
    TRANSITION_ON_ERROR_ERROR: _Final = 62
    TRANSITION_CALLBACK_SUCCESS: _Final = 97
    TRANSITION_CALLBACK_FAILURE: _Final = 98
    TRANSITION_CALLBACK_ERROR: _Final = 99
    id: int
    label: str
    def __init__(
        self,
        id: int | None = None,
        label: str | None = None,
    ) -> None: ...

class TransitionDescription(_Ros2Message):
    transition: Transition
    start_state: State
    goal_state: State
    def __init__(
        self,
        transition: Transition | None = None,
        start_state: State | None = None,
        goal_state: State | None = None,
    ) -> None: ...

class TransitionEvent(_Ros2Message):
    timestamp: int
    transition: Transition
    start_state: State
    goal_state: State
    def __init__(
        self,
        timestamp: int | None = None,
        transition: Transition | None = None,
        start_state: State | None = None,
        goal_state: State | None = None,
    ) -> None: ...
