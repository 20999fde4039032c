"""A bridge as one would write it for other cameras; this one stands before a NatNet stream, such as tcrctl emulate.

tcrctl emulate                              # in one terminal
python examples/udp_markers/bridge.py       # in another one
tcrctl rig check examples/udp_markers/rig.yaml
"""

from __future__ import annotations

import json
import socket
import sys

from tcr_hardware.natnet.client import NatNetClient
from tcr_hardware.natnet.frame import OCCLUDED
from tcr_hardware.natnet.settings import NatNetSettings

CAMERAS = NatNetSettings(
    server="127.0.0.1",
    local="127.0.0.1",
    multicast=False,
    command_port=15510,
    data_port=15511,
    bitstream="4.1",
)
TO = ("127.0.0.1", 15520)


def message(frame, names):
    """Return the datagram of one frame."""
    seen = {int(m["id"]): m["position"].tolist() for m in frame.data.markers if not m["params"] & OCCLUDED}
    markers = {label: seen.get(number) for label, number in names.items()}
    return json.dumps({"frame": frame.number, "age_s": frame.age(), "markers": markers}).encode()


def main(cameras=CAMERAS, to=TO, going_on=lambda: True):
    """Send every frame on, for as long as it goes on."""
    client, out, frame = NatNetClient(cameras), socket.socket(socket.AF_INET, socket.SOCK_DGRAM), None
    client.open()
    try:
        client.wait_models()
        while going_on():
            newer = client.wait_next(frame, 0.2)
            if newer is not None and newer.models is not None:
                out.sendto(message(newer, newer.models.labels()), to)
            frame = newer or frame
    finally:
        client.close()
        out.close()


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
