"""Exploration: many runs of one machine, with other results, preempts and interleavings."""
