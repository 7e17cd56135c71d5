"""FMU export of the plant, identified models and control laws: native code that runs without Python."""
