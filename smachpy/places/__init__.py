"""Places of a robot, and what is read of them from files: poses, maps, parameters of robots."""
