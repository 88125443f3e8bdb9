"""A goal's rules, as pure tables: no threads, time, keys or logging."""
