# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import ClassVar as _ClassVar, TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.type_description_interfaces.msg as _type_description_interfaces_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service

class GetTypeDescription(_Ros2Service):
    Request: _TypeAlias = GetTypeDescription_Request
    Response: _TypeAlias = GetTypeDescription_Response
    _request_class: _ClassVar[type[GetTypeDescription_Request]]
    _response_class: _ClassVar[type[GetTypeDescription_Response]]

class GetTypeDescription_Request(_Ros2Message):
    type_name: str
    type_hash: str
    include_type_sources: bool
    def __init__(
        self,
        type_name: str | None = None,
        type_hash: str | None = None,
        include_type_sources: bool | None = None,
    ) -> None: ...

class GetTypeDescription_Response(_Ros2Message):
    successful: bool
    failure_reason: str
    type_description: _type_description_interfaces_msg.TypeDescription
    type_sources: list[_type_description_interfaces_msg.TypeSource]
    extra_information: list[_type_description_interfaces_msg.KeyValue]
    def __init__(
        self,
        successful: bool | None = None,
        failure_reason: str | None = None,
        type_description: _type_description_interfaces_msg.TypeDescription | None = None,
        type_sources: _Collection[_type_description_interfaces_msg.TypeSource] | None = None,
        extra_information: _Collection[_type_description_interfaces_msg.KeyValue] | None = None,
    ) -> None: ...
