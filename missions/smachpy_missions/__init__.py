"""Missions to run, read and copy from; README.md beside this file gives the reading order.

`smachpy list` lists them, `smachpy run NAME` runs one. Nothing else imports this package.
"""
