"""One HTML file that shows a result and needs nothing else: no network, no installation."""
