"""Sound: files of any kind, rates, levels, speech and pictures of it (numpy).

decode          Sound through FFmpeg: MP3, M4A, the sound of videos, and whatever libsndfile cannot read to
                its end
level           A level meter: peak, loudness, hold and a clip latch in dBFS. Pure
peaks           How loud a sound is, at any zoom: a pyramid of smallest and largest samples, kept once
                made
resample        Sound at another rate or tempo, block by block: a short symmetric filter, and FFmpeg's
                atempo
sound_file      Sound files: WAV, FLAC and OGG by libsndfile, anything else (MP3, M4A, video) by FFmpeg;
                whole, in blocks, or from anywhere
spectrogram     Which pitches a sound holds, at any zoom: a pyramid of columns, measured once and kept on
                the disk
voice_activity  How likely somebody speaks at each moment of a sound: Silero's network, listened once and
                kept
voice_line      Sound from one program of this computer to another without a sound device: blocks with their
                moments
wav_writer      A WAV file that can be read at any moment while it grows: samples are appended, sizes set at
                the end
"""

LINE_PORT = 39549
"""Where the practice performer sends its voice unless another port is asked for."""
