"""The craft of posing in the window: poses, controls, the map of pose space, fields on the model."""
