"""Decisions of state machines without threads, time or input and output."""
