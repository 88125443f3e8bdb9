"""What the commands `smachpy` and `actionlib` share: numbers and options of the command line."""
