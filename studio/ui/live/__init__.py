"""Live: speak, and the avatar moves now."""
