"""tf's module of that name."""

from smachpy.ros1.names.tf import TransformBroadcaster
