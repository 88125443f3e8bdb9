"""Missions to run, read and copy from, and the simulated robot they drive.

`smachpy list` names them, `smachpy run NAME` runs one.
"""
