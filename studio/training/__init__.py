"""From takes to weights: recipes and events (no torch), the loop, losses, metrics and checkpoints (torch)."""
