"""Numbers a model can eat: sound as rows, motion as columns, and both cut to the same frames (no torch).

audio             Sound as rows of numbers: log-mel bands, MFCC or what a speech encoder gives, each at an
                  exact place
audio_spec        Which numbers describe the sound: kind and size of a row, where each row lies, and the mel
                  bands
encoder_download  A wav2vec 2.0 from Hugging Face's hub: which files it offers, and where they go
encoders          Pretrained speech encoders: those installed, loading one, and the features it gives
examples          Training examples: rows of sound and columns of motion of a take on one frame grid, and
                  varied crops of them
motion            Motion as columns of numbers: which channels are learnt, how they are scaled, which are
                  carried through
streaming_encoder Whisper's first blocks as a stream: what speech they hear is known a fifth of a second later
"""
