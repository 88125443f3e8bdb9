"""The rules of the action protocol as pure functions of state and event.

Nothing here knows threads, time, logging, keys or encodings: time comes in as an argument, and what
is to be done goes out as data. The shells around it are `action_client` and `action_server`.
"""
