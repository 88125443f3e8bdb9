"""A simulated robot on an occupancy map, with a `move_base` action server."""
