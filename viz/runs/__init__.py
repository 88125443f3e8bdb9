"""Recorded runs: one file of events each, to be shown again, counted and compared.

recording    writes and reads the files
statistics   what many runs add up to, and how two differ
mcap         the same run for other tools
cli          `smachpy runs`
"""
