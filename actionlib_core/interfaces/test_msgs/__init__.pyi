# Written by `actionlib interface stubs`; changes are lost.
from . import action as action
