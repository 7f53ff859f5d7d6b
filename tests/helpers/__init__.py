"""What tests of several rooms share: small inputs, oracles, programs."""
