# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.rcl_interfaces.msg import (
    FloatingPointRange as FloatingPointRange,
    IntegerRange as IntegerRange,
    ListParametersResult as ListParametersResult,
    Log as Log,
    LoggerLevel as LoggerLevel,
    Parameter as Parameter,
    ParameterDescriptor as ParameterDescriptor,
    ParameterEvent as ParameterEvent,
    ParameterEventDescriptors as ParameterEventDescriptors,
    ParameterType as ParameterType,
    ParameterValue as ParameterValue,
    SetLoggerLevelsResult as SetLoggerLevelsResult,
    SetParametersResult as SetParametersResult,
)
