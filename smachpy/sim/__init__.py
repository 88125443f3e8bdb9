"""A simulated robot on an occupancy map, behind a `move_base` action server."""
