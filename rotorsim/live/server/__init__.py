"""Local web server of the live rig: start and end, access control, messages."""
