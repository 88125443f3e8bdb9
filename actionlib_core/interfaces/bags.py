"""Bags: reads those of rosbag1, rosbag2 and MCAP, and writes MCAP, through `rosbags` and `mcap`.

Messages that are read are converted to the message classes of this library by the names of their
fields, so a bag of ROS 2 gives messages of ROS 1's types, as missions use them.
"""

from __future__ import annotations

import contextlib
import os
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actionlib_core.exceptions import ActionlibError
from actionlib_core.interfaces import get_message

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from typing import Self


MCAP: Final = b"\x89MCAP0\r\n"
"""The first and the last bytes of an MCAP file."""


class BagError(ActionlibError):
    """A bag cannot be read or written.

    Try: check the path; a bag is a `.bag` or `.mcap` file, or a folder of rosbag2.

    Attributes:
        path: The file or folder.
    """

    def __init__(self, path: Path, problem: str) -> None:
        self.path = path
        super().__init__(f"bag {str(path)!r}: {problem}")


class BagMessage(NamedTuple):
    """A message of a bag.

    Attributes:
        at: When it was recorded, after the first message [s].
        topic: Its topic without a slash in front.
        type: Its type, "sensor_msgs/BatteryState".
        message: The message.
    """

    at: float
    topic: str
    type: str
    message: Any


def read_bag(path: str | Path, topics: Collection[str] | None = None) -> Iterator[BagMessage]:
    """Yield the messages of a bag in order.

    Args:
        path: A file of rosbag1 (.bag) or MCAP (.mcap), or a folder of rosbag2.
        topics: Only these; None: all whose types are known here.

    Raises:
        BagError: it cannot be read; a package is missing; a topic in `topics` has a type that is
            not known here.
    """
    path = Path(path)
    if not path.exists():
        raise BagError(path, "no such file or folder; expected .bag, .mcap or a folder of rosbag2.")
    wanted = None if topics is None else {topic.strip("/") for topic in topics}
    source = _mcap if path.suffix == ".mcap" and path.is_file() else _rosbags
    first: int | None = None
    try:
        for stamp_ns, topic, type_name, make in source(path):
            first = stamp_ns if first is None else first
            name = topic.strip("/")
            if wanted is not None and name not in wanted:
                continue
            try:
                kind = get_message(type_name.replace("/msg/", "/"))
            except ActionlibError as error:
                if wanted is None:
                    continue
                raise BagError(path, f"topic {name!r}: {error}") from error
            yield BagMessage((stamp_ns - first) / 1e9, name, kind._type, make(kind))
    except BagError:
        raise
    except ActionlibError as error:
        raise BagError(path, f"topic {name!r}: {error}") from error
    except ImportError as error:
        raise BagError(path, f"{error}. Try: pip install 'smachpy[cdr,mcap]'") from error
    except Exception as error:  # of many kinds: those of two packages and of what they use
        raise BagError(path, f"cannot be read: {type(error).__name__}: {error}") from error


class BagWriter:
    """Writes messages of ROS 1 and ROS 2 to a new MCAP file; a context manager.

    Args:
        path: The file, whose folder is made if there is none. A file that exists is never changed.

    Raises:
        BagError: the file exists or cannot be made, or the package is missing.

    Threads: one at a time.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        try:
            from mcap.writer import Writer
        except ImportError as error:
            raise BagError(self._path, f"{error}. Try: pip install 'smachpy[mcap]'") from error
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._path.open("xb")
        except OSError as error:
            raise BagError(self._path, f"cannot be made: {error.strerror or error}.") from error
        self._writer: Any = Writer(self._file)
        self._channels: dict[tuple[str, str, str], int] = {}
        self._begin()

    def _begin(self) -> None:
        try:
            self._writer.start()
        except OSError as error:
            self._file.close()
            raise self._failure(error) from error

    def write(self, topic: str, kind: type[Any], data: bytes, stamp_ns: int) -> None:
        """Append a message.

        Args:
            topic: Its topic.
            kind: Its class.
            data: Its bytes: those of `to_bytes` of ROS 1's classes, of `to_cdr` of ROS 2's.
            stamp_ns: When it came [ns since the epoch].

        Raises:
            BagError: the file cannot be written.
        """
        name, ros2 = kind._type, kind._wire == "ros2"
        key = f"/{topic.strip('/')}", name, kind._full_text
        try:
            if key not in self._channels:
                text = kind._full_text.encode()
                schema = self._writer.register_schema(name, "ros2msg" if ros2 else "ros1msg", text)
                encoding = "cdr" if ros2 else "ros1"
                self._channels[key] = self._writer.register_channel(key[0], encoding, schema)
            self._writer.add_message(self._channels[key], stamp_ns, data, stamp_ns)
        except OSError as error:
            raise self._failure(error) from error

    def close(self) -> None:
        """Complete the file; a second call does nothing.

        Raises:
            BagError: it cannot be written.
        """
        if self._file.closed:
            return
        try:
            self._writer.finish()
            self._file.flush()
        except OSError as error:
            raise self._failure(error) from error
        finally:
            with contextlib.suppress(OSError):  # what it could not write is told above
                self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _failure(self, error: OSError) -> BagError:
        return BagError(self._path, f"cannot be written: {error.strerror or error}.")


def _mcap(path: Path) -> Iterator[tuple[int, str, str, Any]]:
    """Yield stamp [ns], topic, type and a function that makes the message."""
    from mcap.reader import make_reader

    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - len(MCAP)))
        if size < 2 * len(MCAP) or file.read() != MCAP:
            raise BagError(path, "is cut off, or no MCAP file. Try: mcap recover FILE -o NEW_FILE")
        file.seek(0)
        store_of = cache(_store)
        for schema, channel, message in make_reader(file).iter_messages():
            if schema is None:
                continue
            if channel.message_encoding == "ros1":
                data = message.data
                yield (
                    message.log_time,
                    channel.topic,
                    schema.name,
                    lambda kind, d=data: kind.from_bytes(d),
                )
            elif channel.message_encoding == "cdr":
                yield (
                    message.log_time,
                    channel.topic,
                    schema.name,
                    # Read only when it is wanted: the schema of another topic may be unreadable.
                    lambda kind, one=schema, d=message.data: _filled(
                        kind, store_of(one.name, one.data).deserialize_cdr(d, one.name)
                    ),
                )


def _store(name: str, text: bytes) -> Any:
    """Return what reads messages of a type, as its schema describes it."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text.decode(), name))
    return store


def _rosbags(path: Path) -> Iterator[tuple[int, str, str, Any]]:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
        for connection, stamp_ns, data in reader.messages():
            yield (
                stamp_ns,
                connection.topic,
                connection.msgtype,
                lambda kind, d=data, t=connection.msgtype: _filled(kind, reader.deserialize(d, t)),
            )


def _filled(kind: Any, made: Any) -> Any:
    """Return a message of our class with the fields that both have."""
    return kind.from_dict(_known(_plain(made), kind()))


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        return {one.name: _plain(getattr(value, one.name)) for one in fields(value)}
    if hasattr(value, "tolist"):
        return value.tolist()
    return [_plain(one) for one in value] if isinstance(value, list | tuple) else value


def _known(values: dict[str, Any], example: Any) -> dict[str, Any]:
    """Leave out what ROS 1 does not have; its times are named otherwise."""
    found: dict[str, Any] = {}
    for name, value in values.items():
        if name not in example.__slots__:
            continue
        inner = getattr(example, name)
        if isinstance(value, dict) and {"sec", "nanosec"} <= value.keys():
            found[name] = {"secs": value["sec"], "nsecs": value["nanosec"]}
        elif isinstance(value, dict) and hasattr(inner, "__slots__") and hasattr(inner, "_type"):
            found[name] = _known(value, inner)
        else:
            found[name] = [_timed(one) for one in value] if isinstance(value, list) else value
    return found


def _timed(value: Any) -> Any:
    """Rename the times inside a list of messages."""
    if not isinstance(value, dict):
        return value
    if value.keys() == {"sec", "nanosec"}:
        return {"secs": value["sec"], "nsecs": value["nanosec"]}
    return {
        key: [_timed(one) for one in item] if isinstance(item, list) else _timed(item)
        for key, item in value.items()
        if not key.startswith("__")
    }
