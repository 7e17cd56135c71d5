"""Effects on shaft, drive and foundation."""
