"""The missions of a course: a countdown, an action, a service, and a robot by commands."""
