"""Networks, one file each (torch): a module offers `build(sizes, **network settings) -> Network`.

_captured_sound   What of a sound says how a body moves: the numbers by which captured moments are found again
_decoder          Parts of FaceFormer: its audio encoder and the layers of its decoder
_matched          A body that moves as its person moved: stretches of the captured takes, found again by what
                  is heard
_mixture          Heads that give how likely all poses are, not one pose for a sound, and draw samples: faces
                  and bodies
_network          The interface of all networks, so that training and generating need not know which one it
                  is
_recurrent_steps  Recurrent networks frame by frame in numpy: for single frames PyTorch is nine tenths
                  overhead
_wav2vec2         wav2vec 2.0's speech encoder, read from a folder in Hugging Face's layout
_whisper          Whisper's speech encoder, read from a CTranslate2 file, and the block it shares with
                  wav2vec 2.0
audio2face        Audio2Face: two bidirectional LSTM layers over a window of MFCC for each frame, pooled by
                  attention
faceformer        FaceFormer: an autoregressive transformer; each pose follows from the sound and the poses
                  before it
recurrent         Our own network: whole sentences through a short convolution and LSTM layers
saia              The SAIA reports' network, mended: bidirectional LSTM layers, attention over nearby
                  frames, a dense layer
"""
