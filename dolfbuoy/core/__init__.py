"""The core in C, and how it is compiled; `solver.c_code` keeps what is compiled in the cache of the user."""
