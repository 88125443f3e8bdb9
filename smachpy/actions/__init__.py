"""The states that call actions and services and watch topics; a machine as an action server."""
