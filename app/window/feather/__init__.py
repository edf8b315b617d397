"""The editor of the feather: its flat form, how it looks, its dials and every attribute."""
