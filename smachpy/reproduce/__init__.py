"""Recorded runs are run again: today's code, virtual time, the world as it was recorded.

`world` reads from a recording what the servers, topics and operators did; `play` lets them do it
again around a machine under test; `compare` finds the first difference; `written` writes a test.
Nothing else of the library knows this package, except the command.
"""
