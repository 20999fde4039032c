"""A client of the Foxglove WebSocket protocol, written from its specification: the other end of the server."""

from __future__ import annotations

import hashlib
import json
import struct
import threading
import time
from contextlib import ExitStack, suppress

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

SUBPROTOCOL = "foxglove.sdk.v1"
STATUS = ("Playing", "Paused", "Buffering", "Ended")


def digest(content):
    """Short, so that a failing comparison can be read."""
    return hashlib.sha256(content).hexdigest()[:12]


class ViewerClient:
    """Connects, subscribes, and collects what comes."""

    def __init__(self, url):
        self._open = ExitStack()
        self._socket = self._open.enter_context(connect(url, subprotocols=[SUBPROTOCOL], max_size=None))
        self.info, self.channels = {}, {}
        self.messages, self.states = [], []
        self._topics = {}
        self._thread = threading.Thread(target=self._collect, daemon=True)
        self._thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._open.close()
        self._thread.join(5)

    def subscribe(self, *topics, count=None):
        """Subscribe to topics, of all that are advertised if none is given."""
        self.wait(lambda: self.info and len(self.channels) >= (count or max(1, len(topics))))
        wanted = topics or tuple(self.channels)
        self.wait(lambda: set(wanted) <= set(self.channels))
        pairs = []
        for topic in wanted:
            self._topics[len(self._topics) + 1] = topic
            pairs.append({"id": len(self._topics), "channelId": self.channels[topic]["id"]})
        self._socket.send(json.dumps({"op": "subscribe", "subscriptions": pairs}))

    def control(self, *, play, rate=1.0, seek=None, name="a request"):
        """Press play or pause, move the time bar; return the state the server answers with."""
        text = name.encode()
        body = struct.pack("<BBfBQI", 3, 0 if play else 1, rate, seek is not None, seek or 0, len(text))
        self._socket.send(body + text)
        self.wait(lambda: any(state["request"] == name for state in self.states))
        return next(state for state in self.states if state["request"] == name)

    def wait(self, condition, seconds=10.0):
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, "nothing came in time"
            time.sleep(0.01)

    def wait_for(self, topic, count):
        self.wait(lambda: len(self.of(topic)) >= count)

    def of(self, topic):
        """Log times and digests of the contents of a topic, in the order received."""
        return [(time_ns, data) for name, time_ns, data in list(self.messages) if name == topic]

    def _collect(self):
        with suppress(ConnectionClosed):
            self._take_all()

    def _take_all(self):
        for frame in self._socket:
            if isinstance(frame, str):
                self._text(json.loads(frame))
            elif frame[0] == 1:
                number, time_ns = struct.unpack_from("<IQ", frame, 1)
                self.messages.append((self._topics[number], time_ns, digest(frame[13:])))
            elif frame[0] == 5:
                status, now, speed, jumped, _ = struct.unpack_from("<BQfBI", frame, 1)
                state = {"status": STATUS[status], "now": now, "rate": speed, "jumped": bool(jumped)}
                self.states.append({**state, "request": frame[19:].decode()})

    def _text(self, said):
        if said["op"] == "serverInfo":
            self.info = said
        elif said["op"] == "advertise":
            self.channels |= {channel["topic"]: channel for channel in said["channels"]}
