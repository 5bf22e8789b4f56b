"""The link to the autopilot: transports, codec, transfers, the facade ``Autopilot``, tlog, status on the air.

``codec`` is the only module of the project that knows the wire's units; the transfer machines are pure.
"""
