"""Missions to run, read and copy from; README.md beside this file says in which order.

`smachpy list` names them, `smachpy run NAME` runs one. Nothing imports this package.
"""
