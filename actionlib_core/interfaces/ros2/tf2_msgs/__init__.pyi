# Written by `actionlib interface stubs`; changes are lost.
from . import msg as msg
from . import srv as srv
from . import action as action
