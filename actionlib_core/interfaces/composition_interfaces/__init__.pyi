# Written by `actionlib interface stubs`; changes are lost.
from . import srv as srv
