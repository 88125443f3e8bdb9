"""Shows runs in a terminal."""
