"""The Curate tab: the library, the timeline, trims, offsets and labels."""
