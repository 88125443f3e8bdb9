# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.type_description_interfaces.msg import (
    Field as Field,
    FieldType as FieldType,
    IndividualTypeDescription as IndividualTypeDescription,
    KeyValue as KeyValue,
    TypeDescription as TypeDescription,
    TypeSource as TypeSource,
)
