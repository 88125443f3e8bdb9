"""A delivery: through a door, to a person, and back whatever happens."""
