"""What all rooms use and what uses none of them: checks of arguments, logs, texts of errors."""
