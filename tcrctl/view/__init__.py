"""Live pictures for the Foxglove app, by way of a WebSocket server (extra ``view``).

    tcrctl run --view    log writer thread -- every message, encoded already --> LiveView --> ViewServer --> app
    tcrctl play          log file -- at its own pace or another ----------------> Player ---> ViewServer --> app

The control thread takes no part in it: a live view gets the messages that the log's own thread has made for the
file, and a client that is too slow loses the oldest ones.
"""
