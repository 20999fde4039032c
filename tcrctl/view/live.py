"""The view of a run while it runs."""

from __future__ import annotations

from typing import Any

from foxglove_schemas_protobuf.Log_pb2 import Log as FoxgloveLog

from tcrctl.log.mcap_file import LOG_TOPIC, STEP_TOPIC
from tcrctl.log.schema import descriptor_set, public_descriptor
from tcrctl.log.viewer_topics import TOPICS
from tcrctl.view.server import HOST, PORT, ViewChannel, ViewServer


class LiveView(ViewServer):
    """Serves what a log writer writes: give :meth:`tap` to it.

    Attributes:
        failure: Why the view has ended before the run, or None. Nothing that happens to it ends the run.
    """

    def __init__(self, name: str, *, host: str = HOST, port: int = PORT) -> None:
        """Start serving; see :class:`ViewServer`.

        Args:
            name: Name of the experiment.
            host: Address to listen at.
            port: Port to listen at; 0 takes a free one.

        Raises:
            InputError: If the package it needs is not installed.
            DeviceError: If the address cannot be used.
        """
        descriptors: dict[str, Any] = {topic: message.DESCRIPTOR for topic, message in TOPICS.items()}
        descriptors |= {LOG_TOPIC: FoxgloveLog.DESCRIPTOR, STEP_TOPIC: public_descriptor("Step")}
        super().__init__(
            [
                ViewChannel(topic, "protobuf", found.full_name, "protobuf", descriptor_set(found))
                for topic, found in descriptors.items()
            ],
            name=f"tcrctl run {name}",
            host=host,
            port=port,
        )
        self.failure: Exception | None = None

    def tap(self, topic: str, time_ns: int, data: bytes) -> None:
        """Send a message; neither waits nor raises. For :class:`tcrctl.log.writer.LogWriter`."""
        if self.failure is not None:
            return
        try:
            self.send(topic, time_ns, data)
        except Exception as error:
            self.failure = error
