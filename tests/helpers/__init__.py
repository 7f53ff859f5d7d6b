"""Common parts of tests of several rooms: small inputs, oracles, programs."""
