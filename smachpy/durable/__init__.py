"""Durable missions: journals, the values that they keep, and runners that share a store."""
