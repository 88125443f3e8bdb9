"""rospy's exceptions, and the translation of this package's errors to them."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from actionlib_core.exceptions import (
    ActionlibError,
    FieldError,
    NodeError,
    ServiceLostError,
    ServiceUnavailableError,
    WaitTimeoutError,
)
from actionlib_core.exceptions import (
    ServiceException as _ServiceError,
)
from smachpy.engine.interrupt import ProgramEnds
from smachpy.ros1.session import session

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = [
    "ROSException",
    "ROSInitException",
    "ROSInternalException",
    "ROSInterruptException",
    "ROSSerializationException",
    "ROSTimeMovedBackwardsException",
    "ServiceException",
    "TransportException",
    "TransportInitError",
    "TransportTerminated",
]


class ROSException(Exception):  # noqa: N818  rospy's names, all of them
    """Base of rospy's exceptions."""


class ROSInterruptException(ROSException, ProgramEnds, KeyboardInterrupt):
    """The program is to end while it sleeps or waits.

    As in rospy it is both a `ROSException` and a `KeyboardInterrupt`: `except Exception` catches it
    as well as `except KeyboardInterrupt`.
    """


class ROSInitException(ROSException):
    """`init_node` was not called, or failed."""


class ROSSerializationException(ROSException):
    """A value of a message does not fit its field."""


class ROSTimeMovedBackwardsException(ROSInterruptException):
    """Simulated time jumped back; never raised here.

    Attributes:
        time: By how much [s].
    """

    def __init__(self, time: float = 0.0) -> None:
        self.time = time
        super().__init__(f"ROS time moved backwards: {time} s")


class ROSInternalException(Exception):  # noqa: N818
    """Base of rospy's internal exceptions."""


class TransportException(ROSInternalException):
    """The network failed."""


class TransportTerminated(TransportException):
    """The connection was closed."""


class TransportInitError(TransportException):
    """The connection could not be made."""


class ServiceException(Exception):  # noqa: N818
    """A service call failed; the reason is its `__cause__`."""


@contextlib.contextmanager
def as_rospy(waits_for: str = "") -> Iterator[None]:
    """Raise rospy's exceptions instead of this package's.

    Their texts begin as rospy's do, because programs look for words in them.

    Args:
        waits_for: What is waited for, as in rospy's text: "message on topic scan".
    """
    try:
        yield
    except _ServiceError as error:
        raise ServiceException(_as_rospy_says(error)) from error
    except FieldError as error:
        raise ROSSerializationException(str(error)) from error
    except (NodeError, WaitTimeoutError) as error:
        if session().is_shutdown():
            raise ROSInterruptException("rospy shutdown") from error
        late = waits_for and isinstance(error, WaitTimeoutError)
        begin = f"timeout exceeded while waiting for {waits_for}: " if late else ""
        raise ROSException(f"{begin}{error}") from error
    except ActionlibError as error:
        raise ROSException(str(error)) from error


def _as_rospy_says(error: _ServiceError) -> str:
    name = f"service [/{error.name}]"
    if isinstance(error, ServiceUnavailableError):
        return f"{name} unavailable: {error.reason}"
    if isinstance(error, ServiceLostError):
        return f"transport error completing service call: {error}"
    if error.remote_type:
        return f"{name} responded with an error: error processing request: {error.remote_text}"
    return f"{name} responded with an error: {error.reason}"
