"""Page of the live rig: controls and views."""
