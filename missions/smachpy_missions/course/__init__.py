"""The exercises of a course: a countdown, an action, a service, and commands for a robot."""
