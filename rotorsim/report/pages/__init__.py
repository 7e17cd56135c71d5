"""HTML pages: runs, experiments, designs, diagnoses, maps, studies, verifications."""
