"""The Record tab: capture, meters, health, takes of today."""
