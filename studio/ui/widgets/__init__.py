"""Pieces that several tabs draw with."""
