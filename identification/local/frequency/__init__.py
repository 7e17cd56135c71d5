"""Grey-box models from measured frequency responses."""
