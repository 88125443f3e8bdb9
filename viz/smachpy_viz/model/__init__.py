"""The data that pictures, terminal and page show, without any look."""
