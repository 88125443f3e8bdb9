"""rosunit: run a test case."""

from smachpy.ros1.names.rostest import unitrun
