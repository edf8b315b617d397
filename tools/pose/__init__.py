"""What a hand does to a posed mesh: its pose, the sculpts at poses, masks and skin weights."""
