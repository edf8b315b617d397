"""Sculpting a posed surface: the ring a brush touches, what each brush does to it, masks and symmetry."""
