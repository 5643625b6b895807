"""Rest: closed forms, Newton, continuation."""
