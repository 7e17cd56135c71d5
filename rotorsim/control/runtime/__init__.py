"""What a law does in a sample: one allocation-free kernel on one flat memory."""
