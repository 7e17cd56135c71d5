"""Campaign plans: axes, cases, targets of the axes."""
