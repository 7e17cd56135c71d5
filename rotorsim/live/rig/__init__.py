"""Live rig without a page: plant, settings, controllers, samples, modes, records, frames, the thread that paces it."""
