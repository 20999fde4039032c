"""The log: one MCAP file per run, in which every control step survives bit for bit.

=====================================  ===========================  =========================================
record                                 schema                       content
=====================================  ===========================  =========================================
attachments, first                     as given                     spec, resolved spec, robot, versions, ...
metadata ``tcrctl.run.start``, first   -                            who, when, what ran, period, clock
``/tcrctl/step``                       ``tcrctl.v1.Step``           one message per step, sequence = k
``/tcrctl/event``, ``/log``            ``tcrctl.v1.Event``,         phase changes, limit trips, stops
                                       ``foxglove.Log``
``/tf``                                ``foxglove.FrameTransforms``  rings and wanted end in the world, <= 20 Hz
``/tip/measured``, ``/tip/reference``  ``foxglove.PoseInFrame``     end poses, <= 20 Hz
``/backbone``                          ``foxglove.PosesInFrame``    ring centres with orientation, <= 20 Hz
``/scene``                             ``foxglove.SceneUpdate``     rods, springs, cables by tension, <= 5 Hz
``/scene/static``                      ``foxglove.SceneUpdate``     rings, end axes, wanted path, once
metadata ``tcrctl.run.stop``, last     -                            status, reason, criteria
=====================================  ===========================  =========================================

Only ``/tcrctl/step`` and ``/tcrctl/event`` are the record of truth; all other topics are derived from them
for viewers (channel metadata ``derived = true``) and rounded. A file without a footer is an
unfinished run: :func:`tcrctl.log.reader.read_log` reads it up to the last flush,
:func:`tcrctl.log.recover.recover` mends it.
"""
