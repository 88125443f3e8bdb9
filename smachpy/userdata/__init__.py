"""Userdata: keys, remapping, read-only views, typed values."""
