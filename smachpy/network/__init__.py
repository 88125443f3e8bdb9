"""A running machine on the network: its structure, events, values and commands."""
