"""Commands of the command line: each chapter registers its own, `app` brings the chapters together."""
