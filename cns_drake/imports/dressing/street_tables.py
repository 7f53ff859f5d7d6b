"""Tables of small objects along streets, from `streets.yaml`."""

from pathlib import Path

from cns_drake.base.yaml_files import parse_yaml

TABLES = parse_yaml(Path(__file__).with_name("streets.yaml").read_bytes())
