"""Recorded runs: lists, statistics, comparisons and exports. `smachpy.events.recording` reads them.

listing      one run as a row of a list
statistics   counts and durations over many runs
compare      two versions of a machine, or two sets of its runs, in one drawing
html         one run as a page that opens without a server; `floor` reads its map
mcap, scene  one run as a file for Foxglove
simulate     many runs in virtual time
report       many runs as a page; its charts are in `charts`
cli          `smachpy runs`
simulate_cli `smachpy simulate`
"""
