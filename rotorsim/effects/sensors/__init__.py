"""Effects on the sensors and their signals."""
