"""What a hand does to a groom: one file per tool, found by the registry."""
