"""The Train tab: data, presets, curves, runs."""
