# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import ClassVar as _ClassVar, TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.rcl_interfaces.msg as _rcl_interfaces_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service

class ListNodes(_Ros2Service):
    Request: _TypeAlias = ListNodes_Request
    Response: _TypeAlias = ListNodes_Response
    _request_class: _ClassVar[type[ListNodes_Request]]
    _response_class: _ClassVar[type[ListNodes_Response]]

class ListNodes_Request(_Ros2Message):
    def __init__(self) -> None: ...

class ListNodes_Response(_Ros2Message):
    full_node_names: list[str]
    unique_ids: list[int]
    def __init__(
        self,
        full_node_names: _Collection[str] | None = None,
        unique_ids: _Collection[int] | None = None,
    ) -> None: ...

class LoadNode(_Ros2Service):
    Request: _TypeAlias = LoadNode_Request
    Response: _TypeAlias = LoadNode_Response
    _request_class: _ClassVar[type[LoadNode_Request]]
    _response_class: _ClassVar[type[LoadNode_Response]]

class LoadNode_Request(_Ros2Message):
    package_name: str
    plugin_name: str
    node_name: str
    node_namespace: str
    log_level: int
    remap_rules: list[str]
    parameters: list[_rcl_interfaces_msg.Parameter]
    extra_arguments: list[_rcl_interfaces_msg.Parameter]
    def __init__(
        self,
        package_name: str | None = None,
        plugin_name: str | None = None,
        node_name: str | None = None,
        node_namespace: str | None = None,
        log_level: int | None = None,
        remap_rules: _Collection[str] | None = None,
        parameters: _Collection[_rcl_interfaces_msg.Parameter] | None = None,
        extra_arguments: _Collection[_rcl_interfaces_msg.Parameter] | None = None,
    ) -> None: ...

class LoadNode_Response(_Ros2Message):
    success: bool
    error_message: str
    full_node_name: str
    unique_id: int
    def __init__(
        self,
        success: bool | None = None,
        error_message: str | None = None,
        full_node_name: str | None = None,
        unique_id: int | None = None,
    ) -> None: ...

class UnloadNode(_Ros2Service):
    Request: _TypeAlias = UnloadNode_Request
    Response: _TypeAlias = UnloadNode_Response
    _request_class: _ClassVar[type[UnloadNode_Request]]
    _response_class: _ClassVar[type[UnloadNode_Response]]

class UnloadNode_Request(_Ros2Message):
    unique_id: int
    def __init__(
        self,
        unique_id: int | None = None,
    ) -> None: ...

class UnloadNode_Response(_Ros2Message):
    success: bool
    error_message: str
    def __init__(
        self,
        success: bool | None = None,
        error_message: str | None = None,
    ) -> None: ...
