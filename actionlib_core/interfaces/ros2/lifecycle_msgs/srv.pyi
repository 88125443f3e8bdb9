# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import ClassVar as _ClassVar, TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.lifecycle_msgs.msg as _lifecycle_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service

class ChangeState(_Ros2Service):
    Request: _TypeAlias = ChangeState_Request
    Response: _TypeAlias = ChangeState_Response
    _request_class: _ClassVar[type[ChangeState_Request]]
    _response_class: _ClassVar[type[ChangeState_Response]]

class ChangeState_Request(_Ros2Message):
    transition: _lifecycle_msgs_msg.Transition
    def __init__(
        self,
        transition: _lifecycle_msgs_msg.Transition | None = None,
    ) -> None: ...

class ChangeState_Response(_Ros2Message):
    success: bool
    def __init__(
        self,
        success: bool | None = None,
    ) -> None: ...

class GetAvailableStates(_Ros2Service):
    Request: _TypeAlias = GetAvailableStates_Request
    Response: _TypeAlias = GetAvailableStates_Response
    _request_class: _ClassVar[type[GetAvailableStates_Request]]
    _response_class: _ClassVar[type[GetAvailableStates_Response]]

class GetAvailableStates_Request(_Ros2Message):
    def __init__(self) -> None: ...

class GetAvailableStates_Response(_Ros2Message):
    available_states: list[_lifecycle_msgs_msg.State]
    def __init__(
        self,
        available_states: _Collection[_lifecycle_msgs_msg.State] | None = None,
    ) -> None: ...

class GetAvailableTransitions(_Ros2Service):
    Request: _TypeAlias = GetAvailableTransitions_Request
    Response: _TypeAlias = GetAvailableTransitions_Response
    _request_class: _ClassVar[type[GetAvailableTransitions_Request]]
    _response_class: _ClassVar[type[GetAvailableTransitions_Response]]

class GetAvailableTransitions_Request(_Ros2Message):
    def __init__(self) -> None: ...

class GetAvailableTransitions_Response(_Ros2Message):
    available_transitions: list[_lifecycle_msgs_msg.TransitionDescription]
    def __init__(
        self,
        available_transitions: _Collection[_lifecycle_msgs_msg.TransitionDescription] | None = None,
    ) -> None: ...

class GetState(_Ros2Service):
    Request: _TypeAlias = GetState_Request
    Response: _TypeAlias = GetState_Response
    _request_class: _ClassVar[type[GetState_Request]]
    _response_class: _ClassVar[type[GetState_Response]]

class GetState_Request(_Ros2Message):
    def __init__(self) -> None: ...

class GetState_Response(_Ros2Message):
    current_state: _lifecycle_msgs_msg.State
    def __init__(
        self,
        current_state: _lifecycle_msgs_msg.State | None = None,
    ) -> None: ...
