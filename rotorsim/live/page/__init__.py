"""Page of the live rig: controls, views, scenes, tour."""
