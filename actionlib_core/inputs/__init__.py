"""What comes from outside, read and checked: arguments, files, JSON, YAML, expressions."""
