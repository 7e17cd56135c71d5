"""Effects on the gas film, its gap and its sleeve."""
