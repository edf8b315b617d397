"""Fields of panels: one widget for each kind of value, all alike under the hand."""
