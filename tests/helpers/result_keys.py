"""Keys of rows of results, with usual values."""


def place_key(town="town", **changes):
    """A key of place recognition by BTC in a town, without factors."""
    return {
        "experiment": "e",
        "map": town,
        "database": f"{town}_01",
        "query": f"{town}_02",
        "seed": 1,
        "factors": {},
        "task": "place",
        "method": "btc",
        "verified": False,
        "protocol": "random-yaw",
        **changes,
    }
