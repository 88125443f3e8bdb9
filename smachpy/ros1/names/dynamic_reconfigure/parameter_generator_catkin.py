"""dynamic_reconfigure.parameter_generator_catkin: catkin's name for the same."""

from smachpy.ros1.names.dynamic_reconfigure.parameter_generator import (
    ParameterGenerator,
    bool_t,
    double_t,
    int_t,
    str_t,
)

__all__ = ["ParameterGenerator", "bool_t", "double_t", "int_t", "str_t"]
