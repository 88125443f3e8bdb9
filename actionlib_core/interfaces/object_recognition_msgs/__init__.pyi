# Written by `actionlib interface stubs`; changes are lost.
from . import msg as msg
