"""Worker processes that run the cases of a campaign."""
