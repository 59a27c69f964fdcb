"""Live and the programs of a stream on this computer: what presses Live's keys, and OBS. No Qt.

Nothing here listens beyond this computer, and nothing that a page in a browser can send is obeyed.

obs      OBS Studio through its websocket: its sounds, their Sync Offset, and when the stream begins
server   Live's actions over HTTP and OSC, for Stream Deck, Touch Portal and their like
"""
