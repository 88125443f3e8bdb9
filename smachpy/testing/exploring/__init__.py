"""Exploration: many runs of one machine, with different outcomes, preempts and interleavings."""
