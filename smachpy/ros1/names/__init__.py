"""Modules under the names that programs for ROS 1 import: `rospy` is `smachpy.ros1.names.rospy`."""
