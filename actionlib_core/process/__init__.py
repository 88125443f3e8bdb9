"""The standard streams and the private files of a program."""
