"""rospy's public names over `actionlib_core`: nodes, topics, services, parameters, time, log.

Source:
    https://docs.ros.org/en/noetic/api/rospy/html/ for names, arguments and exceptions.
"""

from actionlib_core.interfaces import Message
from actionlib_core.interfaces.std_msgs.msg import Header
from smachpy.ros1.names.rospy import (
    client,
    core,
    exceptions,
    msg,
    names,
    rostime,
    service,
    timer,
    topics,
)
from smachpy.ros1.names.rospy.client import (
    delete_param,
    get_master,
    get_param,
    get_param_cached,
    get_param_names,
    get_published_topics,
    has_param,
    search_param,
    set_param,
    wait_for_message,
    wait_for_service,
)
from smachpy.ros1.names.rospy.core import (
    DEBUG,
    ERROR,
    FATAL,
    INFO,
    WARN,
    get_node_uri,
    get_ros_root,
    init_node,
    is_shutdown,
    is_shutdown_requested,
    logdebug,
    logdebug_once,
    logdebug_throttle,
    logdebug_throttle_identical,
    logerr,
    logerr_once,
    logerr_throttle,
    logerr_throttle_identical,
    logerror,
    logfatal,
    logfatal_once,
    logfatal_throttle,
    logfatal_throttle_identical,
    loginfo,
    loginfo_once,
    loginfo_throttle,
    loginfo_throttle_identical,
    logout,
    logwarn,
    logwarn_once,
    logwarn_throttle,
    logwarn_throttle_identical,
    myargv,
    on_shutdown,
    signal_shutdown,
    spin,
)
from smachpy.ros1.names.rospy.exceptions import (
    ROSException,
    ROSInitException,
    ROSInternalException,
    ROSInterruptException,
    ROSSerializationException,
    ROSTimeMovedBackwardsException,
    ServiceException,
    TransportException,
    TransportInitError,
    TransportTerminated,
)
from smachpy.ros1.names.rospy.msg import AnyMsg
from smachpy.ros1.names.rospy.names import (
    get_caller_id,
    get_name,
    get_namespace,
    remap_name,
    resolve_name,
)
from smachpy.ros1.names.rospy.rostime import (
    Duration,
    Rate,
    Time,
    Timer,
    get_rostime,
    get_time,
    sleep,
)
from smachpy.ros1.names.rospy.service import Service, ServiceProxy
from smachpy.ros1.names.rospy.topics import Publisher, SubscribeListener, Subscriber

logwarning = logwarn
