"""Run-time kernel of a law: one sample of the controller, allocation-free, on one flat memory."""
