"""A drive on springs: derivatives, closed forms, and one road for all."""

import numpy as np

from cns_drake.motion.body_ride import BodyRide


def test_polynomials_of_degree_5_are_met():
    rng = np.random.default_rng(4)
    polynomials = [np.polynomial.Polynomial(c) for c in rng.normal(size=(3, 6))]

    def at(times):
        return [
            np.stack([one.deriv(k)(times) for one in polynomials], axis=1)
            for k in range(3)
        ]

    body = BodyRide(*at(0.25 * np.arange(9)), 0.25, 0.7)
    # It stops with the last of the given times.
    times = np.linspace(-0.5, 2.5, 61)
    moments = body.at(times)
    np.testing.assert_allclose(
        [moments.q, moments.dq, moments.ddq],
        at(times.clip(0.0, 2.0)),
        atol=1e-10,
    )
    assert moments.pivot == 0.7
