"""Self-contained HTML pages of results, which need neither network nor installation."""
