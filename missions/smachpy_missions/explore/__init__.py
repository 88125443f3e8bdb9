"""Exploring: drive to where the seen floor ends until all of it is on the map."""
