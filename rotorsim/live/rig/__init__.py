"""Live rig without clock and page: plant, settings, controllers, hammer, readings."""
