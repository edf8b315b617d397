"""The craft of matchmoving in the window: the plate, its tracks, and following them."""
