"""tf_conversions: converts between messages, matrices, tf's pairs and PyKDL's frames."""

from __future__ import annotations

from smachpy.ros1.names.tf import transformations as transformations
from smachpy.ros1.names.tf_conversions.posemath import (
    fromCameraParams,
    fromMatrix,
    fromMsg,
    fromTf,
    toMatrix,
    toMsg,
    toTf,
)
