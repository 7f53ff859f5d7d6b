"""Fingerprints: hashes of inputs."""

from evaluation.base import fingerprint


def test_inputs_in_another_order_are_the_same():
    assert fingerprint({"a": 1, "b": [2.5, None]}) == fingerprint(
        {"b": (2.5, None), "a": 1}
    )
    assert fingerprint({"a": 1}) != fingerprint({"a": 2})
