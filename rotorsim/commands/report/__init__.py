"""Commands of the group `report`: pages of stored results, written again."""
