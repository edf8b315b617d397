"""What a hand does to feathers: one file per tool, found by the registry."""
