"""VMC and its kin over UDP: datagrams in, frames out, and poses to programs. Pure but for the sockets.

Inwards a datagram passes `udp`, `senders`, `osc`, `decode`, `stream`, `assemble` and `rows`, in this order;
outwards a pose passes `encode` and `sender`, which leaves at the `pace` it is given.

address   Where a program listens for motion: one target of those that a person keeps. Pure
assemble  Assembles VMC datagrams into frames: finds their ends, merges senders, holds last values. Pure
decode    Decodes one message: a VMC message's kind, name and values, or a phone's whole face. Pure
encode    Encodes poses as VMC datagrams; `assemble` does the reverse. Pure
openseeface  OpenSeeFace's packets: what its face tracker sends to UDP 11573. Pure
pace      When frames are due: on an even beat, or as soon as each pose is made and evenly between two
osc       One UDP datagram taken apart into OSC messages. Pure, and safe against anything that arrives
rows      Frames as flat rows of numbers in blocks, and blocks as a Motion
sender    Sends motion to a VMC program over UDP, in time with the sound
senders   Fair queues of datagrams, one for each sender, so that none can starve another. Pure
stream    Senders and their streams of VMC messages: who sends, and where a frame of it begins and ends.
          Pure
udp       UDP datagrams with their arrival times: ports with room to wait in, stamped by the kernel where it
          can
vtube_studio  VTube Studio's packets: what its app on a phone sends for some seconds to whoever asks it.
          Pure
watch     Statistics of frames: rate, jitter, losses, and whether anything moves. Pure
"""

# Here, where importing costs nothing: settings and every command's help name a port.
MARIONETTE_PORT, PERFORMER_PORT = 39539, 39540
"""Where avatars listen, the studio too unless told otherwise, and where programs listen that pass motion on.
Source: the VMC protocol."""
