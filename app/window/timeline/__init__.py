"""Time: the ruler, playing, and the curves of keyed values."""
