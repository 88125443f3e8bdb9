"""Missions that survive their process: journals, what they keep, and runners that share them."""
