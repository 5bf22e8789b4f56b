"""Guidance by vector fields, after Schmitt 2013: a second way of steering that needs no plan.

Fields are small frozen values that compose (``Sum``, ``Rotated``, ``Shifted``, ``Enlarged``, ``Gain``) and are
evaluated on arrays; the last step projects what they say out of the no-go zone, with a hysteresis q::

    field = AttractiveLine().shifted(0.0, 20.0) + RepulsivePoint().shifted(x, y)
    vectors = field(points_en)                                       # (n, 2) -> (n, 2)
    sailing = Projection(field, twd_from_rad=0.0, zone=HysteresisZone(...))
    vector, q = sailing.steer((east, north), q)                      # the boat's own evaluation moves q

``guidance.step`` sails a boat by them in GUIDED: (state, situation) -> (state, setpoint).
"""
