"""A face in pictures, as motion: a webcam or any video in place of a tracker (no Qt, no torch).

Pictures pass `landmarker` (points and weights of a face), `face` (channels of an avatar) and `smoothing`, in
this order; `video` works through a file, `webcam` through a camera that runs.

camera      Cameras: which there are, and their pictures with the moments they were taken; a video as one
choice      Which of several faces is the one, followed through the pictures to both sides
face        A tracked face as channels: ARKit's shapes, VRM's vowels, and the head's turn shared out
face_model  The face model's file and MediaPipe, which reads it: what is missing, and how it is fetched
landmarker  MediaPipe's Face Landmarker: the faces in a picture, and the rigid part of one
mouth       Whether a mouth can be seen, or a hand, a microphone or a scarf is before it
pictures    What a picture tells besides its faces: light, sharpness, cuts, and hints for a better one
raw         Faces of a video as they were tracked, in blocks that survive a break
smoothing   The One-Euro filter, which leaves closures and blinks as quick as they are
video       A video file tracked: its motion on the clock of its sound, and the spans that are of no use
video_file  A video file read: its pictures with their times, one at any moment, and when its sound begins
webcam      A camera at work: tracks its pictures and sends them as one more VMC sender
"""

# Here, where importing costs nothing: the window sorts what is dropped before anybody needs numpy.
VIDEO_SUFFIXES = frozenset({".mp4", ".mov", ".mkv", ".webm", ".m4v", ".avi"})
"""Of files that may hold pictures."""
