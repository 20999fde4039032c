"""The shipped loopback rig where several tests use it at once, on a busy computer."""

from __future__ import annotations

import re
import socket

from tcrctl.config import shipped

PATIENT = "safety: {stale_after_ms: 1000, stale_stop_ms: 4000, silence_stop_ms: 4000, following_mm: 20}"


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


def patient_rig():
    """The shipped loopback rig on ports of its own, which forgives every pause of a busy computer."""
    text = shipped.rigs()["loopback"].read_text()
    text = re.sub(r"^safety:.*$", PATIENT, text, flags=re.MULTILINE)
    for old, new in zip(("15510", "15511", "15600", "15700"), free_ports(4), strict=True):
        text = text.replace(old, str(new))
    return re.sub(r"(port: \d+)}", r"\1, timeout_ms: 400}", text)
