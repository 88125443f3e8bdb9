"""SMACH's public names, and the others that `from smach import *` gives in the original."""

from smachpy import exceptions
from smachpy.base import log
from smachpy.base.log import logdebug, logerr, loginfo, logwarn, set_loggers
from smachpy.exceptions import (
    InvalidConstructionError,
    InvalidStateError,
    InvalidTransitionError,
    InvalidUserCodeError,
    SmachError,
)
from smachpy.machines import concurrence, container, iterator, state, state_machine, util
from smachpy.machines import state_machine as sequence
from smachpy.machines.concurrence import Concurrence
from smachpy.machines.container import Container
from smachpy.machines.iterator import Iterator
from smachpy.machines.state import CBState, State
from smachpy.machines.state_machine import Sequence, StateMachine
from smachpy.machines.util import (
    CBInterface,
    cb_interface,
    has_smach_interface,
    is_shutdown,
    set_shutdown_check,
)
from smachpy.userdata import user_data
from smachpy.userdata.user_data import Const, Remapper, UserData, get_const
