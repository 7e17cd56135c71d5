"""The thesis on the virtual rig: campaign, identification, control, and verdicts on its claims."""
