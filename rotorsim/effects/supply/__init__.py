"""Effects on the gas supply and the injectors."""
