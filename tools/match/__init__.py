"""Tools of matchmoving in the plate."""
