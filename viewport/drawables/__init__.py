"""One file per kind of thing that is drawn; each keeps its buffers on the graphics card."""
