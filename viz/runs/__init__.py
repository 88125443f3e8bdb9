"""Recorded runs: one file of events each, to be shown again, counted and compared.

recording    writes and reads the files
statistics   what many runs add up to, and how two differ
mcap, scene  the same run for other tools
simulate     many runs in virtual time
report       what many runs add up to, as a page; its charts in `charts`
cli          `smachpy runs`
"""
