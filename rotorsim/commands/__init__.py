"""Commands of the command line, one module each; `app.py` names them, and each is imported when it runs."""
