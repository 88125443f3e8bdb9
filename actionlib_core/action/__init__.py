"""Action clients and servers: threads and messages around the rules of `goal`."""
