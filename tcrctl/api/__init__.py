"""The program from Python: :func:`tcrctl.run`, :func:`tcrctl.load` and :func:`tcrctl.simulate`."""
