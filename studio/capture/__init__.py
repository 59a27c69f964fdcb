"""Packets and audio blocks in, under one clock."""
