"""Topics and services."""
