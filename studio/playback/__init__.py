"""Motion and sound against one clock."""
