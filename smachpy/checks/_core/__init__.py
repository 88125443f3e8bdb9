"""Deciding what is wrong with a machine: records and facts in, problems out."""
