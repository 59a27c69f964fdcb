"""A performer as a picture: a stick figure or an avatar in a room, off screen. Pixels, no Qt."""
