"""The core in C and its compilation; `solver.c_code` keeps the result in the user's cache."""
