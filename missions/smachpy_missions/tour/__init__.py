"""Tours: waypoints from a file with a task at each, and the program that saves such files."""
