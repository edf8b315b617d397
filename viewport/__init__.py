"""Draws meshes, coats and guides from a camera into a framebuffer with OpenGL 3.3 core. Never Qt, never tools."""
