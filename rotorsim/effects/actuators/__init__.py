"""Effects on the piezo actuators."""
