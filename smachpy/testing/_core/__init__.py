"""Deciding which runs to try: choices in, the next choices out."""
