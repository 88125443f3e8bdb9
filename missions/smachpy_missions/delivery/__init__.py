"""A delivery: through a door, to a person, and back even if something fails."""
