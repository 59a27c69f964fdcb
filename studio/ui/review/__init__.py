"""The Review tab: predicted and captured motion in time with sound, sending, exporting."""
