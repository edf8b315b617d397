"""Files into the window and out of it: doors, dialogs, recent ones, recovery."""
