"""A fleet: robots that deliver parcels, a coordinator, and docks that they share."""
