"""Beginning and end of the program, and its log, as in rospy.

Source:
    rospy.core, rospy.client and rospy.names for names, arguments and meaning.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import os
import re
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from actionlib_core import shutdown
from actionlib_core.clock import Deadlock, current_clock
from actionlib_core.exceptions import ActionlibError
from actionlib_core.inputs.yaml_text import load_yaml
from actionlib_core.interfaces.rosgraph_msgs.msg import Log
from actionlib_core.names import check_name
from actionlib_core.node import get_node
from actionlib_core.pubsub.topic import Publisher
from actionlib_core.time import Time
from smachpy.ros1.names.rospy.exceptions import ROSException, ROSInitException
from smachpy.ros1.session import session

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

_MAX_LOGS: Final = 100  # queue of /rosout; beyond, the oldest messages are dropped

DEBUG: Final = 1
INFO: Final = 2
WARN: Final = 4
ERROR: Final = 8
FATAL: Final = 16

_LEVELS: Final = {
    DEBUG: logging.DEBUG,
    INFO: logging.INFO,
    WARN: logging.WARNING,
    ERROR: logging.ERROR,
    FATAL: logging.CRITICAL,
}
_WORDS: Final = {
    logging.DEBUG: "DEBUG",
    logging.INFO: "INFO",
    logging.WARNING: "WARN",
    logging.ERROR: "ERROR",
    logging.CRITICAL: "FATAL",
}

# -- beginning and end -----------------------------------------------------------------------------


def init_node(
    name: str,
    argv: Sequence[str] | None = None,
    anonymous: bool = False,
    log_level: int | None = None,
    disable_rostime: bool = False,
    disable_rosout: bool = False,
    disable_signals: bool = False,
    xmlrpc_port: int = 0,
    tcpros_port: int = 0,
) -> None:
    """Name the program on the network.

    Args:
        name: One word.
        argv: Its arguments; None: those of the program.
        anonymous: Make the name unique by adding numbers.
        log_level: The lowest level that is logged, for example `rospy.DEBUG`.
        disable_rostime: Ignored.
        disable_rosout: Do not publish the log on /rosout.
        disable_signals: Leave Ctrl-C and SIGTERM to the program.
        xmlrpc_port: Ignored.
        tcpros_port: Ignored.

    Raises:
        ROSInitException: the name is invalid, or the network cannot be joined.
        ROSException: called again with another name.
    """
    del disable_rostime, xmlrpc_port, tcpros_port
    if not name or not isinstance(name, str):
        raise ValueError(f"init_node: name: got {name!r}; expected a word.")
    try:
        name = check_name(name, "node name")
    except ActionlibError as error:
        raise ROSInitException(str(error)) from error
    if log_level is not None:
        logger.setLevel(_LEVELS.get(log_level, log_level))
    now = session()
    if now.name:
        if not anonymous and _base(now.name) != name:
            raise ROSException(
                "rospy.init_node() has already been called with different arguments: got "
                f"{name!r}; expected {now.name!r}."
            )
        return
    full = f"{name}_{os.getpid()}_{_count()}" if anonymous else name
    try:
        now.begin_node(full)
    except ActionlibError as error:
        raise ROSInitException(str(error)) from error
    _set_private_parameters(now.argv if argv is None else argv)
    shutdown.on_shutdown(lambda: now.run_hooks("shutdown"))
    if not (disable_rosout or now.dry):
        now.rosout = Publisher("/rosout", Log, queue_size=_MAX_LOGS)
    if not disable_signals:
        now.handle_signals()


def _base(name: str) -> str:
    return re.sub(r"_\d+_\d+$", "", name)


_numbers = itertools.count(1000 * 1000)


def _count() -> int:
    return next(_numbers)


def _set_private_parameters(argv: Sequence[str]) -> None:
    """Set the parameters `_name:=value` of the command line; values are YAML, as in ROS."""
    from smachpy.ros1.names.rospy.names import resolve_name

    for word in argv:
        key, _, value = (part.strip() for part in word.partition(":="))
        if value and re.match("_[^_]", key):  # as in rospy: "_name:=" sets nothing
            try:
                parsed = load_yaml(value)
            except ValueError:
                parsed = value
            session().parameters.set(resolve_name(f"~{key[1:]}"), parsed)


def is_initialized() -> bool:
    """Return whether `init_node` was called."""
    return bool(session().name)


def is_shutdown() -> bool:
    """Return whether the program is to end."""
    now = session()
    if now.dry and now.stopped is None:
        now.check_time()
    return now.is_shutdown()


is_shutdown_requested = is_shutdown


def signal_shutdown(reason: Any = "") -> None:
    """Ask the program to end: machines are preempted, and waits in rospy end.

    The functions given to `on_shutdown` are called before this returns.
    """
    now = session()
    if now.dry:
        now.stop()
    logger.debug("signal_shutdown [%s]", reason)
    now.run_hooks(str(reason))
    shutdown.request(str(reason) or "signal_shutdown")


def on_shutdown(h: Callable[..., object]) -> None:
    """Call `h` once, when the program is asked to end or at its end.

    Raises:
        TypeError: `h` is not callable.
    """
    if not callable(h):
        raise TypeError(f"on_shutdown: got {h!r}; expected a function without arguments.")
    add_shutdown_hook(lambda _reason: h())


def add_shutdown_hook(h: Callable[[str], object]) -> None:
    """Call `h(reason)` once, when the program is asked to end or at its end."""

    def call(reason: str) -> None:
        try:
            h(reason)
        except Exception:  # the other hooks have to run as well
            logger.exception("on_shutdown: %r raised", h)

    session().add_hook(call)


add_preshutdown_hook = add_shutdown_hook
add_client_shutdown_hook = on_shutdown


def spin() -> None:
    """Wait until the program is to end.

    Raises:
        ROSInitException: `init_node` was not called.

    Blocks: until then. In virtual time also until nothing can happen any more.
    """
    now = session()
    now.settle()  # another thread may be about to execute the machine
    now.stop()
    if not now.name:
        raise ROSInitException("client code must call rospy.init_node() first")
    try:
        shutdown.event().wait()
    except KeyboardInterrupt:
        signal_shutdown("keyboard interrupt")
    except Deadlock:
        signal_shutdown("nothing can happen any more")


def myargv(argv: list[str] | None = None) -> list[str]:
    """Return the arguments without remappings (`a:=b`)."""
    return [word for word in (sys.argv if argv is None else argv) if ":=" not in word]


def get_node_uri() -> str:
    """Return an address of the node; no XML-RPC server runs there."""
    return f"zenoh://{get_node().full_name}"


def get_ros_root(required: bool = False, env: Any = None) -> None:
    """Return None: there is no ROS installation."""
    del required, env


def configure_logging(node_name: str, level: int = INFO) -> None:
    """Do nothing: logging needs no configuration."""
    del node_name, level


# -- log -------------------------------------------------------------------------------------------


class _Handler(logging.Handler):
    """Writes like rospy: DEBUG and INFO to the standard output, the rest to the error output."""

    def emit(self, record: logging.LogRecord) -> None:
        try:
            seconds = current_clock().time_ns() / 1e9
            word = _WORDS.get(record.levelno, record.levelname)
            text = f"[{word}] [{seconds:.6f}]: {self.format(record)}\n"
            stream = sys.stdout if record.levelno <= logging.INFO else sys.stderr
            stream.write(text)
            stream.flush()
        except Exception:  # noqa: BLE001  the rule for handlers of `logging`
            self.handleError(record)


logger = logging.getLogger("rosout")
if not logger.handlers:
    logger.addHandler(_Handler())
    logger.propagate = False
    logger.setLevel(logging.INFO)
"""The logger of all messages; programs that use `logging` may get it by its name."""


def _text(msg: Any, args: Any) -> str:
    if not args:
        return str(msg)
    if len(args) == 1 and isinstance(args[0], Mapping) and args[0]:  # as `logging` does
        args = args[0]
    try:
        text: str = str(msg) % args
    except (TypeError, ValueError, KeyError):  # a log line must not end a mission
        return f"{msg} {args}"
    return text


def _place() -> tuple[str, int]:
    """Return file and line of the logging call in the program."""
    frame = sys._getframe(1)
    while frame.f_code.co_filename == __file__ and frame.f_back is not None:
        frame = frame.f_back
    return frame.f_code.co_filename, frame.f_lineno


def _log(level: int, msg: Any, args: tuple[Any, ...], logger_name: str | None) -> None:
    where = logger if not logger_name else logging.getLogger(f"rosout.{logger_name}")
    if not session().dry and where.isEnabledFor(level):
        text = _text(msg, args)
        where.log(level, "%s", text)
        _publish(level, text)


def _publish(level: int, text: str) -> None:
    """Publish a log message on /rosout, if there is a node."""
    publisher = session().rosout
    if publisher is None:
        return
    file, line = _place()
    own = next((ours for ours, theirs in _LEVELS.items() if theirs == level), INFO)
    message = Log(level=own, name=f"/{session().name}", msg=text, file=file, line=line)
    message.header.stamp = Time.now()
    with contextlib.suppress(ActionlibError):  # the node is closed, or the types differ
        publisher.publish(message)


def _functions(level: int) -> tuple[Callable[..., None], ...]:
    """Return the four functions of a level: log, throttle, throttle_identical, once."""

    def log(msg: Any, *args: Any, logger_name: str | None = None, **_kwargs: Any) -> None:
        """Log `msg % args`; other keyword arguments of rospy are ignored."""
        _log(level, msg, args, logger_name)

    def throttle(period: float, msg: Any, *args: Any, logger_name: str | None = None) -> None:
        """Log a message from this line of the program at most once per `period` [s]."""
        key = (level, *_place())
        now, logged = current_clock().now(), session().logged
        if key not in logged or not 0 <= now - logged[key] < float(period):
            logged[key] = now
            _log(level, msg, args, logger_name)

    def throttle_identical(
        period: float, msg: Any, *args: Any, logger_name: str | None = None
    ) -> None:
        """Log as `throttle`, but a different text at once."""
        key = (level, "identical", *_place())
        now, text = current_clock().now(), _text(msg, args)
        logged = session().logged
        before = logged.get(key)
        if before is None or before[1] != text or not 0 <= now - before[0] < float(period):
            logged[key] = now, text
            _log(level, text, (), logger_name)

    def once(msg: Any, *args: Any, logger_name: str | None = None) -> None:
        """Log a message from this line of the program only the first time."""
        key = (level, "once", *_place())
        logged = session().logged
        if key not in logged:
            logged[key] = True
            _log(level, msg, args, logger_name)

    return log, throttle, throttle_identical, once


logdebug, logdebug_throttle, logdebug_throttle_identical, logdebug_once = _functions(logging.DEBUG)
loginfo, loginfo_throttle, loginfo_throttle_identical, loginfo_once = _functions(logging.INFO)
logwarn, logwarn_throttle, logwarn_throttle_identical, logwarn_once = _functions(logging.WARNING)
logerr, logerr_throttle, logerr_throttle_identical, logerr_once = _functions(logging.ERROR)
logfatal, logfatal_throttle, logfatal_throttle_identical, logfatal_once = _functions(
    logging.CRITICAL
)
logout = loginfo
rospydebug, rospyinfo, rospywarn, rospyerr = logdebug, loginfo, logwarn, logerr
logerror = logerr
