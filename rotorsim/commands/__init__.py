"""Commands of the command line, one module each; heavy imports are deferred until a command runs."""
