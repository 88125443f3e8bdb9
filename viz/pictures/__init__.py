"""Static pictures of machines."""
