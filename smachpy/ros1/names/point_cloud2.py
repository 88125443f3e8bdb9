"""sensor_msgs.point_cloud2: reads the points of a PointCloud2, and makes clouds from points.

Source:
    http://docs.ros.org/en/noetic/api/sensor_msgs/html/namespacesensor__msgs_1_1point__cloud2.html
    for names and arguments.
"""

from __future__ import annotations

import math
import struct
from collections import namedtuple
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.interfaces.sensor_msgs.msg import PointCloud2, PointField

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

_LETTERS: Final = {
    PointField.INT8: "b",
    PointField.UINT8: "B",
    PointField.INT16: "h",
    PointField.UINT16: "H",
    PointField.INT32: "i",
    PointField.UINT32: "I",
    PointField.FLOAT32: "f",
    PointField.FLOAT64: "d",
}


def _layout(
    big_endian: bool, fields: Iterable[Any], names: Sequence[str] | None = None
) -> struct.Struct:
    """Return the layout of a point, up to the last of the named fields; None: all fields."""
    text, at = ">" if big_endian else "<", 0
    for field in sorted(fields, key=lambda each: each.offset):
        if names is None or field.name in names:
            text += f"{'x' * (field.offset - at)}{field.count}{_LETTERS[field.datatype]}"
            at = struct.calcsize(text)
    return struct.Struct(text)


def read_points(
    cloud: Any,
    field_names: Iterable[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[tuple[int, int]] = (),
) -> Iterator[tuple[Any, ...]]:
    """Yield the points of a cloud.

    Args:
        cloud: A PointCloud2.
        field_names: The fields to read, in this order; None: all.
        skip_nans: Leave out points with a NaN.
        uvs: Columns and rows of the points to read; empty: all.
    """
    names = None if field_names is None else list(field_names)
    layout = _layout(cloud.is_bigendian, cloud.fields, names)
    # `layout` reads the fields in the order of their offsets; `order` puts them as requested.
    order: list[int] | None = None
    if names is not None:
        held = sorted((f for f in cloud.fields if f.name in names), key=lambda each: each.offset)
        place: dict[str, list[int]] = {}
        for field in held:
            start = sum(map(len, place.values()))
            place[field.name] = list(range(start, start + field.count))
        order = [index for name in names for index in place[name]]
    places: Iterable[tuple[int, int]] = list(uvs) or (
        (u, v) for v in range(cloud.height) for u in range(cloud.width)
    )
    data = bytes(cloud.data)
    for u, v in places:
        point = layout.unpack_from(data, cloud.row_step * v + cloud.point_step * u)
        if order is not None:
            point = tuple(point[index] for index in order)
        if not (skip_nans and any(map(math.isnan, point))):
            yield point


def read_points_list(
    cloud: Any,
    field_names: Iterable[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[tuple[int, int]] = (),
) -> list[Any]:
    """Return the points as named tuples; arguments as `read_points`."""
    names = [field.name for field in cloud.fields] if field_names is None else list(field_names)
    kind = namedtuple("Point", names)  # type: ignore[misc]  # noqa: PYI024  known only now
    return [kind._make(point) for point in read_points(cloud, names, skip_nans, uvs)]


def create_cloud(header: Any, fields: Sequence[Any], points: Iterable[Iterable[Any]]) -> Any:
    """Return a cloud of one row.

    Args:
        header: Its header.
        fields: The fields of a point, as PointFields.
        points: The values of each point.
    """
    layout = _layout(False, fields)
    packed = [layout.pack(*point) for point in points]
    return PointCloud2(
        header=header,
        height=1,
        width=len(packed),
        is_dense=False,
        is_bigendian=False,
        fields=list(fields),
        point_step=layout.size,
        row_step=layout.size * len(packed),
        data=b"".join(packed),
    )


def create_cloud_xyz32(header: Any, points: Iterable[Iterable[Any]]) -> Any:
    """Return a cloud of x, y and z as float32."""
    fields = [PointField(name, 4 * at, PointField.FLOAT32, 1) for at, name in enumerate("xyz")]
    return create_cloud(header, fields, points)
